// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <cstdint>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <variant>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import tool;
using namespace cilantro;

namespace {

using json = nlohmann::ordered_json;

struct plane_settings {
  std::string input, inliers, others;
  double distance = 0;
  index_t samples = 1000;
  std::uint64_t seed = 0;
  int threads = 0;
  bool as_json = false, quiet = false;
  depth_settings depth;
};

template <class S>
void run(const plane_settings& settings, const point_cloud<S, 3>& cloud) {
  const auto found = [&] {
    progress_line line{"sampling", settings.quiet};
    return ransac(hyperplane_family{cloud}, {.max_residual = settings.distance,
                                             .max_iterations = settings.samples,
                                             .seed = settings.seed,
                                             .threads = settings.threads,
                                             .monitor = line.monitor()});
  }();
  if (!found) throw std::runtime_error{"no plane was found: all samples are degenerate"};
  const auto& normal = found->model.normal;
  // In the coordinates of the file, where the cloud has an origin.
  const double offset = found->model.offset - normal.dot(cloud.full_origin());
  const json description{{"normal", {normal.x(), normal.y(), normal.z()}},
                         {"offset", offset},
                         {"inliers", found->inliers.size()}};
  if (settings.as_json)
    std::cout << description.dump(2) << '\n';
  else
    for (const auto& [key, value] : description.items())
      std::cout << key << ": " << value.dump() << '\n';
  if (!settings.inliers.empty()) write_cloud(select(cloud, found->inliers), settings.inliers);
  if (!settings.others.empty())
    write_cloud(select(cloud,
                       [&](index_t i) {
                         return is_finite(cloud.points.col(i)) &&
                                std::abs(found->model.signed_distance(cloud.points.col(i))) >
                                    settings.distance;
                       }),
                settings.others);
}

}  // namespace

void add_plane(CLI::App& app) {
  const auto settings = std::make_shared<plane_settings>();
  auto* command = app.add_subcommand("plane", "Finds the plane that most points lie on");
  command->add_option("FILE", settings->input, "A cloud or a depth image")->required();
  command->add_option("--distance", settings->distance, "Of a point that counts, at most")
      ->required()
      ->check(CLI::PositiveNumber);
  command->add_option("--samples", settings->samples, "At most")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--seed", settings->seed, "Of the random samples")->capture_default_str();
  command->add_option("--inliers", settings->inliers, "Where to write the points of the plane");
  command->add_option("--others", settings->others, "Where to write all other points");
  add_common_options(*command, *settings);
  command->callback([settings] {
    const auto input = read_input(settings->input, settings->depth, settings->quiet);
    std::visit([&](const auto& cloud) { run(*settings, cloud); }, input.cloud);
  });
}
