// SPDX-License-Identifier: MIT
#include <vector>

#include "common.hpp"
#include "pose_graph.hpp"

import cilantro;
using namespace cilantro;

namespace {

Eigen::Isometry3d pose_of(const graph_pose& p) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Map<const Eigen::Matrix3d>{p.rotation.data()}.transpose();
  pose.translation() = Eigen::Map<const Eigen::Vector3d>{p.translation.data()};
  return pose;
}

/// `check` looks at what was found.
template <class Check>
void pose_graph(benchmark::State& state, const std::vector<pose_edge<3>>& edges,
                const pose_graph_options& options, Check check) {
  std::vector<Eigen::Isometry3d> start;
  for (const auto& p : graph_of_sphere().start) start.push_back(pose_of(p));
  pose_graph_result<Eigen::Isometry3d> found;
  for (auto _ : state) found = optimize_poses(start, edges, options);
  if (!found.converged() || !check(found)) state.SkipWithError("these are not the poses");
  state.counters["iterations"] = found.iterations;
  graph_of_sphere().report(state, [&](std::size_t i, std::size_t axis) {
    return found.poses[i].translation()[index_t(axis)];
  });
}

std::vector<pose_edge<3>> edges_of_sphere() {
  std::vector<pose_edge<3>> edges;
  for (const auto& e : graph_of_sphere().edges) {
    edges.push_back({.source = e.source,
                     .target = e.target,
                     .transform = pose_of(e.transform),
                     .trusted = e.source == e.target + 1});
    edges.back().information /= sphere_graph::noise * sphere_graph::noise;
  }
  return edges;
}

void pose_graph_of_2000_nodes(benchmark::State& state) {
  pose_graph(state, edges_of_sphere(), {}, [](const auto&) { return true; });
}
CILANTRO_BENCHMARK(pose_graph_of_2000_nodes);

/// A hundred edges more, all false, which a robust kernel has to find.
void pose_graph_with_false_edges(benchmark::State& state) {
  auto edges = edges_of_sphere();
  plain_random random;
  for (int i = 0; i < 100; ++i) {
    pose_edge<3> wrong = edges[index_t(random() * double(edges.size()))];
    wrong.source = index_t(random() * 1000);
    wrong.target = 1000 + index_t(random() * 1000);
    wrong.trusted = false;
    edges.push_back(wrong);
  }
  pose_graph(state, edges, {.robust = geman_mcclure{5}},
             [](const auto& found) { return found.rejected().size() == 100; });
}
CILANTRO_BENCHMARK(pose_graph_with_false_edges);

}  // namespace
