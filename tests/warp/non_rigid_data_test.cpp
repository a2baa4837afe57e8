// SPDX-License-Identifier: MIT
//
// Real and simulated bodies that move: one set of options for all.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// The vertices of a Wavefront file.
Eigen::Matrix3Xd vertices_of(const std::filesystem::path& path) {
  std::vector<Eigen::Vector3d> all;
  std::ifstream in{path};
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("v ")) {
      std::istringstream numbers{line.substr(2)};
      Eigen::Vector3d p;
      numbers >> p.x() >> p.y() >> p.z();
      all.push_back(p);
    }
  Eigen::Matrix3Xd points(3, std::ssize(all));
  for (index_t i = 0; i < points.cols(); ++i) points.col(i) = all[std::size_t(i)];
  return points;
}

template <int D>
double rms(const point_matrix<double, D>& difference) {
  return std::sqrt(difference.colwise().squaredNorm().mean());
}

}  // namespace

TEST_CASE("a body that jumps ends where its vertices are known to be") {
  const auto folder = test::data_file("mesh_nonrigid/fast_rnrr/jump_s005");
  SKIP_WITHOUT(folder);
  const Eigen::Matrix3Xd source = vertices_of(*folder / "source.obj"),
                         target = vertices_of(*folder / "target.obj");
  REQUIRE(source.cols() == 10002);
  REQUIRE(rms<3>(source - target) > 0.26);
  non_rigid_options options{.spacing = 0.08, .max_distance = 0.6};
  const auto found = align_non_rigid(source, target, options);
  CHECK(rms<3>(moved_points(found.transform, source) - target) < 0.0425);
  CHECK(found.overlap > 0.98);

  std::ifstream in{*folder / "landmark.txt"};
  for (index_t s = 0, t = 0; in >> s >> t;) options.landmarks.emplace_back(s, t);
  REQUIRE(options.landmarks.size() == 264);
  const auto held = align_non_rigid(source, target, options);
  CHECK(rms<3>(moved_points(held.transform, source) - target) < 0.021);
}

TEST_CASE("two frames of a scene that moves lie on each other") {
  const auto folder = test::data_file("mesh_nonrigid/cilantro");
  SKIP_WITHOUT(folder);
  const auto target = read_ply<float, 3>(*folder / "frame_1.ply"),
             source = read_ply<float, 3>(*folder / "frame_2.ply");
  const auto found = align_non_rigid(source, target, {.spacing = 0.025, .max_distance = 0.02});
  const auto moved = moved_points(found.transform, source.points);
  const kd_tree tree{target.points};
  double squares = 0;
  index_t near = 0;
  for (index_t i = 0; i < moved.cols(); ++i) {
    const auto nearest = tree.nearest(moved.col(i));
    if (!(nearest->distance < 0.02f)) continue;
    ++near;
    squares += std::pow(double((moved.col(i) - target.points.col(nearest->index))
                                   .dot(target.normals.col(nearest->index))),
                        2);
  }
  CHECK(std::sqrt(squares / double(near)) < 1.06e-3);
  CHECK(double(near) > 0.996 * double(moved.cols()));
}

TEST_CASE("a fish in the plane takes the other's shape") {
  const auto folder = test::data_file("mesh_nonrigid/pycpd");
  SKIP_WITHOUT(folder);
  const auto points_of = [&](const char* name) {
    std::ifstream in{*folder / name};
    std::vector<double> numbers;
    for (double x = 0; in >> x;) numbers.push_back(x);
    return Eigen::Matrix2Xd{
        Eigen::Map<Eigen::Matrix2Xd>{numbers.data(), 2, std::ssize(numbers) / 2}};
  };
  const auto source = points_of("fish_source.txt"), target = points_of("fish_target.txt");
  REQUIRE(source.cols() == 91);
  const auto found = align_non_rigid(source, target, {.spacing = 0.3, .max_distance = 2});
  const auto moved = moved_points(found.transform, source);
  const kd_tree tree{target};
  const auto distance = [&](const Eigen::Matrix2Xd& points) {
    double sum = 0;
    for (const auto p : points.colwise()) sum += tree.nearest(p)->distance;
    return sum / double(points.cols());
  };
  CHECK(distance(moved) < 0.4 * distance(source));
  // Point i of one is point i of the other.
  CHECK(rms<2>(moved - target) < 0.5 * rms<2>(source - target));
}
