// SPDX-License-Identifier: MIT
//
// Real scans, against ground truth and against the straightforward way.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class S>
struct kinect_frame {
  image<std::uint16_t> depth;
  pinhole_camera<S> camera;
};

template <class S>
kinect_frame<S> read_frame(const std::filesystem::path& folder, const std::string& number) {
  kinect_frame<S> frame{.depth = read_depth_png(folder / ("frame-" + number + ".depth.png")),
                        .camera = {640, 480, 585, 585, 320, 240}};
  std::ifstream pose{folder / ("frame-" + number + ".pose.txt")};
  for (int i = 0; i < 16; ++i) {
    double value = 0;
    pose >> value;
    frame.camera.to_world.matrix()(i / 4, i % 4) = static_cast<S>(value);
  }
  REQUIRE(pose);
  return frame;
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + std::ssize(values) / 2);
  return values[values.size() / 2];
}

/// The triangles of a mesh in a text PLY file, which the library skips.
std::vector<std::array<index_t, 3>> read_triangles(const std::filesystem::path& path,
                                                   index_t vertices) {
  std::ifstream in{path};
  std::string line;
  while (std::getline(in, line) && !line.starts_with("end_header")) {
  }
  for (index_t i = 0; i < vertices; ++i) std::getline(in, line);
  std::vector<std::array<index_t, 3>> triangles;
  for (index_t n, a, b, c; in >> n >> a >> b >> c;) triangles.push_back({a, b, c});
  return triangles;
}

}  // namespace

