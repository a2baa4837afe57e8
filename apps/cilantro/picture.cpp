// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro.visualization;
import drawing;
import tool;
using namespace cilantro;

namespace {

struct picture_settings : drawing_settings {
  std::string output;
  int turntable = 0;  ///< The number of frames of a film; 0 for a picture.
  video_options film;
};

/// Before anything is read and drawn.
void expect_fitting_name(const picture_settings& settings) {
  const std::string ending = ending_of(settings.output);
  if (settings.turntable == 0 && settings.output.find('%') != std::string::npos)
    throw std::runtime_error{settings.output +
                             " would be pictures of a film, which needs --turntable and its number "
                             "of frames"};
  if (settings.turntable == 0 && (ending == ".mp4" || ending == ".y4m"))
    throw std::runtime_error{settings.output +
                             " would be a film, which needs --turntable and its number of frames"};
}

void run(const picture_settings& settings) {
  expect_fitting_name(settings);
  const scene all = scene_of(settings);
  auto options = options_of(picture_look, settings);
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
  add_drawing_options(*command, *settings);
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
  command->callback([settings] { run(*settings); });
}
