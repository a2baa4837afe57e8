// SPDX-License-Identifier: MIT
//
// Includes Eigen and the standard library first, and hands Eigen's types of every alignment over
// the border between its own code and the library's.
#include <Eigen/Dense>
#include <array>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <ranges>
#include <vector>

import cilantro;

// With another alignment the library's Eigen would be another Eigen.
static_assert(EIGEN_MAX_ALIGN_BYTES == 16 && alignof(Eigen::Matrix4f) == 16);

namespace {

void expect(bool condition, const char* what) {
  if (condition) return;
  std::cerr << "wrong: " << what << '\n';
  std::exit(1);
}

/// Wide members of fixed size: what is laid out differently where alignments differ.
struct pose {
  char name = 'p';
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  Eigen::Vector4d vector = Eigen::Vector4d::Ones();
};

}  // namespace

int main() {
  using namespace cilantro;
  const std::vector<std::array<double, 3>> scan{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 0}};
  const kd_tree tree{scan};
  expect(tree.nearest(Eigen::Vector3d{4, 4, 0})->index == 3, "nearest");

  // Allocated here and freed in the library, and the other way round.
  for (int repeat = 0; repeat < 100; ++repeat) {
    point_cloud<double, 3> cloud{.points = Eigen::Matrix3Xd::Random(3, 33),
                                 .normals = Eigen::Matrix3Xd::Random(3, 33)};
    cloud = estimate_normals(std::move(cloud), knn{5});
    expect(cloud.has_normals(), "a cloud that goes through the library");
    Eigen::MatrixXf means = voxel_downsample(Eigen::MatrixXf::Random(4, 50).eval(), 0.5);
    means.resize(means.rows(), means.cols() + 1);
  }
  Eigen::Affine3d by = Eigen::Affine3d::Identity();
  by.translation() = Eigen::Vector3d{1, 2, 3};
  expect(transform_points(by, scan).col(3) == Eigen::Vector3d{6, 7, 3}, "transform");

  auto poses = std::make_unique<std::array<pose, 5>>();
  for (auto& p : *poses) p.matrix.topLeftCorner<3, 3>() *= 2;
  expect((*poses)[4].matrix.trace() == 7 && (*poses)[4].vector.sum() == 4, "fixed-size members");

  auto [normals, curvature] = estimate_normals(scan, knn{3});
  expect(normals.row(2).cwiseAbs().isOnes(), "normals");
  auto views = as_points(scan) | std::views::filter([](const auto& p) { return p.x() > 0; });
  expect(std::ranges::distance(views) == 2, "views");
  std::cout << "consumed: " << normals.cols() << " normals\n";
}
