// SPDX-License-Identifier: MIT
export module cilantro.registration:align_many;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :align_globally;
import :optimize_poses;

namespace cilantro {

/// A pair of scans that `align_many` has looked at.
export struct scan_pair {
  index_t source = 0, target = 0;  ///< The numbers of the scans, from 0.
  /// What was found; `unique` ones are edges, and so are `degenerate` ones that poses have led to.
  global_status status = global_status::too_few;
  double overlap = 0;  ///< The share of the source's points that lie on the target.
  index_t edge = -1;   ///< The edge of the pose graph that it became, or −1.
};

/// Options of `align_many`.
export struct align_many_options {
  /// As in `global_options`; required.
  double voxel = 0;
  /// As in `global_options`, of each scan in its own coordinates: zeros, if these are those of the
  /// sensor.
  std::optional<coordinates> viewpoint = {};
  bool oriented = false;  ///< As in `global_options`.
  /// Poses to start from, one per scan, such as those of an `odometry`. If given, only pairs that
  /// overlap there are aligned, from there; otherwise all pairs, from anywhere.
  std::vector<any_transform> initial = {};
  /// Once poses are known, pairs of which the smaller share of points on the other scan is at least
  /// this are aligned, too, which closes loops.
  double min_overlap = 0.3;
  /// A robust weight of the edges, as in `pose_graph_options`: pairs that contradict the others are
  /// rejected.
  robust_kernel robust = geman_mcclure{5};
  int threads = 0;
  /// If a stop is requested, `align_many` throws `cancelled`.
  task_monitor monitor = {};
};

/// The result of `align_many`: the poses, from the coordinates of each scan to those of the lowest
/// scan of its component, or to those of `initial`; the edges of the graph and what became of
/// them; and all pairs that were looked at.
export template <int D>
struct align_many_result : pose_graph_result<rigid_transform<double, D>> {
  std::vector<scan_pair> pairs;  ///< By source, then target.
};
/// Prints the lines of the graph, and one about the pairs.
void print_pairs(std::ostream& out, const std::vector<scan_pair>& pairs);
export template <int D>
std::ostream& operator<<(std::ostream& out, const align_many_result<D>& result) {
  out << static_cast<const pose_graph_figures&>(result) << '\n';
  print_pairs(out, result.pairs);
  return out;
}

template <Scalar S, int D>
align_many_result<D> closed_align_many(const std::vector<global_input<S, D>>& scans,
                                       const align_many_options& options);

/// A range of scans that stay where they are.
template <class R>
concept RangeOfScans = std::ranges::random_access_range<R> && std::ranges::sized_range<R> &&
                       std::is_lvalue_reference_v<std::ranges::range_reference_t<const R>> &&
                       PointsSource<std::ranges::range_value_t<R>> &&
                       (dimension_of<std::ranges::range_value_t<R>> == 2 ||
                        dimension_of<std::ranges::range_value_t<R>> == 3);

/// Finds where many scans of one place lie, from anywhere: aligns pairs of them as `align_globally`
/// does, and makes the poses that agree best with all pairs by `optimize_poses`. `scans` is a range
/// of clouds, or of points of another kind, in two or three dimensions.
///
/// From anywhere, only pairs that are `unique` count, each with its information. From the poses
/// that result, pairs that overlap, but were not found, are aligned, also those that leave
/// something undetermined, which does not count; and the graph is optimised again. Scans that
/// nothing connects are in different components, and how these lie to each other is not known:
/// `result.component_of`.
///
/// Coordinates are those of the `points`: origins of clouds are ignored. The same bits for any
/// number of threads. Throws `invalid_input` for options that make no sense, and for another number
/// of initial poses than scans; `cancelled`. O(n²) alignments for n scans without initial poses.
export template <RangeOfScans R>
[[nodiscard]] auto align_many(const R& scans, const align_many_options& options) {
  using P = std::ranges::range_value_t<R>;
  std::vector<global_input<scalar_of<P>, dimension_of<P>>> inputs;
  for (const auto& scan : scans) inputs.push_back({points_in(scan), normals_in(scan), {}});
  return closed_align_many(inputs, options);
}
/// Refused by the compiler with a sentence.
export template <std::ranges::input_range R>
  requires(!RangeOfScans<R>)
void align_many(const R&, const align_many_options&) {
  static_assert(RangeOfScans<R>,
                "align_many: scans are clouds or points in two or three dimensions that are known "
                "to the compiler, in a container such as std::vector, not made on the way");
}

}  // namespace cilantro
