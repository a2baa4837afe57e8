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

/// How clouds that are larger than memory are opened.
template <class Settings>
void add_tiling_options(CLI::App& command, Settings& tiling) {
  command
      .add_option("--edge", tiling.edge, "Of a tile, in the units of the points; else by memory")
      ->check(CLI::PositiveNumber);
  command
      .add_option("--memory", tiling.megabytes,
                  "In megabytes, of each process; else half of what the machine has")
      ->check(CLI::Range(1, 1'000'000'000));
  command.add_option("--threads", tiling.threads, "0 leaves the choice to OpenMP")
      ->check(CLI::NonNegativeNumber);
}

/// What commands have in common that draw clouds.
template <class Settings>
void add_drawing_options(CLI::App& command, Settings& settings) {
  command.add_option("FILES", settings.inputs, "Clouds or depth images")->required();
  command.add_option("--color", settings.color,
                     "own, normals, x, y, z, attribute:NAME or label:NAME (own)");
  command
      .add_option("--point-size", settings.point_size,
                  "In pixels; else as large as points are apart")
      ->check(CLI::PositiveNumber);
  auto* direction =
      command.add_option("--direction", settings.direction, "x,y,z: where it is looked to")
          ->delimiter(',')
          ->expected(3);
  command.add_option("--up", settings.up, "x,y,z: what is upwards in the picture (0,0,1)")
      ->delimiter(',')
      ->expected(3)
      ->needs(direction);
  command.add_flag("--orthographic", settings.orthographic, "Parallel rays");
  command.add_option("--size", settings.size, "width,height in pixels (1280,720)")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(1, 32768));
  command.add_option("--background", settings.background, "red,green,blue from 0 to 255")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0, 255));
  add_depth_options(command, settings.depth);
  command.add_flag("--quiet", settings.quiet, "No progress and no report");
}

/// How the result of a command is drawn.
template <class Drawings>
void add_result_options(CLI::App& command, Drawings& drawings) {
  command.add_option("--picture", drawings.picture, "A picture of the result, as PNG");
  command.add_option("--html", drawings.html,
                     "The result as a web page, to be turned in a browser");
  command.add_flag("--show", drawings.show, "The result in a window");
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
