// SPDX-License-Identifier: MIT
//
// What the commands share that draw clouds: into a picture or a page, or on the screen.
module;
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>
export module drawing;

import cilantro;
import cilantro.visualization;
import tool;
using namespace cilantro;

export struct drawing_settings {
  std::vector<std::string> inputs;
  std::string color = "own";
  std::vector<double> direction, up;
  std::vector<int> size{1280, 720}, background{24, 26, 32};
  double point_size = 0;
  bool orthographic = false, quiet = false;
  depth_settings depth;
};

point_coloring coloring_of(const std::string& text) {
  const auto colon = text.find(':');
  const std::string what = text.substr(0, colon);
  const std::string name = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (what == "own" && name.empty()) return own_colors{};
  if (what == "normals" && name.empty()) return by_normal{};
  if (what == "x" || what == "y" || what == "z") return by_coordinate{what[0] - 'x'};
  if (what == "attribute" && !name.empty()) return by_attribute{name};
  if (what == "label" && !name.empty()) return by_label{name};
  throw std::runtime_error{
      "the color must be own, normals, x, y, z, attribute:NAME or label:NAME, and is " + text};
}

/// A layer for each file.
export scene scene_of(const drawing_settings& settings) {
  cloud_look look{.color = coloring_of(settings.color)};
  if (settings.point_size > 0) look.size = splat_pixels{settings.point_size};
  scene all;
  for (const auto& input : settings.inputs) {
    const auto read = read_input(input, settings.depth, settings.quiet);
    std::visit([&](const auto& cloud) { all.set(input, cloud, look); }, read.cloud);
  }
  return all;
}

Eigen::Vector3d vector_of(const std::vector<double>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

export view view_of(const scene& all, const drawing_settings& settings) {
  const view_options options{
      .width = settings.size[0], .height = settings.size[1], .orthographic = settings.orthographic};
  if (settings.direction.empty()) return fit(all, options);
  return fit(all, vector_of(settings.direction),
             settings.up.empty() ? Eigen::Vector3d{0, 0, 1} : vector_of(settings.up), options);
}

/// `look` with the background that was asked for.
export render_options options_of(render_options look, const drawing_settings& settings) {
  for (std::size_t k = 0; k < 3; ++k)
    look.background[k] = static_cast<std::uint8_t>(settings.background[k]);
  return look;
}

/// Shows a scene in a window until it is closed; a click says which point is there.
export void show_on_screen(const scene& all, const view& from, const render_options& drawing);

/// How the result of a command is shown beside what it writes.
export struct result_drawings {
  std::string picture, html;  ///< Files; none if empty.
  bool show = false;          ///< In a window, when the files are complete.

  [[nodiscard]] bool any() const { return !picture.empty() || !html.empty() || show; }
};
export void draw_result(const scene& all, const view& from, const result_drawings& as) {
  if (!as.picture.empty()) write_picture(all, from, as.picture, picture_look);
  if (!as.html.empty()) write_html(all, from, as.html, {.title = as.html});
  if (as.show) show_on_screen(all, from, {});
}
