// SPDX-License-Identifier: MIT
//
// Real scans with ground truth, and a reference written the straightforward way, in double.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class S>
point_cloud<S, 3> kinect_frame(const std::filesystem::path& folder, int number) {
  std::ostringstream name;
  name << "frame-" << std::setw(6) << std::setfill('0') << number << ".depth.png";
  return cloud_from_depth(read_depth_png(folder / name.str()),
                          pinhole_camera<S>{640, 480, 585, 585, 320, 240});
}

Eigen::Isometry3d kinect_pose(const std::filesystem::path& folder, int number) {
  std::ostringstream name;
  name << "frame-" << std::setw(6) << std::setfill('0') << number << ".pose.txt";
  std::ifstream in{folder / name.str()};
  Eigen::Isometry3d pose;
  for (int i = 0; i < 16; ++i) in >> pose.matrix()(i / 4, i % 4);
  REQUIRE(in);
  return pose;
}

double angle_of(const Eigen::Matrix3d& rotation) {
  return std::abs(Eigen::AngleAxisd{rotation}.angle());
}

struct pose_error {
  double translation, rotation;  ///< In units, and in degrees.
};
pose_error between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Isometry3d difference = a.inverse() * b;
  return {difference.translation().norm(), angle_of(difference.linear()) * 180 / std::numbers::pi};
}
Eigen::Isometry3d in_double(const auto& transform) {
  return Eigen::Isometry3d{transform.matrix().template cast<double>()};
}

/// Point-to-plane ICP as one would write it down: all in double, normal equations around the
/// origin, an LDLT, and a rotation vector for each step.
Eigen::Isometry3d reference_icp(const point_cloud<double, 3>& source,
                                const point_cloud<double, 3>& target, double max_distance,
                                int iterations) {
  const kd_tree tree{target.points};
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  for (int i = 0; i < iterations; ++i) {
    Eigen::Matrix<double, 6, 6> a = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
    for (const auto& p : source.points.colwise()) {
      const Eigen::Vector3d y = transform * p;
      const auto near = tree.nearest(y);
      if (!near || near->distance > max_distance) continue;
      const Eigen::Vector3d n = target.normals.col(near->index);
      Eigen::Matrix<double, 6, 1> row;
      row << y.cross(n), n;
      a += row * row.transpose();
      b -= row * n.dot(y - target.points.col(near->index));
    }
    const Eigen::Matrix<double, 6, 1> step = a.ldlt().solve(b);
    Eigen::Isometry3d move = Eigen::Isometry3d::Identity();
    const Eigen::Vector3d turn = step.head<3>();
    if (turn.norm() > 0)
      move.linear() = Eigen::AngleAxisd{turn.norm(), turn.normalized()}.toRotationMatrix();
    move.translation() = step.tail<3>();
    transform = move * transform;
  }
  return transform;
}

std::string row(const char* what, const pose_error& error, const auto& found, double unit) {
  std::ostringstream text;
  text << what << ": " << error.translation * unit << " mm, " << error.rotation << " deg; "
       << to_string(found.status) << " after " << found.iterations << ", overlap " << found.overlap
       << ", rmse " << found.rmse * unit << " mm, least eigenvalue "
       << found.eigenvalues.minCoeff();
  return text.str();
}

/// The numbers of a text file, line by line.
std::vector<std::vector<double>> numbers_in(const std::filesystem::path& path) {
  std::ifstream in{path};
  std::vector<std::vector<double>> lines;
  for (std::string line; std::getline(in, line);) {
    std::ranges::replace(line, ',', ' ');
    std::ranges::replace(line, '/', ' ');
    std::istringstream words{line};
    std::vector<double> numbers;
    for (double value; words >> value;) numbers.push_back(value);
    if (!numbers.empty()) lines.push_back(numbers);
  }
  return lines;
}

template <int D>
Eigen::Matrix<double, D, dynamic> points_in_text(const std::filesystem::path& path) {
  const auto lines = numbers_in(path);
  Eigen::Matrix<double, D, dynamic> points(D, std::ssize(lines));
  for (index_t i = 0; i < points.cols(); ++i)
    for (int d = 0; d < D; ++d) points(d, i) = lines[std::size_t(i)][std::size_t(d)];
  return points;
}

}  // namespace

