// SPDX-License-Identifier: MIT
export module cilantro.cloud:depth_cloud;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :point_cloud;

namespace cilantro {

/// Options of `cloud_from_depth` and `cloud_from_rgbd`.
export struct depth_cloud_options {
  /// Whether to compute normals, by central differences; at the border and around holes they are
  /// zero.
  bool normals = false;
  /// Whether pixels without depth become points of NaN, and the cloud has the width and height of
  /// the image; otherwise they are left out.
  bool organized = false;
  int threads = 0;
  task_monitor monitor = {};
};

/// The options with one monitor for all passes: depths, points, and normals.
[[nodiscard]] inline depth_cloud_options in_passes(depth_cloud_options options) {
  options.monitor = in_passes(options.monitor, options.normals ? 3 : 2);
  return options;
}

template <Scalar S>
point_cloud<S, 3> closed_depth_cloud(const image<S>& depth, const pinhole_camera<S>& camera,
                                     const depth_cloud_options& options);

/// The points that a depth image shows, as a cloud in world coordinates. By default, integers are
/// millimetres and floating-point pixels metres; another `DepthConverter` can be given. Throws as
/// `unproject` does.
export template <Scalar S, ImageSource I, DepthConverter<pixel_of<I>> F = depth_scale>
[[nodiscard]] point_cloud<S, 3> cloud_from_depth(const I& depth, const pinhole_camera<S>& camera,
                                                 const depth_cloud_options& options = {},
                                                 const F& convert = {}) {
  const auto passes = in_passes(options);
  return closed_depth_cloud(to_depth<S>(depth, convert, {passes.threads, passes.monitor}), camera,
                            passes);
}

template <Scalar S>
point_cloud<S, 3> closed_color_cloud(const image<S>& depth, image_view<rgb> colors,
                                     const pinhole_camera<S>& camera,
                                     const depth_cloud_options& options);

/// As above, with colours from an image that matches the depth image pixel by pixel. Throws
/// `invalid_input` if the images differ in size.
export template <Scalar S, ImageSource I, ImageSource C,
                 DepthConverter<pixel_of<I>> F = depth_scale>
  requires std::same_as<pixel_of<C>, rgb>
[[nodiscard]] point_cloud<S, 3> cloud_from_rgbd(const I& depth, const C& colors,
                                                const pinhole_camera<S>& camera,
                                                const depth_cloud_options& options = {},
                                                const F& convert = {}) {
  const auto passes = in_passes(options);
  return closed_color_cloud(to_depth<S>(depth, convert, {passes.threads, passes.monitor}),
                            image_view{colors}, camera, passes);
}

/// A function that converts depth images of one camera to clouds, for `std::views::transform` over
/// frames.
export template <Scalar S, class F = depth_scale>
[[nodiscard]] auto to_cloud(const pinhole_camera<S>& camera, depth_cloud_options options = {},
                            F convert = {}) {
  return [camera, options, convert = std::move(convert)]<ImageSource I>(const I& depth)
    requires DepthConverter<F, pixel_of<I>>
  { return cloud_from_depth(depth, camera, options, convert); };
}

/// A picture of the cloud's colours, from 0 to 255, where `seen` holds the index of the point that
/// each pixel shows, as `project` finds it; `background` where it shows none. Throws
/// `invalid_input` unless the cloud has colours, and all indices are of its points.
export template <Scalar S>
[[nodiscard]] image<rgb> project_colors(const point_cloud<S, 3>& cloud,
                                        const image<std::int32_t>& seen,
                                        const rgb& background = {});

}  // namespace cilantro
