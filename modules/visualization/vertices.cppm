// SPDX-License-Identifier: MIT
//
// What drawing on a graphics card needs of this module. For `cilantro.window`.
export module cilantro.visualization:vertices;

import cilantro.standard;
import cilantro.core;
import :canvas;
import :render;
import :scene;
import :view;

namespace cilantro {

/// All of shaders.glsl.
[[nodiscard]] std::string_view shader_text();

namespace detail {

/// A section of shaders.glsl, such as `points.vertex`. Precondition: there is one of that name.
export [[nodiscard]] std::string shader(std::string_view section);

/// Points as the shaders read them.
export struct point_vertices {
  /// `4 × N`: red, green, blue, and the size from 0, the smallest, to 255, in equal ratios.
  Eigen::Matrix<std::uint8_t, 4, dynamic> colors;
  /// `2 × N`, from −127 to 127: octahedral, −127 twice for none; or no columns.
  Eigen::Matrix<std::int8_t, 2, dynamic> normals;
  float smallest, largest;  ///< Sizes.
};
export [[nodiscard]] point_vertices vertices_of(const point_batch& batch);

/// Draws the texts and bars of colours of a scene over a picture, as `render` does.
export void draw_texts(image<rgb>& over, const scene& all, const view& from,
                       const render_options& options);

/// Where the eye of a picture is, and its numbers in the pixels of it, as `render` has them.
export struct picture_camera {
  Eigen::Matrix3d to_camera;       ///< A rotation.
  Eigen::Vector3d eye;             ///< In the world.
  double fx, fy, cx, cy, nearest;  ///< In pixels, and what is nearer is not seen.
};
export [[nodiscard]] picture_camera camera_of(const view& from, int width, int height);

}  // namespace detail
}  // namespace cilantro