TEST_CASE_TEMPLATE("Kinect frames end where a plain reference in double ends", S, float, double) {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  const auto target =
      kinect_frame<S>(*folder, 0) | voxel_downsample(0.01) | estimate_normals(knn{10});
  struct expectation {
    int frame;
    double millimetres, degrees;  ///< From the recorded pose; measured apart from this library.
  };
  for (const auto& [number, millimetres, degrees] :
       {expectation{1, 2.782, 0.083}, {10, 10.170, 0.296}, {20, 4.86, 0.085}}) {
    const auto source = kinect_frame<S>(*folder, number) | voxel_downsample(0.01);
    const auto found = align(
        source, target,
        {.metric = point_to_plane{}, .max_distance = 0.05, .max_iterations = 15, .tolerance = 0});
    const Eigen::Isometry3d transform = in_double(found.transform);
    const auto reference = reference_icp(cast<double>(source), cast<double>(target), 0.05, 15);
    const auto difference = between(reference, transform);
    const Eigen::Isometry3d truth =
        kinect_pose(*folder, 0).inverse() * kinect_pose(*folder, number);
    const auto error = between(truth, transform);
    MESSAGE(row(("frame " + std::to_string(number)).c_str(), error, found, 1000)
            << "; from the reference " << difference.translation * 1e6 << " um");
    // Frame 20 is still on its way after so many iterations, where rounding parts the two.
    CHECK(difference.translation < (number == 20 ? 1e-5 : 5e-6));
    CHECK(difference.rotation < 5e-4);
    // Single precision and the order of sums move voxels, and with them the result, a little.
    CHECK(std::abs(error.translation * 1000 - millimetres) < 0.1);
    CHECK(std::abs(error.rotation - degrees) < 0.005);
    CHECK(found.undetermined == 0);
    CHECK(found.overlap > 0.95);
  }
}

TEST_CASE("every metric brings Kinect frames to within a centimetre or so of their poses") {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  const auto target = kinect_frame<float>(*folder, 0) | voxel_downsample(0.01);
  const auto source = kinect_frame<float>(*folder, 20) | voxel_downsample(0.01);
  const Eigen::Isometry3d truth = kinect_pose(*folder, 0).inverse() * kinect_pose(*folder, 20);
  const auto check = [&](const char* name, const metric_choice& metric, double most) {
    const auto found = align(source, target,
                             {.metric = metric,
                              .max_distance = 0.1,
                              .max_iterations = 60,
                              .tolerance = 1e-4,
                              .robust = huber{0.01}});
    const auto error = between(truth, in_double(found.transform));
    MESSAGE(row(name, error, found, 1000));
    CHECK(error.translation < most);
    CHECK(error.rotation < 0.5);
  };
  check("point to plane", point_to_plane{}, 0.01);
  check("symmetric", symmetric{}, 0.01);
  check("generalised ICP", generalized_icp{}, 0.012);
  check("point to point", point_to_point{}, 0.05);
  check("combined",
        combined_metric{weighted_term{point_to_point{}, 0.1}, weighted_term{point_to_plane{}, 1}},
        0.015);
}

TEST_CASE("colours and cameras as searchers find the pose of a Kinect frame, too") {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  const pinhole_camera<float> camera{640, 480, 585, 585, 320, 240};
  const auto full = kinect_frame<float>(*folder, 0);
  const auto target = full | voxel_downsample(0.01) | estimate_normals(knn{10});
  const auto source =
      kinect_frame<float>(*folder, 5) | voxel_downsample(0.01) | estimate_normals(knn{10});
  const Eigen::Isometry3d truth = kinect_pose(*folder, 0).inverse() * kinect_pose(*folder, 5);
  const least_squares_estimator estimator{source, target};
  const auto check = [&](const char* name, const auto& searcher) {
    const auto found = icp(searcher, estimator, Eigen::Isometry3f::Identity(),
                           {.max_iterations = 30, .tolerance = 1e-4});
    const auto error = between(truth, in_double(found.transform));
    MESSAGE(row(name, error, found, 1000));
    CHECK(error.translation < 0.01);
    CHECK(error.rotation < 0.4);
  };
  check("projective", projective_searcher{source, target, camera, {.max_distance = 0.1}});
  check("with normals",
        feature_searcher{joint_features{source, target, {.normals = 0.05}}, {.max_distance = 0.1}});
  check("reciprocal",
        nearest_neighbor_searcher{source, target, {.max_distance = 0.1, .reciprocal = true}});
  check("trimmed",
        nearest_neighbor_searcher{source, target, {.max_distance = 0.1, .fraction = 0.8}});
}

