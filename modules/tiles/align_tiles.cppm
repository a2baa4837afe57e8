// SPDX-License-Identifier: MIT
export module cilantro.tiles:align_tiles;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import cilantro.registration;
import :tiled_cloud;

namespace cilantro {

/// Finds the rigid transform that moves a scan in memory, or a survey, onto another survey, such as
/// a map, each after its steps. As `align` of the same points in memory, by nearest neighbours of
/// the source, but that sums are exact and all is computed in double: the same bits for any tiles,
/// threads and ranks. The transform is relative to `target.origin()`; `in_the_world` converts.
///
/// `.max_distance` must be given: so much of the target is read around each of its tiles that the
/// source meets. Of a scan, as many of these as fit into half of the memory are kept from one
/// iteration to the next; of a survey, each iteration reads both. Normals that `point_to_plane`
/// needs and the target lacks are estimated by `.normals`, anew wherever it is read: better written
/// first. Threads, memory and ranks are those of the survey that is divided: of the source, or of
/// the target for a scan, which all ranks have.
///
/// Of the metrics, there are `point_to_plane` and `point_to_point`, each with a `.robust` kernel.
/// Throws `invalid_input` for the other metrics; for `.scales`, `.graduation`, `.reciprocal`,
/// `.one_to_one`, `.fraction` and `.threads`; for a transform to start from that is not rigid; for
/// normals that are not of unit length; and for steps of the target that move points. Throws what
/// reading and steps throw. Bad data does not throw: the status says what is wrong, also that a
/// stop was requested; other ranks than the one that was told so throw. O(N log M) an iteration.
/// Source: Besl & McKay 1992; Chen & Medioni 1992, as in `align`.
export template <Scalar S, int D>
[[nodiscard]] icp_result<rigid_transform<double, D>> align(const point_cloud<S, D>& source,
                                                           const tiled_cloud<S, D>& target,
                                                           const align_options& options);
export template <Scalar S, int D>
[[nodiscard]] icp_result<rigid_transform<double, D>> align(const tiled_cloud<S, D>& source,
                                                           const tiled_cloud<S, D>& target,
                                                           const align_options& options);

/// How well a scan in memory, or a survey, lies on a survey under a transform relative to
/// `target.origin()`: the figures that `align` returns for its result. Throws `cancelled`.
export template <Scalar S, int D, class Source>
  requires std::same_as<Source, point_cloud<S, D>> || std::same_as<Source, tiled_cloud<S, D>>
[[nodiscard]] alignment_fit evaluate(const Source& source, const tiled_cloud<S, D>& target,
                                     const any_transform& transform, align_options options) {
  options.initial = transform;
  options.max_iterations = 0;
  const auto found = align(source, target, options);
  if (found.status == icp_status::cancelled) throw cancelled{};
  return found;
}

/// The transform that `align` has found onto a survey, as one of world coordinates:
/// `transform(scan, in_the_world(found, survey))`.
export template <Scalar S, int D>
[[nodiscard]] rigid_transform<double, D> in_the_world(
    const icp_result<rigid_transform<double, D>>& found, const tiled_cloud<S, D>& target) {
  const auto& t = found.transform;
  const point_vector<double, D> origin = target.origin();
  return make_transform<rigid_transform<double, D>>(
      t.linear(), (t.translation() + origin - t.linear() * origin).eval());
}

}  // namespace cilantro
