// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.registration;

namespace cilantro {

template <Scalar S, int D>
prepared_points<S, D> prepare(const align_input<S, D>& input, double voxel, bool needs_normals,
                              const neighborhood_spec& spec, const execution& how) {
  prepared_points<S, D> prepared{.given = input.surface, .values = input.values};
  const auto& [points, normals] = input.surface;
  if (voxel > 0 && !points.empty()) {
    const voxel_grid<S, D> grid{
        points, voxel, {.origin = input.anchor, .threads = how.threads, .monitor = how.monitor}};
    prepared.points = group_means(points, grid.groups(), {.threads = how.threads});
    if (needs_normals && input.surface.has_normals())
      prepared.normals = group_directions(normals, grid.groups(), {.threads = how.threads});
    if (const auto& values = input.values.values; !values.empty()) {
      const points_view<double, dynamic> one_each{values.data(), std::ssize(values), 1, 1};
      const auto means = group_means(one_each, grid.groups(), {.threads = how.threads});
      prepared.values.values.assign(means.data(), means.data() + means.size());
    }
    prepared.given = {};
  }
  if (needs_normals && !prepared.view().has_normals() && !prepared.view().points.empty())
    prepared.normals = estimate_normals(prepared.view().points, spec,
                                        {.threads = how.threads, .monitor = how.monitor})
                           .normals;
  return prepared;
}

/// How wide a graduated kernel is after another iteration.
double narrowed(double widening) {
  return std::max(1.0, widening / 1.4);
}
/// Iterations until a kernel that starts so wide is as wide as given.
int narrowing_iterations(double widening) {
  int count = 0;
  while (widening > 1) {
    widening = narrowed(widening);
    ++count;
  }
  return count;
}

void expect_valid_graduation(const align_options& options) {
  expects(options.graduation >= 1 && std::isfinite(options.graduation),
          "align: graduation must be finite and at least 1: how many times as wide as given the "
          "robust kernel starts");
  expects(static_cast<bool>(options.robust), "align: .graduation needs a .robust kernel");
  const int least = narrowing_iterations(options.graduation) + 1;
  expects(least <= options.max_iterations,
          "align: with this .graduation, .max_iterations must be " + std::to_string(least) +
              " or more");
}

template <Scalar S, int D, class T>
icp_result<T> align_scales(const align_input<S, D>& source, const align_input<S, D>& target,
                           const align_start<T>& start, const align_options& options,
                           bool needs_source_normals, bool needs_target_normals,
                           const estimator_maker<S, D, T>& make_estimator) {
  const std::vector<align_scale> scales =
      options.scales.empty() ? std::vector<align_scale>{{0, options.max_distance}} : options.scales;
  expects(options.scales.empty() || options.max_distance == std::numeric_limits<double>::infinity(),
          "align: .max_distance must be left out if there are .scales, which have one each");
  for (std::size_t k = 0; k < scales.size(); ++k) {
    expect_between(0, scales[k].voxel, std::numeric_limits<double>::max(),
                   "align: the voxel of a scale");
    expect_from(0, scales[k].max_distance, "align: the max_distance of a scale");
    expects(scales[k].voxel <= scales[k].max_distance,
            "align: the voxel of a scale is larger than its max_distance");
    expects(k == 0 || (scales[k].voxel <= scales[k - 1].voxel &&
                       scales[k].max_distance <= scales[k - 1].max_distance),
            "align: scales must go from coarse to fine");
  }
  icp_result<T> result;
  result.transform = start.transform;
  int iterations = 0;
  for (std::size_t k = 0; k < scales.size(); ++k) {
    const auto& scale = scales[k];
    task_monitor monitor{{}, options.monitor.stop};
    if (options.monitor.progress)
      monitor.progress = [&](double done) {
        options.monitor.progress((double(k) + done) / double(scales.size()));
      };
    try {
      // Only the loop tells how far it is.
      const task_monitor stop_only{{}, options.monitor.stop};
      const execution how{options.threads, stop_only};
      const auto moving = prepare(source, scale.voxel, needs_source_normals, options.normals, how);
      const auto onto = prepare(target, scale.voxel, needs_target_normals, options.normals, how);
      const nearest_neighbor_searcher<S, D> searcher{moving.view(),
                                                     onto.view(),
                                                     {.max_distance = scale.max_distance,
                                                      .reciprocal = options.reciprocal,
                                                      .one_to_one = options.one_to_one,
                                                      .fraction = options.fraction,
                                                      .threads = options.threads},
                                                     stop_only};
      auto observer = start.observer;
      if (start.widening) {
        *start.widening = options.graduation;
        observer = [&](const icp_iteration<T>& now) {
          *start.widening = narrowed(*start.widening);
          if (start.observer) start.observer(now);
        };
      }
      auto next =
          icp(searcher, make_estimator(moving, onto), result.transform,
              {.max_iterations = options.max_iterations,
               .min_iterations = start.widening ? narrowing_iterations(options.graduation) + 1 : 0,
               .tolerance = options.tolerance,
               .observer = observer,
               .monitor = monitor});
      // Stopped before it looked at anything: then the figures are those of the scale before.
      if (next.status == icp_status::cancelled && next.pairs == 0) throw cancelled{};
      iterations += next.iterations;
      result = std::move(next);
    } catch (const cancelled&) {
      result.status = icp_status::cancelled;
    }
    result.iterations = iterations;
    if (result.status == icp_status::too_few_pairs || result.status == icp_status::cancelled) break;
  }
  if (options.monitor.progress && result.status == icp_status::too_few_pairs)
    options.monitor.progress(1);
  return result;
}

#define CILANTRO_INSTANTIATE(S, D)                                                        \
  template prepared_points<S, D> prepare(const align_input<S, D>&, double, bool,          \
                                         const neighborhood_spec&, const execution&);     \
  template icp_result<rigid_transform<S, D>> align_scales<S, D, rigid_transform<S, D>>(   \
      const align_input<S, D>&, const align_input<S, D>&,                                 \
      const align_start<rigid_transform<S, D>>&, const align_options&, bool, bool,        \
      const estimator_maker<S, D, rigid_transform<S, D>>&);                               \
  template icp_result<affine_transform<S, D>> align_scales<S, D, affine_transform<S, D>>( \
      const align_input<S, D>&, const align_input<S, D>&,                                 \
      const align_start<affine_transform<S, D>>&, const align_options&, bool, bool,       \
      const estimator_maker<S, D, affine_transform<S, D>>&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

#define CILANTRO_INSTANTIATE(S, D)                                                   \
  template icp_result<rigid_transform<S, D>> align_by_options<rigid_motion, S, D>(   \
      const align_input<S, D>&, const align_input<S, D>&,                            \
      const align_start<rigid_transform<S, D>>&, const align_options&);              \
  template icp_result<affine_transform<S, D>> align_by_options<affine_motion, S, D>( \
      const align_input<S, D>&, const align_input<S, D>&,                            \
      const align_start<affine_transform<S, D>>&, const align_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
