// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro.window;
import drawing;
using namespace cilantro;

namespace {

void run(const drawing_settings& settings) {
  const scene all = scene_of(settings);
  window w{
      all,
      {.width = settings.size[0], .height = settings.size[1], .drawing = options_of({}, settings)}};
  w.look(view_of(all, settings));
  w.on_pick([](const picked& found) {
    std::cout << found.layer << ": point " << found.index << " at " << found.place.transpose()
              << std::endl;
  });
  w.wait();
}

}  // namespace

void add_view(CLI::App& app) {
  const auto settings = std::make_shared<drawing_settings>();
  auto* command = app.add_subcommand(
      "view", "Shows clouds in a window; a click says which point is there, q closes it");
  add_drawing_options(*command, *settings);
  command->callback([settings] { run(*settings); });
}
