// SPDX-License-Identifier: MIT
//
// What the commands share that draw clouds: into a picture or a page, or on the screen.
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
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

/// What all numbers that are coloured lie between, so that a colour means the same in each layer.
void share_ends(point_coloring& color, const std::vector<tool_input>& all) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto take = [&](double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  };
  const auto set_ends = [&](auto& by, auto&& values_of) {
    for (const auto& one : all) std::visit([&](const auto& cloud) { values_of(cloud); }, one.cloud);
    if (!(low <= high)) return;
    by.low = low;
    by.high = high;
  };
  if (auto* by = std::get_if<by_coordinate>(&color))
    set_ends(*by, [&](const auto& cloud) {
      const Eigen::VectorXd origin = origin_in(cloud);
      for (const auto x : cloud.points.row(by->axis))
        take(double(x) + (origin.size() > by->axis ? origin[by->axis] : 0));
    });
  if (auto* by = std::get_if<by_attribute>(&color))
    set_ends(*by, [&](const auto& cloud) {
      for (const auto& one : cloud.attributes)
        if (one.name == by->name)
          std::visit(
              [&](const auto& values) {
                for (const auto x : values) take(double(x));
              },
              one.values);
    });
}

/// A layer for each file, by its name without the folder, unless two have the same.
export scene scene_of(const drawing_settings& settings) {
  cloud_look look{.color = coloring_of(settings.color)};
  if (settings.point_size > 0) look.size = splat_pixels{settings.point_size};
  std::vector<tool_input> all;
  for (const auto& input : settings.inputs)
    all.push_back(read_input(input, settings.depth, settings.quiet));
  if (all.size() > 1) share_ends(look.color, all);
  scene drawn;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto& input = settings.inputs[i];
    const auto short_name = [](const std::string& path) {
      return std::filesystem::path{path}.filename().string();
    };
    const bool is_only = std::ranges::count(settings.inputs, short_name(input), short_name) == 1;
    std::visit(
        [&](const auto& cloud) { drawn.set(is_only ? short_name(input) : input, cloud, look); },
        all[i].cloud);
  }
  return drawn;
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

/// Throws if there can be no window.
void expect_screen();

/// How the result of a command is shown beside what it writes.
export struct result_drawings {
  std::string picture, html;  ///< Files; none if empty.
  bool show = false;          ///< In a window, when the files are complete.

  [[nodiscard]] bool any() const { return !picture.empty() || !html.empty() || show; }
};
/// Before the work: what is named must end as it should, and there must be a place for it.
export void check(const result_drawings& as) {
  const auto expect = [](const std::string& path, const std::string& ending) {
    const std::filesystem::path file{path};
    if (path.empty()) return;
    if (ending_of(file) != ending)
      throw std::runtime_error{path + ": the name must end in " + ending};
    if (file.has_parent_path() && !std::filesystem::is_directory(file.parent_path()))
      throw std::runtime_error{path + ": there is no such folder"};
  };
  expect(as.picture, ".png");
  expect(as.html, ".html");
  if (as.show) expect_screen();
}
export void draw_result(const scene& all, const view& from, const result_drawings& as) {
  if (!as.picture.empty()) write_picture(all, from, as.picture, picture_look);
  if (!as.html.empty()) write_html(all, from, as.html, {.title = as.html});
  if (as.show) show_on_screen(all, from, {});
}
