// SPDX-License-Identifier: MIT
//
// `cilantro view` where the library was built without windows.
#include <CLI/CLI.hpp>
#include <stdexcept>

#include "commands.hpp"

void add_view(CLI::App& app) {
  auto* command = app.add_subcommand("view", "Shows clouds in a window, which this build cannot");
  command->allow_extras();
  command->callback([] {
    throw std::runtime_error{
        "this program was built without windows, which need GLFW (libglfw3-dev): cilantro picture "
        "draws clouds into a file"};
  });
}
