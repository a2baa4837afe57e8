// SPDX-License-Identifier: MIT
module;
#include <ostream>

#include "core/closed_spaces.hpp"
module cilantro.registration;

import cilantro.eigen;
import :global_problem;
import :global_registration;
import :surface_check;
import :surface_description;
import :surface_fit;

namespace cilantro {
namespace {

template <int D>
std::optional<point_vector<double, D>> vertical(const std::optional<coordinates>& up) {
  if (!up) return std::nullopt;
  expects(D == 3, "align_globally: .up is for three dimensions");
  const auto direction =
      up->as<double, D>(D, "align_globally: .up must have the dimension of the points");
  expects(is_finite(direction) && direction.norm() > 0,
          "align_globally: .up must be finite, and not zero");
  return direction.normalized();
}

template <int D>
putative_pairs<D> empty_pairs(const global_options& options, double voxel, bool oriented) {
  putative_pairs<D> pairs;
  pairs.max_distance = options.max_distance.value_or(2 * voxel);
  pairs.oriented = oriented;
  pairs.up = vertical<D>(options.up);
  pairs.any_scale = options.scales.has_value();
  return pairs;
}

void expect_valid(const global_options& options) {
  expect_between(0, options.voxel, std::numeric_limits<double>::max(), "align_globally: voxel");
  if (options.scales)
    expects(options.scales->smallest > 0 && options.scales->smallest <= options.scales->largest &&
                std::isfinite(options.scales->largest),
            "align_globally: scales must be positive, and the smallest one at most the largest");
  if (options.max_distance)
    expects(*options.max_distance > 0 && std::isfinite(*options.max_distance),
            "align_globally: max_distance must be positive and finite");
}

template <int D>
found_globally align_voxels(const voxel_surface<D>& source, const voxel_surface<D>& target,
                            double voxel, bool oriented, const global_options& options) {
  global_problem<D> problem;
  problem.pairs = empty_pairs<D>(options, voxel, oriented);
  problem.set_surfaces(source, target, voxel);
  match_surfaces(problem, options);
  return global_registration<D>{problem, options}.run();
}

template <Scalar S, int D>
found_globally align_pairs(const global_input<S, D>& source, const global_input<S, D>& target,
                           const index_list& sources, const index_list& targets,
                           const global_options& options) {
  global_problem<D> problem;
  problem.pairs =
      empty_pairs<D>(options, options.voxel,
                     options.oriented || (options.source_viewpoint && options.target_viewpoint));
  std::optional<voxel_surface<D>> moving, onto;
  if (options.voxel > 0) {
    moving = reduced_to_voxels(source, source_options(options));
    onto = reduced_to_voxels(target, target_options(options));
    problem.set_surfaces(*moving, *onto, options.voxel);
  }
  take_pairs(problem, source, target, sources, targets);
  return global_registration<D>{problem, options}.run();
}

}  // namespace

found_globally unless_cancelled(const std::function<found_globally()>& f) {
  try {
    return f();
  } catch (const cancelled&) {
    found_globally result;
    result.status = global_status::cancelled;
    return result;
  }
}

found_globally align_descriptions(const surface_description& source,
                                  const surface_description& target,
                                  const global_options& options) {
  expect_valid(options);
  expect_scales(options, false);
  expects(source.voxel == target.voxel,
          "align_globally: source and target have been described with different voxels");
  expects(source.oriented == target.oriented,
          "align_globally: of source and target, only one has a viewpoint or oriented normals");
  return unless_cancelled([&] {
    if (source.flat && target.flat)
      return align_voxels(*source.flat, *target.flat, source.voxel, source.oriented, options);
    if (source.solid && target.solid)
      return align_voxels(*source.solid, *target.solid, source.voxel, source.oriented, options);
    // Without points, there is no dimension.
    expects(voxels_of(source) == 0 || voxels_of(target) == 0,
            "align_globally: source and target must have the same dimension");
    report(options, 1);
    return found_globally{};
  });
}

template <Scalar S, int D>
found_globally closed_align_globally(const global_input<S, D>& source,
                                     const global_input<S, D>& target, const index_list& sources,
                                     const index_list& targets, const global_options& options) {
  expect_valid(options);
  expects(options.voxel > 0 || options.max_distance,
          "align_globally: from pairs alone, .max_distance is required: how far apart the points "
          "of a right pair may be");
  expects(options.voxel > 0 ||
              (!options.source_viewpoint && !options.target_viewpoint && !options.normals),
          "align_globally: viewpoints and normals need a .voxel");
  expects(!options.features, "align_globally: .features has no effect if pairs are given");
  return unless_cancelled([&] {
    if constexpr (D != dynamic) {
      return align_pairs(source, target, sources, targets, options);
    } else {
      const index_t d = std::max(source.points.dimension(), target.points.dimension());
      expects(source.points.empty() || target.points.empty() ||
                  source.points.dimension() == target.points.dimension(),
              "align_globally: source and target must have the same dimension");
      if (d == 2)
        return align_pairs(fixed_input<2>(source), fixed_input<2>(target), sources, targets,
                           options);
      expects(d == 3 || (source.points.empty() && target.points.empty()),
              "align_globally: points must have two or three dimensions");
      return align_pairs(fixed_input<3>(source), fixed_input<3>(target), sources, targets, options);
    }
  });
}

surface_options source_options(const global_options& o) {
  return {o.voxel, o.normals, o.features, o.oriented, o.source_viewpoint, o.threads, o.monitor};
}
surface_options target_options(const global_options& o) {
  return {o.voxel, o.normals, o.features, o.oriented, o.target_viewpoint, o.threads, o.monitor};
}
void expect_scales(const global_options& options, bool are_searched) {
  expects(options.scales.has_value() == are_searched,
          "align_globally: .scales is for align_globally<similarity_motion>, which requires it");
  expects(!are_searched || options.voxel == 0,
          "align_globally<similarity_motion>: from pairs alone; there can be no .voxel");
}
void expect_no_surface_options(const global_options& options) {
  expects(options.voxel == 0 && !options.normals && !options.features && !options.oriented &&
              !options.source_viewpoint && !options.target_viewpoint,
          "align_globally: voxel, normals, features, oriented and viewpoints are options of "
          "describe_surface, which has been called already");
}

std::vector<pair_proposal<2>> any_pair_solver::propose(const putative_pairs<2>& pairs,
                                                       const execution& how) const {
  expects(flat_ != nullptr, "align_globally: the solver is not for two dimensions");
  return flat_(pairs, how);
}
std::vector<pair_proposal<3>> any_pair_solver::propose(const putative_pairs<3>& pairs,
                                                       const execution& how) const {
  expects(solid_ != nullptr, "align_globally: the solver is not for three dimensions");
  return solid_(pairs, how);
}

std::string_view to_string(global_status status) {
  switch (status) {
    case global_status::unique:
      return "unique";
    case global_status::ambiguous:
      return "ambiguous";
    case global_status::too_few:
      return "too few";
    case global_status::degenerate:
      return "degenerate";
    case global_status::cancelled:
      return "cancelled";
  }
  return "unknown";
}
std::ostream& operator<<(std::ostream& out, global_status status) {
  return out << to_string(status);
}
void print_figures(std::ostream& out, global_status status, index_t inliers, index_t matches,
                   std::size_t alternatives, const alignment_fit& fit) {
  out << status << ", " << inliers << " of " << matches << " pairs agree, overlap " << fit.overlap
      << ", rmse " << fit.rmse << ", " << alternatives << " alternatives";
}

#define CILANTRO_INSTANTIATE(S, D)                                                            \
  template found_globally closed_align_globally(const global_input<S, D>&,                    \
                                                const global_input<S, D>&, const index_list&, \
                                                const index_list&, const global_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
