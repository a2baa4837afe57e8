// SPDX-License-Identifier: MIT
//
// What `align_globally` is given: two sets, and pairs between them, most of which may be wrong.
module cilantro.registration:global_problem;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import :align_globally;
import :correspondence;
import :match_features;
import :putative_pairs;
import :surface_check;

namespace cilantro {

template <int D>
void resize(putative_pairs<D>& pairs, index_t count, bool with_normals) {
  for (auto* matrix : {&pairs.source, &pairs.target}) matrix->resize(D, count);
  if (with_normals)
    for (auto* matrix : {&pairs.source_normals, &pairs.target_normals}) matrix->resize(D, count);
}

/// The two sets, and pairs between them.
template <int D>
struct global_problem {
  const voxel_surface<D>*source = nullptr, *target = nullptr;  ///< Null if there is no voxel.
  double voxel = 0;
  putative_pairs<D> pairs;        ///< Around the centres of both.
  correspondences<double> given;  ///< The pairs by the indices of points.
  point_vector<double, D> source_center = point_vector<double, D>::Zero(),
                          target_center = point_vector<double, D>::Zero();

  void set_surfaces(const voxel_surface<D>& moving, const voxel_surface<D>& onto, double edge) {
    source = &moving;
    target = &onto;
    source_center = moving.center;
    target_center = onto.center;
    voxel = edge;
  }
};

/// Pairs of voxels whose features are each other's nearest.
template <int D>
void match_surfaces(global_problem<D>& problem, const global_options& options) {
  const auto &source = *problem.source, &target = *problem.target;
  const auto matches =
      match_features(source.features, target.features,
                     {.threads = options.threads, .monitor = {{}, options.monitor.stop}});
  auto& pairs = problem.pairs;
  resize(pairs, std::ssize(matches), true);
  for (index_t i = 0; i < std::ssize(matches); ++i) {
    const auto s = source.described[matches[i].source], t = target.described[matches[i].target];
    pairs.source.col(i) = source.points.col(s);
    pairs.target.col(i) = target.points.col(t);
    pairs.source_normals.col(i) = source.normals.col(s);
    pairs.target_normals.col(i) = target.normals.col(t);
    pairs.numbers.push_back(static_cast<std::int32_t>(i));
    problem.given.push_back({source.first[s], target.first[t], double(matches[i].distance)});
  }
}

/// The pairs that were given, without those of points that are not finite.
template <Scalar S, int D>
void take_pairs(global_problem<D>& problem, const global_input<S, D>& source,
                const global_input<S, D>& target, const index_list& sources,
                const index_list& targets) {
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const auto s = sources[i], t = targets[i];
    expects(0 <= s && s < source.points.size() && 0 <= t && t < target.points.size(),
            "align_globally: a pair has an index that is not one of a point");
    problem.given.push_back({s, t, 0});
    if (is_finite(source.points[s]) && is_finite(target.points[t]))
      problem.pairs.numbers.push_back(static_cast<std::int32_t>(i));
  }
  auto& pairs = problem.pairs;
  const index_t count = std::ssize(pairs.numbers);
  const bool with_normals = !source.normals.empty() && !target.normals.empty();
  resize(pairs, count, with_normals);
  const auto normal_or_zero = [](const auto& normal) {
    return is_finite(normal) ? normal.template cast<double>().eval()
                             : point_vector<double, D>::Zero().eval();
  };
  for (index_t i = 0; i < count; ++i) {
    const auto& [s, t, distance] = problem.given[pairs.numbers[i]];
    pairs.source.col(i) = source.points[s].template cast<double>();
    pairs.target.col(i) = target.points[t].template cast<double>();
    if (!with_normals) continue;
    pairs.source_normals.col(i) = normal_or_zero(source.normals[s]);
    pairs.target_normals.col(i) = normal_or_zero(target.normals[t]);
  }
  if (!problem.source && count > 0) {
    problem.source_center = pairs.source.rowwise().mean();
    problem.target_center = pairs.target.rowwise().mean();
  }
  pairs.source.colwise() -= problem.source_center;
  pairs.target.colwise() -= problem.target_center;
}

}  // namespace cilantro
