// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"
#include "ranks.hpp"

import cilantro;
import cilantro.visualization;
import drawing;
import steps;
import tool;
using namespace cilantro;

namespace {

struct run_settings {
  std::string input, output;
  result_drawings drawings;
  tiling_settings tiling;
  std::vector<std::string> steps;
  depth_settings depth;
  bool resume = false, quiet = false;
};

/// Tile by tile, from a folder or a pattern of files into a folder.
void run_on_tiles(const run_settings& settings, const std::vector<tool_step>& steps,
                  job_of_ranks* ranks) {
  const bool quiet = settings.quiet || (ranks != nullptr && ranks->rank() > 0);
  auto survey = open_for_tool({settings.input}, settings.tiling, ranks, quiet);
  // Tiles are what threads share; each step has those that are left.
  for (const auto& step : steps) survey = step.on_tiles(survey, {});
  progress_line line{"processing", quiet};
  const auto before = survey.size();
  const auto result =
      survey | write_tiles(settings.output, {.resume = settings.resume, .monitor = line.monitor()});
  if (!quiet)
    std::cerr << before << " points, then " << result.size() << " in " << result.tiles().size()
              << " tiles in " << settings.output << '\n';
}

void run(const run_settings& settings, const std::vector<tool_step>& steps) {
  pipeline_report report;
  auto [cloud, camera] = read_input(settings.input, settings.depth, settings.quiet);
  const auto note = [&](const std::string& step) {
    std::visit([&](auto& c) { c = std::move(c) | report_to(report, step); }, cloud);
  };
  note("read");
  for (std::size_t i = 0; i < steps.size(); ++i) {
    progress_line line{settings.steps[i], settings.quiet};
    cloud = steps[i].on_cloud(std::move(cloud), {settings.tiling.threads, line.monitor()});
    note(settings.steps[i]);
  }
  if (!settings.output.empty()) {
    progress_line line{"writing", settings.quiet};
    std::visit([&](const auto& c) { write_cloud(c, settings.output, line.monitor()); }, cloud);
  }
  if (settings.drawings.any()) {
    scene all;
    std::visit([&](const auto& c) { all.set("cloud", c); }, cloud);
    draw_result(all, camera ? view{*camera} : fit(all), settings.drawings);
  }
  if (!settings.quiet) std::cerr << report;
}

}  // namespace

void add_run(CLI::App& app, job_of_ranks* ranks) {
  const auto settings = std::make_shared<run_settings>();
  const auto steps = std::make_shared<std::vector<tool_step>>();
  auto* command = app.add_subcommand("run", "Processes a cloud, step by step");
  command
      ->add_option("INPUT", settings->input,
                   "A cloud or a depth image; or a folder of tiles or clouds, or a pattern such as "
                   "\"survey/*.las\", tile by tile")
      ->required();
  command->add_option("STEPS", settings->steps, "What to do, such as voxel=0.005 normals=knn:10");
  command->add_option("-o,--output", settings->output,
                      "A cloud, whose ending says the format; for tiles, a folder");
  add_result_options(*command, settings->drawings);
  add_depth_options(*command, settings->depth);
  add_tiling_options(*command, settings->tiling);
  command->add_flag("--resume", settings->resume, "Goes on with what was interrupted, for tiles");
  command->add_flag("--quiet", settings->quiet, "No progress and no report");
  command->footer(known_steps());
  command->callback([settings, steps, ranks] {
    check(settings->drawings);
    const bool on_tiles = means_tiles(settings->input);
    const auto& tiling = settings->tiling;
    if (!on_tiles && (settings->resume || tiling.edge != 0 || tiling.megabytes != 0))
      throw CLI::ValidationError{"--edge, --memory and --resume are for folders and patterns"};
    if (on_tiles && settings->output.empty())
      throw CLI::ValidationError{"what is done tile by tile needs a folder as --output"};
    if (on_tiles && !ending_of(settings->output).empty())
      throw CLI::ValidationError{"what is done tile by tile goes into a folder, and \"" +
                                 settings->output + "\" ends like a file"};
    if (on_tiles && settings->drawings.any())
      throw CLI::ValidationError{"what is done tile by tile is not drawn; draw the folder"};
    if (!on_tiles && ranks != nullptr && ranks->size() > 1)
      throw CLI::ValidationError{"several ranks process folders and patterns, and no single file"};
    // Before anything is read: a wrong word must not cost a minute.
    try {
      for (const auto& text : settings->steps) steps->push_back(parse_step(text));
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError{error.what()};
    }
    on_tiles ? run_on_tiles(*settings, *steps, ranks) : run(*settings, *steps);
  });
}
