// SPDX-License-Identifier: MIT
//
// Scans from a walk around a table: an odometry, and a pose graph of edges of the odometry, edges
// across, and one that is wrong.
#include <algorithm>
#include <iostream>
#include <ranges>
#include <vector>

import cilantro;
import simulated_room;
using namespace cilantro;

int main() {
  const simulation_options seen{.width = 160, .height = 120, .noise = 0.002};
  std::vector<point_cloud<double, 3>> scans;
  for (int i = 0; i < 12; ++i) {
    auto frame = simulate(2 * i, seen);
    frame.camera.to_world.setIdentity();
    scans.push_back(cloud_from_depth(frame.depth, frame.camera) | remove_invalid() |
                    voxel_downsample(0.02) | estimate_normals(knn{10}));
  }
  const auto path = scans | odometry({.voxel = 0.03});

  std::vector<pose_edge<3>> edges;
  const auto add = [&](index_t source, index_t target) {
    const Eigen::Isometry3d start = path.frames[target].pose.inverse() * path.frames[source].pose;
    const auto found = align(scans[source], scans[target], {.initial = start, .max_distance = 0.1});
    edges.push_back(
        pose_edge_of(found, {.source = source, .target = target, .trusted = source == target + 1}));
  };
  for (index_t i = 0; i + 1 < 12; ++i) add(i + 1, i);
  for (index_t i = 0; i + 4 < 12; i += 2) add(i + 4, i);
  edges.push_back(edges.back());  // As if a place had been taken for another.
  edges.back().source = 11;
  edges.back().target = 1;

  const auto graph = optimize_poses(path.poses(), edges, {.robust = geman_mcclure{5}});
  std::cout << graph << '\n';
  double worst = 0;
  for (int i = 0; i < 12; ++i) {
    const Eigen::Isometry3d truth =
        simulated_camera(0, seen).to_world.inverse() * simulated_camera(2 * i, seen).to_world;
    worst = std::max(worst, (graph.poses[i].translation() - truth.translation()).norm());
  }
  std::cout << "poses are at most " << 1000 * worst << " mm off\n";
  return graph.converged() && worst < 0.02 && graph.rejected() == std::vector{std::ssize(edges) - 1}
             ? 0
             : 1;
}