TEST_CASE("a chain of Kinect frames drifts by no more than a known amount") {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  constexpr int frames = 25;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const auto prepare = voxel_downsample(0.01) | estimate_normals(knn{10});
  auto previous = kinect_frame<float>(*folder, 0) | prepare;
  for (int i = 1; i < frames; ++i) {
    auto next = kinect_frame<float>(*folder, i) | prepare;
    const auto found = align(next, previous, {.max_distance = 0.05, .max_iterations = 15});
    REQUIRE(found.undetermined == 0);
    pose = pose * in_double(found.transform);
    previous = std::move(next);
  }
  const Eigen::Isometry3d truth =
      kinect_pose(*folder, 0).inverse() * kinect_pose(*folder, frames - 1);
  double length = 0;
  for (int i = 1; i < frames; ++i)
    length +=
        (kinect_pose(*folder, i).translation() - kinect_pose(*folder, i - 1).translation()).norm();
  const auto error = between(truth, pose);
  MESSAGE("after " << frames << " frames and " << length << " m: " << error.translation * 1000
                   << " mm, " << error.rotation << " deg");
  // The poses of neighbouring frames are no better than that: see the single pairs above.
  CHECK(error.translation < 0.04);
  CHECK(error.rotation < 1.5);
}

TEST_CASE("range scans of the Stanford bunny are brought back to where they were scanned") {
  const auto folder = test::data_file("registration/stanford_bunny_scans");
  SKIP_WITHOUT(folder);
  // Positions and quaternions of bun.conf; p_world = R(q)ᵀ p + t.
  std::ifstream in{*folder / "bun.conf"};
  const auto pose_of = [&](const std::string& name) {
    in.clear();
    in.seekg(0);
    for (std::string line; std::getline(in, line);) {
      std::istringstream words{line};
      std::string kind, file;
      words >> kind >> file;
      if (file != name) continue;
      double t[3], q[4];
      for (double& x : t) words >> x;
      for (double& x : q) words >> x;
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.linear() =
          Eigen::Quaterniond{q[3], q[0], q[1], q[2]}.normalized().toRotationMatrix().transpose();
      pose.translation() << t[0], t[1], t[2];
      return pose;
    }
    FAIL("no pose");
    return Eigen::Isometry3d::Identity();
  };
  const auto load = [&](const std::string& name) {
    return transform(read_ply<double>(*folder / name), pose_of(name));
  };
  const auto target = load("bun000.ply"), source = load("bun045.ply");
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    random_stream random{seed};
    const Eigen::Vector3d axis{random.normal(), random.normal(), random.normal()};
    Eigen::Isometry3d perturbation = Eigen::Isometry3d::Identity();
    perturbation.linear() = Eigen::AngleAxisd{0.1, axis.normalized()}.toRotationMatrix();
    perturbation.translation() << 0.003, -0.002, 0.002;
    const auto found =
        align(transform(source, perturbation), target, {.scales = {{0.003, 0.02}, {0.001, 0.004}}});
    const auto error = between(perturbation.inverse(), found.transform);
    MESSAGE(row("bunny", error, found, 1000));
    CHECK(error.translation < 0.001);
    CHECK(error.rotation < 0.5);
  }
}

TEST_CASE("libpointmatcher's scans come as close to their reference as its own tests demand") {
  const auto folder = test::data_file("registration/libpointmatcher");
  SKIP_WITHOUT(folder);
  const auto references = numbers_in(*folder / "REFERENCE_T.txt");
  const auto reference_of = [&](std::size_t size) {
    for (const auto& line : references)
      if (line.size() == size) return line;
    FAIL("no reference");
    return std::vector<double>{};
  };
  {
    // The reference maps the scan of two boxes onto that of one.
    const auto target = points_in_text<2>(*folder / "2D_oneBox.csv");
    const auto source = points_in_text<2>(*folder / "2D_twoBoxes.csv");
    const auto truth = reference_of(9);
    const auto found =
        align(source, target,
              {.max_distance = 1, .max_iterations = 100, .normals = knn{7}, .fraction = 0.85});
    const double shift = std::hypot(found.transform.translation().x() - truth[2],
                                    found.transform.translation().y() - truth[5]);
    const double angle =
        std::abs(std::atan2(found.transform.linear()(1, 0), found.transform.linear()(0, 0)) -
                 std::atan2(truth[3], truth[0]));
    MESSAGE("2D: " << shift << " m, " << angle << " rad, " << to_string(found.status));
    CHECK(shift < 0.05);
    CHECK(angle < 0.05);
  }
  point_cloud<double, 3> target{.points = points_in_text<3>(*folder / "car_cloud400.csv")};
  const point_cloud<double, 3> source{.points = points_in_text<3>(*folder / "car_cloud401.csv")};
  const auto truth = reference_of(16);
  Eigen::Isometry3d reference;
  for (int i = 0; i < 16; ++i) reference.matrix()(i / 4, i % 4) = truth[std::size_t(i)];
  const auto found = align(source, target, {.scales = {{0.3, 2}, {0.15, 0.5}}});
  const auto error = between(reference, found.transform);
  MESSAGE(row("car", error, found, 1000));
  CHECK(error.translation < 0.15);
  CHECK(error.rotation < 1.5);
}

