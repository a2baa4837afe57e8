// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
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

struct model_settings {
  std::vector<std::string> scans;
  std::string output;
  std::vector<double> viewpoint;
  result_drawings drawings;
  double voxel = 0, cell = 0, min_overlap = align_many_options{}.min_overlap;
  int threads = 0;
  bool as_json = false, quiet = false;
  depth_settings depth;
};

json describe(const model_settings& settings, const align_many_result<3>& found) {
  json description{{"status", to_string(found.status)},
                   {"components", found.components},
                   {"scans", json::array()},
                   {"edges", json::array()},
                   {"pairs", found.pairs.size()}};
  for (std::size_t i = 0; i < found.poses.size(); ++i) {
    json one{{"file", settings.scans[i]},
             {"component", found.component_of[index_t(i)]},
             {"pose", json::array()}};
    for (const auto& row : found.poses[i].matrix().rowwise())
      one["pose"].push_back({row[0], row[1], row[2], row[3]});
    description["scans"].push_back(std::move(one));
  }
  for (const auto& edge : found.edges)
    description["edges"].push_back({{"source", edge.source},
                                    {"target", edge.target},
                                    {"chi_square", edge.chi_square},
                                    {"verdict", to_string(edge.verdict)}});
  return description;
}

void print(const json& description) {
  for (const auto& scan : description["scans"]) {
    const auto& pose = scan["pose"];
    std::printf("%s: component %d at %.6f %.6f %.6f\n", scan["file"].get<std::string>().c_str(),
                scan["component"].get<int>(), pose[0][3].get<double>(), pose[1][3].get<double>(),
                pose[2][3].get<double>());
  }
  for (const auto& edge : description["edges"])
    if (edge["verdict"] == "rejected")
      std::cout << "rejected: " << edge["source"] << " onto " << edge["target"] << '\n';
  std::cout << "status: " << description["status"] << "\ncomponents: " << description["components"]
            << "\nedges: " << description["edges"].size() << " of " << description["pairs"]
            << " pairs\n";
}

/// Drops what not all of the scans have.
template <class S>
void keep_common(std::vector<point_cloud<S, 3>>& scans) {
  const auto all_have = [&](auto has) { return std::ranges::all_of(scans, has); };
  if (!all_have([](const auto& scan) { return scan.has_normals(); }))
    for (auto& scan : scans) scan.normals.resize(3, 0);
  if (!all_have([](const auto& scan) { return scan.has_colors(); }))
    for (auto& scan : scans) scan.colors.resize(3, 0);
  std::vector<std::string> common;
  for (const auto& one : scans.front().attributes)
    if (all_have([&](const auto& scan) { return scan.find_attribute(one.name) != nullptr; }))
      common.push_back(one.name);
  for (auto& scan : scans)
    std::erase_if(scan.attributes, [&](const auto& one) {
      return std::ranges::find(common, one.name) == common.end();
    });
}

/// All scans of the first component, each where it lies.
template <class S>
point_cloud<S, 3> merged(std::vector<point_cloud<S, 3>> scans, const align_many_result<3>& found,
                         double cell) {
  keep_common(scans);
  point_cloud<S, 3> all;
  for (std::size_t i = 0; i < scans.size(); ++i)
    if (found.component_of[index_t(i)] == 0)
      all = append(std::move(all), transform(scans[i], found.poses[i]));
  return cell > 0 ? voxel_downsample(all, cell) : all;
}

template <class S>
void run(const model_settings& settings, const point_cloud<S, 3>& first) {
  std::vector<point_cloud<S, 3>> scans{first};
  for (std::size_t i = 1; i < settings.scans.size(); ++i)
    std::visit([&](const auto& cloud) { scans.push_back(cast<S>(cloud)); },
               read_input(settings.scans[i], settings.depth, true).cloud);
  for (std::size_t i = 0; i < scans.size(); ++i)
    if (scans[i].has_origin())
      throw std::runtime_error{settings.scans[i] +
                               ": it has an origin; scans must be in their own coordinates"};
  align_many_options options{
      .voxel = settings.voxel, .min_overlap = settings.min_overlap, .threads = settings.threads};
  if (!settings.viewpoint.empty())
    options.viewpoint = Eigen::Map<const Eigen::VectorXd>{settings.viewpoint.data(), 3};
  const auto found = [&] {
    progress_line line{"aligning", settings.quiet};
    options.monitor = line.monitor();
    return align_many(scans, options);
  }();
  const json description = describe(settings, found);
  if (settings.as_json)
    std::cout << description.dump(2) << '\n';
  else
    print(description);
  if (scans.size() > 1 && found.components == index_t(scans.size()))
    throw std::runtime_error{"no two scans fit uniquely; try another --voxel or a --viewpoint"};
  const auto all = merged(scans, found, settings.cell);
  if (!settings.output.empty()) write_cloud(all, settings.output);
  if (settings.drawings.any()) {
    const scene drawn = scene{}.set("model", all);
    draw_result(drawn, fit(drawn), settings.drawings);
  }
}

}  // namespace

void add_model(CLI::App& app) {
  const auto settings = std::make_shared<model_settings>();
  auto* command = app.add_subcommand("model", "Makes one cloud of many scans that overlap");
  command->add_option("SCANS", settings->scans, "Depth images or clouds, in any order")->required();
  command
      ->add_option("--voxel", settings->voxel,
                   "The edge of the cells by whose features scans are found, such as 0.05 m in a "
                   "room")
      ->required()
      ->check(CLI::PositiveNumber);
  command
      ->add_option(
          "--viewpoint", settings->viewpoint,
          "x y z from where each scan was seen, in its own coordinates: 0 0 0 for a sensor")
      ->expected(3);
  command
      ->add_option("--min-overlap", settings->min_overlap,
                   "Pairs that overlap so much are aligned once poses are known")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--cell", settings->cell, "Reduce the model to one point a cell of this edge")
      ->check(CLI::PositiveNumber);
  command->add_option("-o,--output", settings->output, "The model; its ending says the format");
  add_result_options(*command, settings->drawings);
  add_common_options(*command, *settings);
  command->callback([settings] {
    check(settings->drawings);
    const auto first = read_input(settings->scans.front(), settings->depth, settings->quiet);
    std::visit([&](const auto& cloud) { run(*settings, cloud); }, first.cloud);
  });
}
