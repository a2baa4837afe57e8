// SPDX-License-Identifier: MIT
export module cilantro.cloud:depth_cloud;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :point_cloud;

namespace cilantro {

export struct depth_cloud_options {
  /// Normals by central differences; without one are the border and the surroundings of holes.
  bool normals = false;
  /// Whether pixels that know nothing stay in their place as NaN, and the cloud has the width and
  /// height of the image; otherwise they are left out.
  bool organized = false;
  int threads = 0;
};

template <Scalar S>
point_cloud<S, 3> closed_depth_cloud(const image<S>& depth, const pinhole_camera<S>& camera,
                                     const depth_cloud_options& options);

/// What a depth image shows, as a cloud in world coordinates. By default integers are
/// millimetres and floating pixels metres; any `DepthConverter` may say otherwise. Throws as
/// `unproject` does.
export template <Scalar S, ImageSource I, DepthConverter<pixel_of<I>> F = depth_scale>
[[nodiscard]] point_cloud<S, 3> cloud_from_depth(const I& depth, const pinhole_camera<S>& camera,
                                                 const depth_cloud_options& options = {},
                                                 const F& convert = {}) {
  return closed_depth_cloud(to_depth<S>(depth, convert, {.threads = options.threads}), camera,
                            options);
}

template <Scalar S>
point_cloud<S, 3> closed_color_cloud(const image<S>& depth, image_view<rgb> colors,
                                     const pinhole_camera<S>& camera,
                                     const depth_cloud_options& options);

/// As above with colours, of an image that shows what the depth image shows, pixel by pixel.
/// Throws `invalid_input` if the images differ in size.
export template <Scalar S, ImageSource I, ImageSource C,
                 DepthConverter<pixel_of<I>> F = depth_scale>
  requires std::same_as<pixel_of<C>, rgb>
[[nodiscard]] point_cloud<S, 3> cloud_from_rgbd(const I& depth, const C& colors,
                                                const pinhole_camera<S>& camera,
                                                const depth_cloud_options& options = {},
                                                const F& convert = {}) {
  return closed_color_cloud(to_depth<S>(depth, convert, {.threads = options.threads}),
                            image_view{colors}, camera, options);
}

/// A function from depth images to clouds of one camera, for `std::views::transform` over frames.
export template <Scalar S, class F = depth_scale>
[[nodiscard]] auto to_cloud(const pinhole_camera<S>& camera, depth_cloud_options options = {},
                            F convert = {}) {
  return [camera, options, convert = std::move(convert)]<ImageSource I>(const I& depth)
    requires DepthConverter<F, pixel_of<I>>
  { return cloud_from_depth(depth, camera, options, convert); };
}

/// The colours of the points that `seen` says each pixel sees, from 0 to 255.
/// Throws `invalid_input` unless the cloud has colours, and `seen` is of its points.
export template <Scalar S>
[[nodiscard]] image<rgb> project_colors(const point_cloud<S, 3>& cloud,
                                        const image<std::int32_t>& seen,
                                        const rgb& background = {});

}  // namespace cilantro
