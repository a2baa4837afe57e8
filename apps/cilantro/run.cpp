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
  std::vector<std::string> steps;
  depth_settings depth;
  int threads = 0;
  bool quiet = false;
};

void run(const run_settings& settings, const std::vector<tool_step>& steps) {
  pipeline_report report;
  auto [cloud, camera] = read_input(settings.input, settings.depth, settings.quiet);
  const auto note = [&](const std::string& step) {
    std::visit([&](auto& c) { c = std::move(c) | report_to(report, step); }, cloud);
  };
  note("read");
  for (std::size_t i = 0; i < steps.size(); ++i) {
    progress_line line{settings.steps[i], settings.quiet};
    cloud = steps[i](std::move(cloud), {settings.threads, line.monitor()});
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

void add_run(CLI::App& app) {
  const auto settings = std::make_shared<run_settings>();
  const auto steps = std::make_shared<std::vector<tool_step>>();
  auto* command = app.add_subcommand("run", "Processes a cloud, step by step");
  command->add_option("INPUT", settings->input, "A cloud or a depth image")->required();
  command->add_option("STEPS", settings->steps, "What to do, such as voxel=0.005 normals=knn:10");
  command->add_option("-o,--output", settings->output, "A cloud; its ending says the format");
  add_result_options(*command, settings->drawings);
  add_depth_options(*command, settings->depth);
  command->add_option("--threads", settings->threads, "0 leaves the choice to OpenMP")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--quiet", settings->quiet, "No progress and no report");
  command->footer(known_steps());
  command->callback([settings, steps] {
    check(settings->drawings);
    // Before anything is read: a wrong word must not cost a minute.
    try {
      for (const auto& text : settings->steps) steps->push_back(parse_step(text));
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError{error.what()};
    }
    run(*settings, *steps);
  });
}
