// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/CLI.hpp>

/// What a depth image needs to become a cloud. A template, since the settings are a module's.
template <class Settings>
void add_depth_options(CLI::App& command, Settings& depth) {
  command.add_option("--camera", depth.camera, "Of a depth image: fx,fy,cx,cy in pixels")
      ->delimiter(',')
      ->expected(4);
  command
      .add_option("--depth-scale", depth.per_metre, "What a depth image stores for a metre (1000)")
      ->check(CLI::PositiveNumber);
}