TEST_CASE_TEMPLATE(
    "Kinect frames at their poses lie on each other as closely as the sensor measures", S, float,
    double) {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  const auto cloud_of = [&](const char* number) {
    const auto frame = read_frame<S>(*folder, number);
    return remove_invalid(point_cloud<S, 3>{.points = unproject(frame.depth, frame.camera)});
  };
  const auto reference = cloud_of("000000"), other = cloud_of("000020");
  CHECK(reference.size() == 273'943);
  const kd_tree tree{reference.points};
  std::vector<double> distances;
  for (const auto& near : tree.find_all(as_points(other.points), knn{1}))
    distances.push_back(double(near[0].distance));
  // Measured apart from this library: 2.1 to 4.3 mm for neighbouring frames.
  CHECK(median(distances) > 0.001);
  CHECK(median(distances) < 0.006);
}

TEST_CASE_TEMPLATE("in a Kinect frame the tree finds what brute force finds", S, float, double) {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  const auto frame = read_frame<S>(*folder, "000000");
  const auto points = unproject(frame.depth, frame.camera);  // With its invalid pixels.
  const kd_tree tree{points};
  const brute_force_searcher truth{points};
  std::vector<neighbor<S>> expected;
  for (std::uint64_t q = 0; q < 60; ++q) {
    const auto query = points.col(random_stream{1, q}.below(points.cols())).eval();
    for (const neighborhood_spec spec :
         {neighborhood_spec{knn{10}}, {radius{0.03}}, {knn_in_radius{30, 0.02}}}) {
      truth.find(query, spec, expected);
      CHECK(tree.find(query, spec) == expected);
    }
  }
}

TEST_CASE_TEMPLATE("a Kinect frame runs through the pipeline, the same with any number of threads",
                   S, float, double) {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  const auto frame = read_frame<S>(*folder, "000000");
  const auto run = [&](int threads) {
    return point_cloud<S, 3>{.points = unproject(frame.depth, frame.camera)} | remove_invalid() |
           voxel_downsample(0.01, {.threads = threads}) |
           estimate_normals(radius{0.03}, {.threads = threads});
  };
  const auto one = run(1);
  CHECK(one == run(2));
  CHECK(one == run(7));
  CHECK(one.points.allFinite());
  CHECK(one.normals.allFinite());
  // Where a normal is determined it is a unit vector; single points far from others have none.
  index_t undetermined = 0;
  for (index_t i = 0; i < one.size(); ++i) {
    const S length = one.normals.col(i).norm();
    undetermined += length == 0;
    CHECK((length == 0 || std::abs(length - 1) < S(1e-5)));
  }
  CHECK(undetermined < one.size() / 100);
}

TEST_CASE_TEMPLATE("the normals of the bunny's points are those of its mesh, but for its folds", S,
                   float, double) {
  const auto path = test::data_file("mesh_nonrigid/stanford/bun_zipper_res2.ply");
  SKIP_WITHOUT(path);
  const auto bunny = read_ply<S>(*path);
  REQUIRE(bunny.size() == 8171);
  const auto triangles = read_triangles(*path, bunny.size());
  REQUIRE(triangles.size() == 16'301);
  Eigen::Matrix3Xd mesh_normals = Eigen::Matrix3Xd::Zero(3, bunny.size());
  for (const auto& [a, b, c] : triangles) {
    const auto at = [&](index_t i) { return bunny.points.col(i).template cast<double>(); };
    const Eigen::Vector3d area = (at(b) - at(a)).cross(at(c) - at(a));
    for (const index_t i : {a, b, c}) mesh_normals.col(i) += area;
  }
  const auto [normals, curvature] = estimate_normals(bunny.points, knn{10});
  std::vector<double> angles;
  for (index_t i = 0; i < bunny.size(); ++i)
    if (mesh_normals.col(i).norm() > 0)
      angles.push_back(std::acos(std::clamp(
          std::abs(normals.col(i).template cast<double>().dot(mesh_normals.col(i).normalized())),
          0.0, 1.0)));
  std::ranges::sort(angles);
  const double degree = std::acos(-1.0) / 180;
  CHECK(angles[angles.size() / 2] < 5 * degree);
  CHECK(angles[angles.size() * 9 / 10] < 20 * degree);
}

TEST_CASE_TEMPLATE("a cloud of 882,399 colored points is read, reduced and written without loss", S,
                   float, double) {
  const auto path = test::data_file("large/derived/7scenes_1cm_firstpoint.ply");
  SKIP_WITHOUT(path);
  const auto cloud = read_ply<S>(*path);
  REQUIRE(cloud.size() == 882'399);
  REQUIRE(cloud.has_colors());
  const test::temporary_folder folder;
  write_ply(cloud, folder / "again.ply");
  CHECK(read_ply<S>(folder / "again.ply") == cloud);

  const double edge = 0.05;
  std::map<std::array<std::int64_t, 3>, std::pair<Eigen::Vector3d, index_t>> cells;
  for (index_t i = 0; i < cloud.size(); ++i) {
    std::array<std::int64_t, 3> cell;
    for (int d = 0; d < 3; ++d)
      cell[std::size_t(d)] = std::int64_t(std::floor(double(cloud.points(d, i)) / edge));
    auto& [sum, count] = cells.try_emplace(cell, Eigen::Vector3d::Zero(), 0).first->second;
    sum += cloud.points.col(i).template cast<double>();
    ++count;
  }
  const auto reduced = cloud | voxel_downsample(edge);
  REQUIRE(reduced.size() == std::ssize(cells));
  double worst = 0;
  index_t c = 0;
  for (const auto& [cell, sum] : cells) {
    const Eigen::Vector3d mean = sum.first / double(sum.second);
    worst = std::max(worst, (reduced.points.col(c++).template cast<double>() - mean).norm());
  }
  CHECK(worst < (sizeof(S) == 4 ? 1e-6 : 1e-14));
  CHECK(reduced.has_colors());
}

TEST_CASE_TEMPLATE("frames of three sensors become points and the same frames again", S, float,
                   double) {
  struct sensor {
    const char* depth;
    pinhole_camera<S> camera;
    double metres_per_unit;
  };
  const sensor sensors[] = {
      {"rgbd/7scenes_1000/frame-000100.depth.png", {640, 480, 585, 585, 320, 240}, 0.001},
      {"rgbd/open3d_redwood5/depth/00002.png", {640, 480, 525, 525, S(319.5), S(239.5)}, 0.001},
      {"rgbd/slambook_ch7_tum/1_depth.png",
       {640, 480, S(520.9), S(521), S(325.1), S(249.7)},
       1.0 / 5000}};
  for (const auto& sensor : sensors) {
    const auto path = test::data_file(sensor.depth);
    SKIP_WITHOUT(path);
    CAPTURE(sensor.depth);
    auto depth = read_depth_png(*path);
    const depth_scale scale{1 / sensor.metres_per_unit};
    const auto cloud = cloud_from_depth(depth, sensor.camera, {}, scale);
    const auto back =
        quantize_depth(project_depth(cloud.points, sensor.camera), 1 / sensor.metres_per_unit);
    // What says nothing is stored in two ways, and comes back in one.
    for (auto& value : depth.pixels())
      if (value == 65535) value = 0;
    CHECK(std::ranges::count_if(depth.pixels(), [](auto v) { return v > 0; }) == cloud.size());
    CHECK(back == depth);
  }
}
