// SPDX-License-Identifier: MIT
export module cilantro.registration:odometry;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.cloud;
import :align;
import :concepts;
import :normal_equations;

namespace cilantro {

/// What became of a frame of an odometry.
export enum class odometry_status {
  first,    ///< The map begins with it.
  tracked,  ///< It was aligned to the map.
  /// It was aligned, but the map does not determine its pose along some directions, in which it is
  /// as predicted. It is not in the map.
  degenerate,
  lost,  ///< Too little of it lies on the map. Its pose is predicted, and it is not in the map.
};
export [[nodiscard]] std::string_view to_string(odometry_status status);
export std::ostream& operator<<(std::ostream& out, odometry_status status);

/// Options of `odometry`. Lengths are in the units of the points.
export struct odometry_options {
  /// The map keeps one point in each cell with this edge. Required. Several times the noise of the
  /// sensor: finer maps take longer and are no more precise.
  double voxel = 0;
  /// The edge of the cells to which a frame is reduced before it is aligned. 0: one and a half
  /// times `voxel`.
  double frame_voxel = 0;
  /// Points of a frame and of the map that are farther apart are never paired: as far as a frame
  /// may be from where it is predicted. Frames that are predicted well are paired within less. 0:
  /// ten times `voxel`.
  double max_distance = 0;
  /// Points of the map that are farther away from the latest frame in it are dropped, and so are
  /// points of a frame that are farther from its origin. 0: all of a frame takes part, and the map
  /// reaches one and a half times as far as the farthest point of any frame.
  double map_radius = 0;
  /// A frame enters the map if less than this share of it lies on the map, or if it is this far, in
  /// voxels or degrees, from the last that did.
  double new_overlap = 0.9, new_voxels = 5, new_degrees = 5;
  /// A frame of which a smaller share lies on the map, within three voxels, is lost. In a room,
  /// with voxels of 3 and 5 cm, up to 0.65 was seen of frames that lie wrong, and 0.8 or more of
  /// those that lie right; of coarser ones, also more of frames that lie wrong.
  double min_overlap = 0.7;
  std::optional<any_transform> initial = {};  ///< The pose of the first frame, if not the identity.
  metric_choice metric = point_to_plane{};    ///< As in `align_options`.
  /// As in `align_options`; `geman_mcclure`, with a third of the distance within which points are
  /// paired, if not given.
  robust_kernel robust = {};
  /// Neighbourhoods for estimating the normals of the map, if the frames have none.
  neighborhood_spec normals = knn{10};
  int max_iterations = 30;       ///< As in `align_options`.
  truncated_solver solver = {};  ///< As in `align_options`.
  int threads = 0;
  /// If a stop is requested, `odometry` returns what it has so far, with `was_stopped`.
  task_monitor monitor = {};
};

/// One frame of an odometry.
export template <int D>
struct odometry_frame {
  /// From the coordinates of the frame to those of the first frame, or to the world if `initial` is
  /// given.
  rigid_transform<double, D> pose;
  odometry_status status = odometry_status::first;  ///< What became of it.
  bool is_in_map = false;                           ///< Whether its points were added to the map.
  double max_distance = 0;                          ///< Within which its points were paired.
  /// How it lies on the map, with information about the origin of the map; of no pairs for the
  /// first frame.
  alignment_fit fit;
};

template <Scalar S, int D>
struct odometry_state;

/// Follows a sensor from scan to scan: aligns each frame to a map of those before it, and adds it
/// to that map. For live use; `odometry` does it for a range of frames.
///
/// The next pose is predicted by moving on as between the last two frames; behind a frame that is
/// lost, by staying there. Where that fails, the frame is looked for where the last one was that
/// was not lost.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
class odometry_tracker {
 public:
  /// Throws `invalid_input` for options that make no sense.
  explicit odometry_tracker(odometry_options options);
  odometry_tracker(odometry_tracker&&) noexcept;
  odometry_tracker& operator=(odometry_tracker&&) noexcept;
  ~odometry_tracker();

  /// Follows one more frame, in the coordinates of the sensor. Normals and colours go to the map;
  /// either all frames have them, or none; points that are not finite are ignored. Throws
  /// `invalid_input` for a frame with an origin, or with other data than the first, and
  /// `cancelled`; it is then as if the frame had not been there. O((M + N) log (M + N)) for M
  /// points in the map and N in the frame, which is about as fast as a step of `align`.
  odometry_frame<D> add(const point_cloud<S, D>& frame);

  /// The map: points, normals, and colours if the frames have them, in the coordinates of the
  /// poses. Its origin is near the latest frame.
  [[nodiscard]] const point_cloud<S, D>& map() const [[clang::lifetimebound]];

 private:
  std::unique_ptr<odometry_state<S, D>> state_;
};

/// The result of `odometry`.
export template <Scalar S, int D>
struct odometry_result {
  std::vector<odometry_frame<D>> frames;  ///< One for each frame, in their order.
  point_cloud<S, D> map;                  ///< As `odometry_tracker::map`, at the end.
  bool was_stopped = false;               ///< Whether a stop was requested before the last frame.

  /// The poses of all frames, those that are lost included.
  [[nodiscard]] std::vector<rigid_transform<double, D>> poses() const {
    std::vector<rigid_transform<double, D>> all;
    for (const auto& frame : frames) all.push_back(frame.pose);
    return all;
  }
  /// The numbers of the frames that are lost, ascending.
  [[nodiscard]] std::vector<index_t> lost() const {
    std::vector<index_t> numbers;
    for (index_t i = 0; i < std::ssize(frames); ++i)
      if (frames[i].status == odometry_status::lost) numbers.push_back(i);
    return numbers;
  }
};

/// Ends a sequence of frames: `frames | each(prepare) | odometry({.voxel = 0.02})` finds the pose
/// of each frame and a map of them all, as `odometry_tracker` does. Frames are clouds of the same
/// scalar, in 2D or 3D, in the coordinates of the sensor; where their number is known, progress is
/// reported. The same bits for any number of threads. Throws `invalid_input` as `odometry_tracker`
/// does.
/// Source: Vizzo et al. 2023, "KISS-ICP: in defense of point-to-point ICP", for the prediction and
/// the distance within which points are paired.
export [[nodiscard]] auto odometry(odometry_options options) {
  return range_closure{
      [options = std::move(options)]<std::ranges::input_range R>(R&& frames)
        requires PointCloud<std::remove_cvref_t<std::ranges::range_reference_t<R>>>
      {
        using cloud = std::remove_cvref_t<std::ranges::range_reference_t<R>>;
        odometry_tracker<typename cloud::scalar, cloud::static_dimension> tracker{options};
        odometry_result<typename cloud::scalar, cloud::static_dimension> result;
        const auto report = [&] {
          if constexpr (std::ranges::sized_range<R>)
            if (options.monitor.progress)
              options.monitor.progress(double(result.frames.size()) /
                                       double(std::ranges::size(frames)));
        };
        try {
          for (auto&& frame : frames) {
            result.frames.push_back(tracker.add(frame));
            report();
          }
        } catch (const cancelled&) {
          result.was_stopped = true;
        }
        result.map = tracker.map();
        return result;
      }};
}

extern template class odometry_tracker<float, 2>;
extern template class odometry_tracker<float, 3>;
extern template class odometry_tracker<double, 2>;
extern template class odometry_tracker<double, 3>;

}  // namespace cilantro
