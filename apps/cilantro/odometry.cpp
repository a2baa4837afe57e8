// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
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

struct odometry_settings {
  std::vector<std::string> frames;
  std::string map, poses;
  result_drawings drawings;
  double voxel = 0, max_distance = 0, map_radius = 0;
  double min_overlap = odometry_options{}.min_overlap;
  index_t normals = 10;
  int threads = 0;
  bool as_json = false, quiet = false;
  depth_settings depth;
};

odometry_options options_of(const odometry_settings& settings) {
  return {.voxel = settings.voxel,
          .max_distance = settings.max_distance,
          .map_radius = settings.map_radius,
          .min_overlap = settings.min_overlap,
          .normals = knn{settings.normals},
          .threads = settings.threads};
}

/// Follows all frames, in the scalar of the first.
template <class S>
odometry_result<S, 3> follow(const odometry_settings& settings, const point_cloud<S, 3>& first) {
  progress_line line{"following", settings.quiet};
  const auto monitor = line.monitor();
  odometry_tracker<S, 3> tracker{options_of(settings)};
  odometry_result<S, 3> path;
  for (const auto& file : settings.frames) {
    path.frames.push_back(
        path.frames.empty()
            ? tracker.add(first)
            : std::visit([&](const auto& cloud) { return tracker.add(cast<S>(cloud)); },
                         read_input(file, settings.depth, true).cloud));
    if (monitor.progress)
      monitor.progress(double(path.frames.size()) / double(settings.frames.size()));
  }
  path.map = tracker.map();
  return path;
}

/// Three rows of a matrix on each line, as the poses of KITTI are written.
void write_poses(const std::vector<Eigen::Isometry3d>& poses, const std::string& path) {
  std::ofstream out{path};
  out.precision(12);
  for (const auto& pose : poses)
    for (int i = 0; i < 12; ++i) out << pose(i / 4, i % 4) << (i < 11 ? ' ' : '\n');
  if (!out.flush()) throw std::runtime_error{path + ": cannot be written"};
}

template <class S>
json describe(const odometry_settings& settings, const odometry_result<S, 3>& path) {
  json description{
      {"frames", json::array()}, {"lost", path.lost().size()}, {"map_points", path.map.size()}};
  for (std::size_t i = 0; i < path.frames.size(); ++i) {
    const auto& frame = path.frames[i];
    json one{{"file", settings.frames[i]}, {"status", to_string(frame.status)},
             {"in_map", frame.is_in_map},  {"overlap", frame.fit.overlap},
             {"rmse", frame.fit.rmse},     {"pose", json::array()}};
    for (const auto& row : frame.pose.matrix().rowwise())
      one["pose"].push_back({row[0], row[1], row[2], row[3]});
    description["frames"].push_back(std::move(one));
  }
  return description;
}

void print(const json& description) {
  for (const auto& frame : description["frames"]) {
    const auto& pose = frame["pose"];
    std::printf("%s: %s at %.6f %.6f %.6f\n", frame["file"].get<std::string>().c_str(),
                frame["status"].get<std::string>().c_str(), pose[0][3].get<double>(),
                pose[1][3].get<double>(), pose[2][3].get<double>());
  }
  std::cout << "lost: " << description["lost"] << "\nmap_points: " << description["map_points"]
            << '\n';
}

template <class S>
void run(const odometry_settings& settings, const point_cloud<S, 3>& first) {
  const auto path = follow(settings, first);
  const json description = describe(settings, path);
  if (settings.as_json)
    std::cout << description.dump(2) << '\n';
  else
    print(description);
  if (path.frames.size() > 1 && path.lost().size() + 1 >= path.frames.size())
    throw std::runtime_error{
        "no frame lies on the map of those before it; try another --voxel or --max-distance"};
  if (!settings.poses.empty()) write_poses(path.poses(), settings.poses);
  if (!settings.map.empty()) write_cloud(path.map, settings.map);
  if (settings.drawings.any()) {
    line_batch way{.colors = one_color({255, 153, 51}), .width = 3};
    const auto poses = path.poses();
    way.points.resize(3, std::ssize(poses));
    way.segments.resize(2, std::ssize(poses) - 1);
    for (int i = 0; i < way.points.cols(); ++i)
      way.points.col(i) = poses[std::size_t(i)].translation().template cast<float>();
    for (int i = 0; i < way.segments.cols(); ++i) way.segments.col(i) << i, i + 1;
    const scene all = scene{}.set("map", path.map).set("path", way);
    draw_result(all, fit(all), settings.drawings);
  }
}

}  // namespace

void add_odometry(CLI::App& app) {
  const auto settings = std::make_shared<odometry_settings>();
  auto* command = app.add_subcommand("odometry", "Follows a sensor from scan to scan");
  command->add_option("FRAMES", settings->frames, "Depth images or clouds, in their order")
      ->required();
  command->add_option("--voxel", settings->voxel, "The map keeps one point a cell of this edge")
      ->required()
      ->check(CLI::PositiveNumber);
  command
      ->add_option(
          "--max-distance", settings->max_distance,
          "How far a frame may be from where it is predicted; ten voxels if it is left out")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--map-radius", settings->map_radius,
                   "What is farther from the sensor is forgotten; if it is left out, as far as the "
                   "sensor sees, and half of that again")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--min-overlap", settings->min_overlap,
                   "A frame is lost if a smaller share of it lies on the map")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--normals", settings->normals, "Neighbours for normals that are missing")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--map", settings->map, "The map at the end; its ending says the format");
  command->add_option("--poses", settings->poses,
                      "A text file: for each frame the first three rows of its pose, on a line");
  add_result_options(*command, settings->drawings);
  add_common_options(*command, *settings);
  command->callback([settings] {
    check(settings->drawings);
    const auto first = read_input(settings->frames.front(), settings->depth, settings->quiet);
    std::visit([&](const auto& cloud) { run(*settings, cloud); }, first.cloud);
  });
}
