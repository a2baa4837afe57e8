// SPDX-License-Identifier: MIT
//
// What the tests of registration share: motions, surfaces with known normals.
module;
#include <cmath>
#include <cstdint>
export module registration_support;

import cilantro;
import test_support;

export namespace test {

template <class Space>
using rigid_of = cilantro::rigid_transform<typename Space::scalar, Space::static_dimension>;
template <class Space>
using affine_of = cilantro::affine_transform<typename Space::scalar, Space::static_dimension>;

/// A seeded motion: `angle` radians in each plane of axes, at most, and `length` units.
template <class Space>
rigid_of<Space> random_rigid(std::uint64_t seed, double angle, double length) {
  constexpr cilantro::index_t d = Space::dimension;
  cilantro::random_stream random{seed};
  Eigen::VectorXd unknowns(cilantro::rigid_motion::unknowns(d));
  for (auto& u : unknowns) u = angle * random.uniform(-1, 1);
  unknowns.tail(d).setZero();
  Eigen::VectorXd translation(d);
  for (auto& t : translation) t = random.uniform(-1, 1);
  return cilantro::make_transform<rigid_of<Space>>(cilantro::rigid_motion::step(unknowns, d).linear,
                                                   translation.normalized() * length);
}

template <class Space>
affine_of<Space> random_affine(std::uint64_t seed, double size, double length) {
  constexpr cilantro::index_t d = Space::dimension;
  cilantro::random_stream random{seed};
  Eigen::MatrixXd linear = Eigen::MatrixXd::Identity(d, d);
  for (auto& a : linear.reshaped()) a += size * random.uniform(-1, 1);
  Eigen::VectorXd translation(d);
  for (auto& t : translation) t = random.uniform(-1, 1);
  return cilantro::make_transform<affine_of<Space>>(linear, translation.normalized() * length);
}

/// Points on an ellipsoid around the origin, and their true normals. Its axes differ, so that no
/// rotation is free.
template <class Space>
cilantro::point_cloud<typename Space::scalar, Space::static_dimension> bumpy_surface(
    cilantro::index_t count, std::uint64_t seed = 0) {
  constexpr cilantro::index_t d = Space::dimension;
  using S = typename Space::scalar;
  cilantro::point_cloud<S, Space::static_dimension> cloud;
  cloud.points.resize(d, count);
  cloud.normals.resize(d, count);
  Eigen::VectorXd axes(d);
  for (cilantro::index_t k = 0; k < d; ++k) axes[k] = 1 + 0.45 * double(k);
  for (cilantro::index_t i = 0; i < count; ++i) {
    cilantro::random_stream random{seed, std::uint64_t(i)};
    Eigen::VectorXd direction(d);
    for (auto& x : direction) x = random.normal();
    direction.normalize();
    // The gradient of the ellipsoid's equation is its normal.
    const Eigen::VectorXd point = axes.asDiagonal() * direction;
    const Eigen::VectorXd normal = (axes.cwiseInverse().asDiagonal() * direction).normalized();
    cloud.points.col(i) = point.cast<S>();
    cloud.normals.col(i) = normal.cast<S>();
  }
  return cloud;
}

/// Each source point with the target point of the same index.
template <class S>
cilantro::correspondences<S> same_indices(cilantro::index_t count) {
  cilantro::correspondences<S> pairs;
  for (std::int32_t i = 0; i < count; ++i) pairs.push_back({i, i, S(0)});
  return pairs;
}

/// The largest entry of the difference of two transforms.
double difference(const auto& a, const auto& b) {
  const double linear = double((a.linear() - b.linear()).cwiseAbs().maxCoeff());
  const double translation = double((a.translation() - b.translation()).cwiseAbs().maxCoeff());
  return linear > translation ? linear : translation;
}

}  // namespace test
