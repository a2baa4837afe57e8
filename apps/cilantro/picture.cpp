// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
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
};

void run(const picture_settings& settings) {
  const scene all = scene_of(settings);
  write_picture(all, view_of(all, settings), settings.output, options_of(picture_look, settings));
  if (!settings.quiet) std::cerr << "a picture is in " << settings.output << '\n';
}

}  // namespace

void add_picture(CLI::App& app) {
  const auto settings = std::make_shared<picture_settings>();
  auto* command = app.add_subcommand("picture", "Draws clouds, without a display");
  add_drawing_options(*command, *settings);
  command->add_option("-o,--output", settings->output, "The PNG file to write")->required();
  command->callback([settings] { run(*settings); });
}