TEST_CASE("a car's lidar moves as its scans say") {
  const auto folder = test::data_file("registration/kitti00");
  SKIP_WITHOUT(folder);
  const auto scan = [&](const char* name) {
    std::ifstream in{*folder / name, std::ios::binary};
    const std::string bytes{std::istreambuf_iterator<char>{in}, {}};
    Eigen::Matrix4Xf records(4, std::ssize(bytes) / 16);
    std::memcpy(records.data(), bytes.data(), bytes.size());
    return point_cloud<float, 3>{.points = records.topRows<3>()};
  };
  const auto matrix = [](const std::vector<double>& numbers, std::size_t from) {
    Eigen::Isometry3d t = Eigen::Isometry3d::Identity();
    for (std::size_t i = 0; i < 12; ++i) t.matrix()(int(i / 4), int(i % 4)) = numbers[from + i];
    return t;
  };
  const auto poses = numbers_in(*folder / "poses_cam0_first6.txt");
  std::vector<std::vector<double>> rows;
  for (const auto& p : poses)
    if (p.size() == 13) rows.push_back(p);
  std::vector<double> calibration;
  for (const auto& p : numbers_in(*folder / "calib_Tr.txt"))
    if (p.size() == 12) calibration = p;
  REQUIRE(rows.size() >= 3);
  REQUIRE(calibration.size() == 12);
  const auto to_camera = matrix(calibration, 0);
  const Eigen::Isometry3d truth =
      to_camera.inverse() * matrix(rows[0], 1).inverse() * matrix(rows[2], 1) * to_camera;
  const auto target = scan("000000.bin"), source = scan("000002.bin");
  const auto run = [&](const Eigen::Isometry3d& start) {
    return align(source, target,
                 {.initial = Eigen::Isometry3f{start.matrix().cast<float>()},
                  .scales = {{0.5, 3}, {0.25, 1}},
                  .normals = radius{1},
                  .robust = cauchy{0.1}});
  };
  const auto found = run(Eigen::Isometry3d::Identity());
  const auto error = between(truth, in_double(found.transform));
  MESSAGE(row("KITTI", error, found, 1000));
  CHECK(found.converged());
  CHECK(truth.translation().norm() == doctest::Approx(1.72).epsilon(0.01));
  // The recorded poses of these first frames are 0.34 m farther apart than the scans fit, along the
  // road; from wherever it starts.
  CHECK(error.translation < 0.36);
  CHECK(error.rotation < 0.3);
  CHECK(between(in_double(run(truth).transform), in_double(found.transform)).translation < 0.005);
  const kd_tree tree{target.points};
  const auto median_distance = [&](const Eigen::Isometry3f& transform) {
    std::vector<double> distances;
    for (const auto& near :
         find_neighborhoods(tree, transform_points(transform, source.points), knn{1}))
      distances.push_back(double(near[0].distance));
    std::ranges::nth_element(distances, distances.begin() + std::ssize(distances) / 2);
    return distances[distances.size() / 2];
  };
  const double ours = median_distance(found.transform);
  const double recorded = median_distance(Eigen::Isometry3f{truth.matrix().cast<float>()});
  MESSAGE("median distance: " << ours << " m, at the recorded pose " << recorded << " m");
  CHECK(ours < 0.75 * recorded);
}

TEST_CASE("a pair of lidar scans comes to its recorded transform") {
  const auto folder = test::data_file("registration/small_gicp");
  SKIP_WITHOUT(folder);
  Eigen::Isometry3d truth;
  const auto lines = numbers_in(*folder / "T_target_source.txt");
  for (int i = 0; i < 16; ++i)
    truth.matrix()(i / 4, i % 4) = lines[std::size_t(i / 4)][std::size_t(i % 4)];
  const auto target = read_ply<float>(*folder / "target.ply"),
             source = read_ply<float>(*folder / "source.ply");
  const auto found = align(
      source, target,
      {.max_iterations = 100, .scales = {{0.25, 1}}, .normals = radius{1}, .robust = cauchy{0.1}});
  const auto error = between(truth, in_double(found.transform));
  MESSAGE(row("lidar pair", error, found, 1000));
  CHECK(found.converged());
  CHECK(error.translation < 0.03);
  CHECK(error.rotation < 0.3);
}
