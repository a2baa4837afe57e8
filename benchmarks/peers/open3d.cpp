// SPDX-License-Identifier: MIT
#include <open3d/camera/PinholeCameraIntrinsic.h>
#include <open3d/geometry/Image.h>
#include <open3d/geometry/KDTreeFlann.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>
#include <open3d/io/PointCloudIO.h>
#include <open3d/pipelines/registration/ColoredICP.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/pipelines/registration/TransformationEstimation.h>
#include <open3d/utility/Logging.h>

#include <cmath>
#include <cstring>
#include <numeric>
#include <tuple>
#include <vector>

#include "common.hpp"

namespace {

using open3d::geometry::KDTreeFlann;
using open3d::geometry::PointCloud;

PointCloud cloud_of(const std::vector<float>& xyz) {
  PointCloud made;
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    made.points_.emplace_back(double(xyz[i]), double(xyz[i + 1]), double(xyz[i + 2]));
  return made;
}
const PointCloud& points() {
  static const PointCloud cloud = cloud_of(frame());
  return cloud;
}

void tree_build(benchmark::State& state) {
  for (auto _ : state) {
    const KDTreeFlann tree{points()};
    benchmark::DoNotOptimize(&tree);
  }
  report_result(state, double(points().points_.size()));
}
CILANTRO_BENCHMARK(tree_build);

/// `find(tree, i, indices, squared_distances)` for every point, keeping what is found.
template <class F>
void search(benchmark::State& state, F find) {
  const KDTreeFlann tree{points()};
  const int n = int(points().points_.size());
  double sum = 0;
  for (auto _ : state) {
    std::vector<std::vector<int>> indices(std::size_t{0} + n);
    std::vector<std::vector<double>> distances(indices.size());
#pragma omp parallel for schedule(dynamic, 256)
    for (int i = 0; i < n; ++i) {
      find(tree, points().points_[std::size_t(i)], indices[std::size_t(i)],
           distances[std::size_t(i)]);
      for (double& d : distances[std::size_t(i)]) d = std::sqrt(d);
    }
    benchmark::DoNotOptimize(distances.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& near : distances) sum += std::accumulate(near.begin(), near.end(), 0.0);
    state.ResumeTiming();
  }
  report_result(state, sum);
}

void knn_of_all(benchmark::State& state) {
  search(state, [](const auto& tree, const auto& p, auto& indices, auto& distances) {
    tree.SearchKNN(p, neighbor_count, indices, distances);
  });
}
CILANTRO_BENCHMARK(knn_of_all);

void knn_30_of_all(benchmark::State& state) {
  search(state, [](const auto& tree, const auto& p, auto& indices, auto& distances) {
    tree.SearchKNN(p, many_neighbors, indices, distances);
  });
}
CILANTRO_BENCHMARK(knn_30_of_all);

void radius_of_all(benchmark::State& state) {
  search(state, [](const auto& tree, const auto& p, auto& indices, auto& distances) {
    tree.SearchRadius(p, double(voxel_edge), indices, distances);
  });
}
CILANTRO_BENCHMARK(radius_of_all);

void normals_of(benchmark::State& state, const open3d::geometry::KDTreeSearchParam& near) {
  double sum = 0;
  for (auto _ : state) {
    state.PauseTiming();
    PointCloud cloud = points();
    state.ResumeTiming();
    cloud.EstimateNormals(near);
    cloud.OrientNormalsTowardsCameraLocation(Eigen::Vector3d::Zero());
    benchmark::DoNotOptimize(cloud.normals_.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& n : cloud.normals_) sum += std::abs(n.z());
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void normals(benchmark::State& state) {
  normals_of(state, open3d::geometry::KDTreeSearchParamKNN(neighbor_count));
}
CILANTRO_BENCHMARK(normals);
void normals_by_radius(benchmark::State& state) {
  normals_of(state, open3d::geometry::KDTreeSearchParamRadius(double(voxel_edge)));
}
CILANTRO_BENCHMARK(normals_by_radius);

void voxels_of(benchmark::State& state, const PointCloud& cloud, float edge) {
  double count = 0;
  for (auto _ : state) {
    const auto reduced = cloud.VoxelDownSample(double(edge));
    benchmark::DoNotOptimize(reduced.get());
    count = double(reduced->points_.size());
  }
  report_result(state, count);
}
void voxels(benchmark::State& state) {
  voxels_of(state, points(), voxel_edge);
}
CILANTRO_BENCHMARK(voxels);
void voxels_5_mm(benchmark::State& state) {
  voxels_of(state, points(), small_voxel_edge);
}
CILANTRO_BENCHMARK(voxels_5_mm);
void large_voxels(benchmark::State& state) {
  voxels_of(state, cloud_of(large_points()), large_voxel_edge);
}
CILANTRO_BENCHMARK(large_voxels);

/// In place and in double.
void large_transform(benchmark::State& state) {
  PointCloud cloud = cloud_of(large_points());
  Eigen::Matrix4d turn = Eigen::Matrix4d::Identity();
  turn.topLeftCorner<3, 3>() = Eigen::AngleAxisd{0.3, Eigen::Vector3d::UnitZ()}.toRotationMatrix();
  for (auto _ : state) {
    cloud.Transform(turn);
    benchmark::DoNotOptimize(cloud.points_.data());
  }
}
CILANTRO_BENCHMARK(large_transform);

void ply_read(benchmark::State& state) {
  double sum = 0;
  for (auto _ : state) {
    PointCloud cloud;
    open3d::io::ReadPointCloud(data_path("large.ply"), cloud);
    benchmark::DoNotOptimize(cloud.points_.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& p : cloud.points_) sum += p.sum();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(ply_read);

void ply_write(benchmark::State& state) {
  PointCloud cloud;
  open3d::io::ReadPointCloud(data_path("large.ply"), cloud);
  for (auto _ : state) open3d::io::WritePointCloud(data_path("written_by_open3d.ply"), cloud);
  report_result(state, double(cloud.points_.size()));
}
CILANTRO_BENCHMARK(ply_write);

void outliers(benchmark::State& state) {
  double count = 0;
  for (auto _ : state) {
    const auto [kept, indices] =
        points().RemoveStatisticalOutliers(outlier_neighbors, outlier_deviations);
    benchmark::DoNotOptimize(kept.get());
    count = double(indices.size());
  }
  report_result(state, count);
}
CILANTRO_BENCHMARK(outliers);

void density(benchmark::State& state) {
  double labeled = 0;
  for (auto _ : state) {
    const auto labels = points().ClusterDBSCAN(density_radius, density_points);
    labeled = 0;
    for (const int l : labels) labeled += l >= 0;
  }
  report_result(state, labeled);
}
CILANTRO_BENCHMARK(density);

void plane_200(benchmark::State& state) {
  double inliers = 0;
  for (auto _ : state) {
    const auto found = points().SegmentPlane(plane_distance, 3, plane_samples, 1);
    inliers = double(std::get<1>(found).size());
  }
  report_result(state, inliers);
}
CILANTRO_BENCHMARK(plane_200);

namespace registration = open3d::pipelines::registration;

std::vector<Eigen::Vector3d> vectors(const std::vector<float>& all) {
  std::vector<Eigen::Vector3d> made;
  for (std::size_t i = 0; i < all.size(); i += 3)
    made.emplace_back(double(all[i]), double(all[i + 1]), double(all[i + 2]));
  return made;
}

void icp_point_to_plane(benchmark::State& state, const registration_pair& pair) {
  PointCloud source, target;
  source.points_ = vectors(pair.source);
  target.points_ = vectors(pair.target);
  target.normals_ = vectors(pair.target_normals);
  Eigen::Matrix4d found;
  // Negative: it never stops early.
  for (auto _ : state)
    found = registration::RegistrationICP(
                source, target, pair.max_distance, Eigen::Matrix4d::Identity(),
                registration::TransformationEstimationPointToPlane{},
                registration::ICPConvergenceCriteria{-1, -1, pair.iterations})
                .transformation_;
  report_pose(state, pair, [&](int i, int k) { return found(i, k); });
}

void icp_colored(benchmark::State& state, const registration_pair& pair) {
  PointCloud source, target;
  source.points_ = vectors(pair.source);
  source.colors_ = vectors(pair.source_colors);
  target.points_ = vectors(pair.target);
  target.normals_ = vectors(pair.target_normals);
  target.colors_ = vectors(pair.target_colors);
  Eigen::Matrix4d found;
  for (auto _ : state)
    found = registration::RegistrationColoredICP(
                source, target, pair.max_distance, Eigen::Matrix4d::Identity(),
                registration::TransformationEstimationForColoredICP{},
                registration::ICPConvergenceCriteria{-1, -1, pair.iterations})
                .transformation_;
  report_pose(state, pair, [&](int i, int k) { return found(i, k); });
}

void depth_to_points(benchmark::State& state) {
  open3d::geometry::Image depth;
  depth.Prepare(image_width, image_height, 1, 2);
  std::memcpy(depth.data_.data(), depth_image().data(), depth.data_.size());
  const open3d::camera::PinholeCameraIntrinsic camera{
      image_width, image_height, focal_length, focal_length, image_width / 2., image_height / 2.};
  double sum = 0;
  for (auto _ : state) {
    const auto cloud =
        PointCloud::CreateFromDepthImage(depth, camera, Eigen::Matrix4d::Identity(), 1000.0, 60.0);
    benchmark::DoNotOptimize(cloud.get());
    state.PauseTiming();
    sum = 0;
    for (const auto& p : cloud->points_) sum += p.z();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(depth_to_points);

/// The sum of all coordinates of a file, which is read again and again.
void read(benchmark::State& state, const char* name) {
  double sum = 0;
  for (auto _ : state) {
    PointCloud cloud;
    open3d::io::ReadPointCloud(data_path(name), cloud);
    benchmark::DoNotOptimize(cloud.points_.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& p : cloud.points_) sum += p.sum();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void pcd_read(benchmark::State& state) {
  read(state, "large.pcd");
}
CILANTRO_BENCHMARK(pcd_read);
void pcd_unpack(benchmark::State& state) {
  read(state, "large_compressed.pcd");
}
CILANTRO_BENCHMARK(pcd_unpack);
void xyz_read(benchmark::State& state) {
  read(state, "large.xyz");
}
CILANTRO_BENCHMARK(xyz_read);

void pcd_write(benchmark::State& state) {
  PointCloud cloud;
  open3d::io::ReadPointCloud(data_path("large.ply"), cloud);
  for (auto _ : state) open3d::io::WritePointCloud(data_path("written_by_open3d.pcd"), cloud);
  report_result(state, double(cloud.points_.size()));
}
CILANTRO_BENCHMARK(pcd_write);

void hull(benchmark::State& state, const std::vector<float>& xyz) {
  const auto cloud = cloud_of(xyz);
  double volume = 0;
  for (auto _ : state) {
    const auto mesh = std::get<0>(cloud.ComputeConvexHull());
    state.PauseTiming();
    // Its own volume first proves that the mesh is closed, which takes a hundred times as long. The
    // triangles are in no common order.
    volume = 0;
    const Eigen::Vector3d inner = mesh->GetCenter();
    for (const auto& t : mesh->triangles_) {
      const Eigen::Vector3d a = mesh->vertices_[t[0]] - inner, b = mesh->vertices_[t[1]] - inner;
      volume += std::abs(a.cross(b).dot(mesh->vertices_[t[2]] - inner)) / 6;
    }
    state.ResumeTiming();
  }
  report_result(state, volume);
}
void hull_of_frame(benchmark::State& state) {
  hull(state, frame());
}
CILANTRO_BENCHMARK(hull_of_frame);
void hull_of_cube(benchmark::State& state) {
  hull(state, cube_points());
}
CILANTRO_BENCHMARK(hull_of_cube);
void hull_of_sphere(benchmark::State& state) {
  hull(state, sphere_points());
}
CILANTRO_BENCHMARK(hull_of_sphere);

}  // namespace

int main(int argc, char** argv) {
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  return run_benchmarks(argc, argv, icp_point_to_plane, icp_colored);
}
