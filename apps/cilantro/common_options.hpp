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

/// What commands have in common that read a file and report in words or JSON.
template <class Settings>
void add_common_options(CLI::App& command, Settings& settings) {
  add_depth_options(command, settings.depth);
  command.add_option("--threads", settings.threads, "0 leaves the choice to OpenMP")
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--json", settings.as_json, "The result as one JSON object");
  command.add_flag("--quiet", settings.quiet, "No progress");
}
