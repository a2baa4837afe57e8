// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <memory>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro.visualization;
import drawing;

namespace {

void run(const drawing_settings& settings) {
  const auto all = scene_of(settings);
  show_on_screen(all, view_of(all, settings), options_of({}, settings));
}

}  // namespace

void add_view(CLI::App& app) {
  const auto settings = std::make_shared<drawing_settings>();
  auto* command = app.add_subcommand(
      "view", "Shows clouds in a window; a click says which point is there, q closes it");
  add_drawing_options(*command, *settings);
  command->callback([settings] { run(*settings); });
}
