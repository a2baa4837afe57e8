// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import cilantro.visualization;
import tool;
using namespace cilantro;

namespace {

struct picture_settings {
  std::vector<std::string> inputs;
  std::string output, color = "own";
  std::vector<double> direction, up;
  std::vector<int> size{1280, 720}, background{24, 26, 32};
  double point_size = 0;
  int turntable = 0;  ///< The number of frames of a film; 0 for a picture.
  video_options film;
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

Eigen::Vector3d vector_of(const std::vector<double>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

view view_of(const scene& all, const picture_settings& settings) {
  const view_options options{
      .width = settings.size[0], .height = settings.size[1], .orthographic = settings.orthographic};
  if (settings.direction.empty()) return fit(all, options);
  return fit(all, vector_of(settings.direction),
             settings.up.empty() ? Eigen::Vector3d{0, 0, 1} : vector_of(settings.up), options);
}

/// Before anything is read and drawn.
void expect_fitting_name(const picture_settings& settings) {
  const std::string ending = std::filesystem::path{settings.output}.extension().string();
  if (settings.turntable == 0 && (ending == ".mp4" || ending == ".y4m"))
    throw std::runtime_error{settings.output +
                             " would be a film, which needs --turntable and its number of frames"};
}

void run(const picture_settings& settings) {
  expect_fitting_name(settings);
  cloud_look look{.color = coloring_of(settings.color)};
  if (settings.point_size > 0) look.size = splat_pixels{settings.point_size};
  scene all;
  for (const auto& input : settings.inputs) {
    const auto read = read_input(input, settings.depth, settings.quiet);
    std::visit([&](const auto& cloud) { all.set(input, cloud, look); }, read.cloud);
  }
  auto options = picture_look;
  options.background = {};
  for (std::size_t k = 0; k < 3; ++k)
    options.background[k] = static_cast<std::uint8_t>(settings.background[k]);
  const bool is_film = settings.turntable > 0;
  if (is_film) {
    progress_line line{"drawing", settings.quiet};
    options.monitor = line.monitor();
    write_video(all, turntable(view_of(all, settings), settings.turntable), settings.output,
                options, settings.film);
  } else {
    write_picture(all, view_of(all, settings), settings.output, options);
  }
  if (!settings.quiet)
    std::cerr << (is_film ? "a film is in " : "a picture is in ") << settings.output << '\n';
}

}  // namespace

void add_picture(CLI::App& app) {
  const auto settings = std::make_shared<picture_settings>();
  auto* command = app.add_subcommand("picture", "Draws clouds, without a display");
  command->add_option("FILES", settings->inputs, "Clouds or depth images")->required();
  command
      ->add_option("-o,--output", settings->output,
                   "The PNG file to write; with --turntable .mp4, .y4m, or .png with %04d")
      ->required();
  auto* turntable =
      command->add_option("--turntable", settings->turntable, "A film of so many frames all around")
          ->check(CLI::Range(1, 100'000));
  command->add_option("--frames-per-second", settings->film.frames_per_second, "Of the film (30)")
      ->check(CLI::Range(0.01, 1000.0))
      ->needs(turntable);
  command->add_option("--color", settings->color,
                      "own, normals, x, y, z, attribute:NAME or label:NAME (own)");
  command
      ->add_option("--point-size", settings->point_size,
                   "In pixels; else as large as points are apart")
      ->check(CLI::PositiveNumber);
  auto* direction =
      command->add_option("--direction", settings->direction, "x,y,z: where it is looked to")
          ->delimiter(',')
          ->expected(3);
  command->add_option("--up", settings->up, "x,y,z: what is upwards in the picture (0,0,1)")
      ->delimiter(',')
      ->expected(3)
      ->needs(direction);
  command->add_flag("--orthographic", settings->orthographic, "Parallel rays");
  command->add_option("--size", settings->size, "width,height in pixels (1280,720)")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(1, 32768));
  command->add_option("--background", settings->background, "red,green,blue from 0 to 255")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0, 255));
  add_depth_options(*command, settings->depth);
  command->add_flag("--quiet", settings->quiet, "No progress and no report");
  command->callback([settings] { run(*settings); });
}
