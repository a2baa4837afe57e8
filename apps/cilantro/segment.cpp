// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <cstdint>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import cilantro.visualization;
import drawing;
import tool;
using namespace cilantro;

namespace {

using json = nlohmann::ordered_json;

struct segment_settings {
  std::string input, output;
  result_drawings drawings;
  index_t neighbors = 30, min_size = 50;
  double angle = 3;
  int threads = 0;
  bool as_json = false, quiet = false;
  depth_settings depth;
};

template <class S>
void run(const segment_settings& settings, point_cloud<S, 3>& cloud,
         const std::optional<pinhole_camera<float>>& camera) {
  const knn spec{settings.neighbors};
  if (!cloud.has_normals()) {
    progress_line line{"normals", settings.quiet};
    cloud = estimate_normals(std::move(cloud), spec,
                             {.threads = settings.threads, .monitor = line.monitor()});
  }
  const auto parts = [&] {
    progress_line line{"segmenting", settings.quiet};
    // Nobody knows whether the normals of a file have been turned to one side.
    const similar_normals smooth{
        cloud.normals, settings.angle * std::numbers::pi / 180, {.ignore_sign = true}};
    return connected_components(cloud, spec, smooth,
                                {.min_cluster_size = settings.min_size,
                                 .threads = settings.threads,
                                 .monitor = line.monitor()});
  }();
  cloud.colors = label_colors(parts.labels());
  cloud.set_attribute("cluster",
                      std::vector<std::int32_t>(parts.labels().begin(), parts.labels().end()));
  if (settings.as_json) {
    std::cout << json{{"clusters", parts.size()}, {"sizes", parts.sizes()}}.dump(2) << '\n';
  } else {
    std::cout << "clusters: " << parts.size() << "\nsizes:";
    for (const index_t size : parts.sizes()) std::cout << ' ' << size;
    std::cout << "\npoints in none: " << parts.unlabeled() << '\n';
  }
  if (!settings.output.empty()) write_cloud(cloud, settings.output);
  if (settings.drawings.any()) {
    const auto all = scene{}.set("parts", cloud, cloud_look{.color = by_label{"cluster"}});
    draw_result(all, camera ? view{*camera} : fit(all), settings.drawings);
  }
}

}  // namespace

void add_segment(CLI::App& app) {
  const auto settings = std::make_shared<segment_settings>();
  auto* command = app.add_subcommand("segment", "Finds the smooth parts of a cloud");
  command->add_option("FILE", settings->input, "A cloud or a depth image")->required();
  command->add_option("OUT", settings->output,
                      "The cloud with a colour and an attribute \"cluster\" (-1: none)");
  command->add_option("--knn", settings->neighbors, "Neighbours that are compared")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--angle", settings->angle, "Between normals of a part, in degrees")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--min-size", settings->min_size, "Smaller parts are none")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_result_options(*command, settings->drawings);
  add_common_options(*command, *settings);
  command->callback([settings] {
    check(settings->drawings);
    auto [cloud, camera] = read_input(settings->input, settings->depth, settings->quiet);
    std::visit([&](auto& c) { run(*settings, c, camera); }, cloud);
  });
}
