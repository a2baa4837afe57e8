// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import cilantro.visualization;
import drawing;
import scan_io;
import tool;
using namespace cilantro;

namespace {

using json = nlohmann::ordered_json;

const std::map<std::string, metric_choice> metrics{{"point-to-plane", point_to_plane{}},
                                                   {"point-to-point", point_to_point{}},
                                                   {"symmetric", symmetric{}},
                                                   {"generalized-icp", generalized_icp{}},
                                                   {"colored", colored{}}};

struct align_settings {
  std::string source, target, output, metric = "point-to-plane";
  result_drawings drawings;
  double voxel = 0, max_distance = std::numeric_limits<double>::infinity(), robust = 0;
  double global = 0;
  std::vector<double> viewpoint;
  int iterations = 50, threads = 0;
  index_t normals = 10;
  bool reciprocal = false, as_json = false, quiet = false;
  depth_settings depth;
};

template <class S>
using isometry = Eigen::Transform<S, 3, Eigen::Isometry>;

align_options options_of(const align_settings& settings) {
  align_options options{.metric = metrics.at(settings.metric),
                        .max_iterations = settings.iterations,
                        .scales = {{settings.voxel, settings.max_distance}},
                        .normals = knn{settings.normals},
                        .reciprocal = settings.reciprocal,
                        .threads = settings.threads};
  if (settings.robust > 0) options.robust = huber{settings.robust};
  return options;
}

/// Where to start: from anywhere, if that is asked for. Adds what was found to `description`.
template <class S>
void start_globally(const align_settings& settings, const point_cloud<S, 3>& source,
                    const point_cloud<S, 3>& target, align_options& options, json& description) {
  global_options global{.voxel = settings.global, .threads = settings.threads};
  if (!settings.viewpoint.empty())
    global.source_viewpoint = global.target_viewpoint =
        Eigen::Map<const Eigen::VectorXd>{settings.viewpoint.data(), 3};
  const auto rough = align_globally(source, target, global);
  description["global"] = {
      {"status", to_string(rough.status)},  {"inliers", rough.inliers.size()},
      {"matches", rough.matches},           {"overlap", rough.overlap},
      {"contradicted", rough.contradicted}, {"alternatives", rough.alternatives.size()}};
  if (rough.status == global_status::too_few)
    throw std::runtime_error{
        "no transform was found: nothing that both show is supported by more than chance; try "
        "another --global"};
  options.initial = rough.transform;
}

template <class S>
json describe(const icp_result<isometry<S>>& found, const point_cloud<S, 3>& target) {
  json description{{"transform", json::array()},
                   {"status", to_string(found.status)},
                   {"converged", found.converged()},
                   {"iterations", found.iterations},
                   {"pairs", found.pairs},
                   {"overlap", found.overlap},
                   {"rmse", found.rmse},
                   {"unobservable", json::array()}};
  const Eigen::Matrix4d matrix = in_the_world(found, target).matrix();
  for (const auto& row : matrix.rowwise())
    description["transform"].push_back({row[0], row[1], row[2], row[3]});
  const Eigen::MatrixXd twists = found.unobservable_directions();
  for (const auto& twist : twists.colwise())
    description["unobservable"].push_back(std::vector<double>(twist.begin(), twist.end()));
  return description;
}

void print(const json& description) {
  // Ten decimals of a rotation are half a millimetre on the coordinates of a map.
  for (const std::vector<double> row : description["transform"])
    std::printf(" %13.10f %13.10f %13.10f %15.6f\n", row[0], row[1], row[2], row[3]);
  for (const auto& [key, value] : description.items())
    if (key != "transform") std::cout << key << ": " << value.dump() << '\n';
}

template <class S>
void run(const align_settings& settings, const point_cloud<S, 3>& source,
         const point_cloud<S, 3>& target) {
  icp_result<isometry<S>> found;
  json global = json::object();
  const auto aligned = [&] {
    progress_line line{"aligning", settings.quiet};
    auto options = options_of(settings);
    if (settings.global > 0) start_globally(settings, source, target, options, global);
    options.monitor = line.monitor();
    return align_to(source, target, options, &found);
  }();
  auto description = describe(found, target);
  description.update(global);
  if (settings.as_json)
    std::cout << description.dump(2) << '\n';
  else
    print(description);
  if (found.status == icp_status::too_few_pairs)
    throw std::runtime_error{
        "no transform was found: there are too few pairs; try another --max-distance"};
  if (!settings.output.empty()) write_cloud(aligned, settings.output);
  if (settings.drawings.any()) {
    const scene all = in_two_colors(target, aligned);
    draw_result(all, fit(all), settings.drawings);
  }
}

}  // namespace

void add_align(CLI::App& app) {
  const auto settings = std::make_shared<align_settings>();
  auto* command = app.add_subcommand("align", "Moves one cloud onto another");
  command->add_option("SOURCE", settings->source, "What is moved")->required();
  command->add_option("TARGET", settings->target, "What it is moved onto")->required();
  std::vector<std::string> names;
  for (const auto& [name, metric] : metrics) names.push_back(name);
  command->add_option("--metric", settings->metric, "What is made small")
      ->check(CLI::IsMember(names))
      ->capture_default_str();
  auto* global = command->add_option(
      "--global", settings->global,
      "Begin from anywhere, by features of voxels with this edge, such as 0.05 m in a room");
  global->check(CLI::PositiveNumber);
  command
      ->add_option("--viewpoint", settings->viewpoint,
                   "With --global: x y z from where both were seen, each in its own coordinates")
      ->expected(3)
      ->needs(global);
  command->add_option("--voxel", settings->voxel, "Reduce both to one point a cell of this edge")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--max-distance", settings->max_distance,
                   "Points farther apart are no pair; no limit if it is left out")
      ->check(CLI::PositiveNumber);
  command->add_option("--iterations", settings->iterations, "At most")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--normals", settings->normals, "Neighbours for normals that are missing")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--robust", settings->robust, "Scale of a Huber kernel of the residuals")
      ->check(CLI::PositiveNumber);
  command->add_flag("--reciprocal", settings->reciprocal,
                    "Only pairs of mutual nearest neighbours");
  command->add_option("-o,--output", settings->output,
                      "The moved source; its ending says the format");
  add_result_options(*command, settings->drawings);
  add_common_options(*command, *settings);
  command->callback([settings] {
    check(settings->drawings);
    const auto source = read_input(settings->source, settings->depth, settings->quiet).cloud;
    const auto target = read_input(settings->target, settings->depth, settings->quiet).cloud;
    std::visit(
        [&]<class A, class B>(const A& a, const B& b) {
          if constexpr (std::is_same_v<A, B>)
            run(*settings, a, b);
          else
            run(*settings, cast<double>(a), cast<double>(b));
        },
        source, target);
  });
}
