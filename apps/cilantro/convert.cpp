// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <variant>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import tool;
using namespace cilantro;

namespace {

struct convert_settings {
  std::string from, to;
  depth_settings depth;
  bool as_text = false, compressed = false, quiet = false;
};

template <class Cloud>
void write(const convert_settings& settings, const Cloud& cloud) {
  progress_line line{"writing", settings.quiet};
  const std::filesystem::path to = settings.to;
  if (settings.as_text && to.extension() == ".ply")
    return write_ply(cloud, to, {.format = ply_format::ascii, .monitor = line.monitor()});
  if (settings.as_text && to.extension() == ".pcd")
    return write_pcd(cloud, to, {.format = pcd_format::ascii, .monitor = line.monitor()});
  if (settings.compressed && to.extension() == ".pcd")
    return write_pcd(cloud, to,
                     {.format = pcd_format::binary_compressed, .monitor = line.monitor()});
  write_cloud(cloud, to, line.monitor());
}

}  // namespace

void add_convert(CLI::App& app) {
  const auto settings = std::make_shared<convert_settings>();
  auto* command = app.add_subcommand("convert", "Writes a file in another format");
  command->add_option("FROM", settings->from, "A cloud or a depth image")->required();
  command->add_option("TO", settings->to, "A cloud; its ending says the format")->required();
  auto* text = command->add_flag("--ascii", settings->as_text, "PLY and PCD as text");
  command->add_flag("--compressed", settings->compressed, "PCD as binary_compressed")
      ->excludes(text);
  add_depth_options(*command, settings->depth);
  command->add_flag("--quiet", settings->quiet, "No progress and no report");
  command->callback([settings] {
    const auto input = read_input(settings->from, settings->depth, settings->quiet);
    std::visit(
        [&](const auto& cloud) {
          write(*settings, cloud);
          if (!settings->quiet) std::cerr << cloud.size() << " points in " << settings->to << '\n';
        },
        input.cloud);
  });
}
