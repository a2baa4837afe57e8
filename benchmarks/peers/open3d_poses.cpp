// SPDX-License-Identifier: MIT
#include <Eigen/Geometry>

#include <open3d/pipelines/registration/GlobalOptimization.h>
#include <open3d/pipelines/registration/GlobalOptimizationConvergenceCriteria.h>
#include <open3d/pipelines/registration/GlobalOptimizationMethod.h>
#include <open3d/pipelines/registration/PoseGraph.h>

#include "common.hpp"
#include "pose_graph.hpp"

namespace {

namespace registration = open3d::pipelines::registration;
using matrix6 = Eigen::Matrix<double, 6, 6>;

Eigen::Matrix4d pose_of(const graph_pose& p) {
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  pose.topLeftCorner<3, 3>() = Eigen::Map<const Eigen::Matrix3d>{p.rotation.data()}.transpose();
  pose.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>{p.translation.data()};
  return pose;
}

/// Open3D measures an edge in the coordinates of its source: the information of its target, there.
matrix6 information_of(const graph_pose& p) {
  const Eigen::Matrix4d pose = pose_of(p);
  const Eigen::Matrix3d rotation = pose.topLeftCorner<3, 3>();
  matrix6 change = matrix6::Zero();
  change.topLeftCorner<3, 3>() = change.bottomRightCorner<3, 3>() = rotation;
  for (Eigen::Index i = 0; i < 3; ++i)
    change.block<3, 1>(3, i) = pose.topRightCorner<3, 1>().cross(rotation.col(i));
  return change.transpose() * change / (sphere_graph::noise * sphere_graph::noise);
}

/// None of the edges is in doubt, so that none is weighted or pruned. As many iterations as it
/// takes.
void pose_graph_of_2000_nodes(benchmark::State& state) {
  const auto& graph = graph_of_sphere();
  registration::PoseGraph poses;
  for (auto _ : state) {
    state.PauseTiming();
    poses = {};
    for (const auto& p : graph.start) poses.nodes_.emplace_back(pose_of(p));
    for (const auto& e : graph.edges)
      poses.edges_.emplace_back(e.source, e.target, pose_of(e.transform),
                                information_of(e.transform), false);
    state.ResumeTiming();
    registration::GlobalOptimization(poses, registration::GlobalOptimizationLevenbergMarquardt{},
                                     registration::GlobalOptimizationConvergenceCriteria{},
                                     registration::GlobalOptimizationOption{0.03, 0.25, 1, 0});
  }
  graph.report(state, [&](std::size_t i, std::size_t axis) {
    return poses.nodes_[i].pose_(Eigen::Index(axis), 3);
  });
}
CILANTRO_BENCHMARK(pose_graph_of_2000_nodes);

}  // namespace
