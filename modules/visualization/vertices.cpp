// SPDX-License-Identifier: MIT
module cilantro.visualization;

import :overlay;
import :packing;
import :projector;

namespace cilantro {
namespace {

constexpr char shaders[] = {
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wc23-extensions"
#embed "shaders.glsl" suffix(, )
#pragma clang diagnostic pop
    '\0'};

}  // namespace

std::string_view shader_text() {
  return shaders;
}

namespace detail {

std::string shader(std::string_view section) {
  const std::string begin = "//! " + std::string{section} + "\n";
  std::string_view text = shader_text();
  const auto at = text.find(begin);
  expects(at != text.npos, "there is no shader " + std::string{section});
  text.remove_prefix(at + begin.size());
  return std::string{text.substr(0, text.find("//! "))};
}

point_vertices vertices_of(const point_batch& batch) {
  const index_t n = batch.points.cols();
  const size_scale sizes{batch.size};
  point_vertices result{{4, n}, {2, batch.normals.cols()}, sizes.low, sizes.high};
  for (index_t i = 0; i < n; ++i) {
    const float size = batch.size.sizes[batch.size.sizes.size() == 1 ? 0 : i];
    result.colors.col(i) << batch.colors.col(batch.colors.cols() == 1 ? 0 : i),
        static_cast<std::uint8_t>(sizes.at(size));
  }
  for (index_t i = 0; i < batch.normals.cols(); ++i) {
    const auto bytes = octahedral(batch.normals.col(i));
    for (int k = 0; k < 2; ++k)
      result.normals(k, i) =
          static_cast<std::int8_t>(static_cast<int>(bytes[std::size_t(k)]) - 127);
  }
  return result;
}

void draw_texts(image<rgb>& over, const scene& all, const view& from,
                const render_options& options) {
  draw_overlay(over, all, projector{from, over.width(), over.height(), 1}, options);
}

picture_camera camera_of(const view& from, int width, int height) {
  const projector by{from, width, height, 1};
  return {by.to_camera, by.eye, by.fx, by.fy, by.cx, by.cy, by.nearest};
}

}  // namespace detail
}  // namespace cilantro
