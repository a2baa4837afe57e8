// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"
#include "ranks.hpp"

import cilantro;
import tool;
using namespace cilantro;

namespace {

struct tile_settings {
  std::vector<std::filesystem::path> inputs;
  std::string output;
  tiling_settings tiling;
  bool resume = false, quiet = false;
};

void cut(const tile_settings& settings, job_of_ranks* ranks) {
  const bool quiet = settings.quiet || (ranks != nullptr && ranks->rank() > 0);
  const auto survey = open_for_tool(settings.inputs, settings.tiling, ranks, quiet);
  progress_line line{"cutting", quiet};
  const auto tiles =
      survey | write_tiles(settings.output, {.resume = settings.resume, .monitor = line.monitor()});
  if (!quiet)
    std::cerr << tiles.size() << " points in " << tiles.tiles().size() << " tiles of "
              << tiles.edge() << " in " << settings.output << '\n';
}

}  // namespace

void add_tile(CLI::App& app, job_of_ranks* ranks) {
  const auto settings = std::make_shared<tile_settings>();
  auto* command = app.add_subcommand("tile", "Cuts clouds of any size into a folder of tiles");
  command->add_option("INPUTS", settings->inputs, "Clouds, or folders with clouds")->required();
  command->add_option("-o,--output", settings->output, "A folder that is new or empty")->required();
  add_tiling_options(*command, settings->tiling);
  command->add_flag("--resume", settings->resume, "Goes on with what was interrupted");
  command->add_flag("--quiet", settings->quiet, "No progress and no report");
  command->callback([settings, ranks] { cut(*settings, ranks); });
}
