// SPDX-License-Identifier: MIT
module;
#include "cloud/color.hpp"
module cilantro.cloud;

namespace cilantro {
namespace {

template <Scalar S>
point_cloud<S, 3> organized_cloud(const image<S>& depth, const pinhole_camera<S>& camera,
                                  const depth_cloud_options& options) {
  const execution how{options.threads, options.monitor};
  point_cloud<S, 3> cloud;
  cloud.points = unproject(depth, camera, depth_scale{}, how);
  if (options.normals) cloud.normals = organized_normals(cloud.points, camera, how);
  cloud.width = depth.width();
  cloud.height = depth.height();
  return cloud;
}

template <Scalar S>
point_cloud<S, 3> finished(point_cloud<S, 3> cloud, const depth_cloud_options& options) {
  if (options.organized) return cloud;
  cloud.width = cloud.height = 0;
  return remove_invalid(std::move(cloud));
}

}  // namespace

template <Scalar S>
point_cloud<S, 3> closed_depth_cloud(const image<S>& depth, const pinhole_camera<S>& camera,
                                     const depth_cloud_options& options) {
  if (!options.organized && !options.normals)
    return {.points = unproject_known(depth, camera, {options.threads, options.monitor})};
  return finished(organized_cloud(depth, camera, options), options);
}

template <Scalar S>
point_cloud<S, 3> closed_color_cloud(const image<S>& depth, image_view<rgb> colors,
                                     const pinhole_camera<S>& camera,
                                     const depth_cloud_options& options) {
  expects(colors.width() == depth.width() && colors.height() == depth.height(),
          "cloud_from_rgbd: the two images must have the same size");
  auto cloud = organized_cloud(depth, camera, options);
  cloud.colors.resize(3, cloud.size());
  for (index_t i = 0; i < cloud.size(); ++i) {
    const rgb& color = colors(static_cast<int>(i % cloud.width), static_cast<int>(i / cloud.width));
    for (std::size_t c = 0; c < 3; ++c)
      cloud.colors(static_cast<index_t>(c), i) = detail::from_eight_bit(color[c]);
  }
  return finished(std::move(cloud), options);
}

template <Scalar S>
image<rgb> project_colors(const point_cloud<S, 3>& cloud, const image<std::int32_t>& seen,
                          const rgb& background) {
  expects(cloud.has_colors() || cloud.empty(), "project_colors: the cloud has no colors");
  expects(std::ranges::all_of(seen.pixels(), [&](std::int32_t i) { return i < cloud.size(); }),
          "project_colors: a pixel has an index that is not one of the points");
  return paint(
      seen,
      [&](index_t i) {
        rgb color;
        for (std::size_t c = 0; c < 3; ++c)
          color[c] = detail::to_eight_bit(cloud.colors(static_cast<index_t>(c), i));
        return color;
      },
      background);
}

#define CILANTRO_INSTANTIATE(S)                                                                \
  template point_cloud<S, 3> closed_depth_cloud(const image<S>&, const pinhole_camera<S>&,     \
                                                const depth_cloud_options&);                   \
  template point_cloud<S, 3> closed_color_cloud(                                               \
      const image<S>&, image_view<rgb>, const pinhole_camera<S>&, const depth_cloud_options&); \
  template image<rgb> project_colors(const point_cloud<S, 3>&, const image<std::int32_t>&,     \
                                     const rgb&);
CILANTRO_INSTANTIATE(float)
CILANTRO_INSTANTIATE(double)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
