// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

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

/// Whether float holds every number to the bit.
bool are_floats(const Eigen::Matrix3Xd& m) {
  return m.unaryExpr([](double x) {
            return double(!(double(float(x)) != x) || std::isnan(x));
          }).sum() == double(m.size());
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
    index_t count = 0;
    if (is_depth_image(settings->from)) {
      const auto cloud = read_input(settings->from, settings->depth, settings->quiet).cloud;
      write(*settings, cloud);
      count = cloud.size();
    } else {
      // In the precision that the file has.
      progress_line line{"reading", settings->quiet};
      const auto cloud = read_cloud<double>(settings->from, {.monitor = line.monitor()});
      if (are_floats(cloud.points) && are_floats(cloud.normals))
        write(*settings, cast<float>(cloud));
      else
        write(*settings, cloud);
      count = cloud.size();
    }
    if (!settings->quiet) std::cerr << count << " points in " << settings->to << '\n';
  });
}
