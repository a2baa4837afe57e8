// SPDX-License-Identifier: MIT
//
// Refines a transform between surfaces on their points.
module cilantro.registration:surface_fit;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.search;
import :align;
import :concepts;
import :icp;
import :motion;
import :pair_fit;
import :putative_pairs;
import :residual;
import :surface_check;

namespace cilantro {

/// How far `settle` goes.
struct settle_options {
  double voxel;
  double max_distance;  ///< Of the points of a pair.
  index_t step = 1;     ///< Every `step`-th point of the source is taken.
  int iterations = 15;
  int threads = 0;
  std::stop_token stop = {};
};

/// A proposal after a few iterations of plane-to-plane ICP, and how well it fits, around the
/// centres of the surfaces; nothing if too few points are near. Throws `cancelled`.
template <int D>
std::optional<std::pair<pair_proposal<D>, alignment_fit>> settle(
    const voxel_surface<D>& source, const voxel_surface<D>& target,
    const pair_proposal<D>& proposal, const std::optional<point_vector<double, D>>& up,
    const settle_options& how) {
  const auto some = [&](const point_matrix<double, D>& all) {
    return Eigen::Map<const point_matrix<double, D>, 0, Eigen::OuterStride<>>{
        all.data(), D, (all.cols() + how.step - 1) / how.step, Eigen::OuterStride<>{D * how.step}};
  };
  const auto found =
      align(oriented_points_view<double, D>{some(source.points), some(source.normals)},
            oriented_points_view<double, D>{target.points, target.normals},
            {.metric = generalized_icp{},
             .initial = make_transform<rigid_transform<double, D>>(proposal.rotation,
                                                                   proposal.translation),
             .max_distance = how.max_distance,
             .max_iterations = how.iterations,
             .tolerance = 1e-3 * how.voxel,
             .robust = huber{0.2 * how.voxel},
             .threads = how.threads,
             .monitor = {{}, how.stop}});
  if (found.status == icp_status::cancelled) throw cancelled{};
  if (found.status == icp_status::too_few_pairs) return std::nullopt;
  pair_proposal<D> next;
  next.rotation = found.transform.linear();
  // The source is centred, so that turning it back to the vertical moves it least.
  if (up) next.rotation = rotation_of<D>(next.rotation, up);
  next.translation = found.transform.translation();
  return std::pair{next, static_cast<const alignment_fit&>(found)};
}

/// A fit around a centre of the target, as one around the origin of its coordinates.
template <int D>
alignment_fit around_origin(alignment_fit fit, const point_vector<double, D>& center) {
  if (fit.information.size() == 0) return fit;
  const Eigen::MatrixXd to_center = velocities_of(rigid_motion{}, D).recentering(center);
  fit.information = (to_center.transpose() * fit.information * to_center).eval();
  if (const auto motions = solve(to_center, fit.directions)) fit.directions = *motions;
  return fit;
}

/// A transform between the centres of surfaces, as one between their coordinates.
template <int D>
affine_transform<double, D> between_origins(const pair_proposal<D>& proposal,
                                            const point_vector<double, D>& source_center,
                                            const point_vector<double, D>& target_center) {
  return make_transform<affine_transform<double, D>>(
      proposal.linear(),
      (proposal.translation + target_center - proposal.linear() * source_center).eval());
}

}  // namespace cilantro
