// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <doctest/doctest.h>

#include "spaces.hpp"
import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Whether a point is in a cylinder, by an orthonormal frame whose first axis is that of the
/// cylinder: by Gram and Schmidt, which has nothing in common with what is tested.
bool is_in_frame(const Eigen::VectorXd& base, const Eigen::VectorXd& top, double radius,
                 const Eigen::VectorXd& point) {
  const index_t d = base.size();
  Eigen::MatrixXd axes = Eigen::MatrixXd::Identity(d, d);
  axes.col(0) = top - base;
  // The coordinate axis along which the cylinder is longest makes way for it.
  index_t longest = 0;
  for (index_t k = 1; k < d; ++k)
    if (std::abs(axes(k, 0)) > std::abs(axes(longest, 0))) longest = k;
  if (longest > 0) axes.col(longest) = Eigen::VectorXd::Unit(d, 0);
  for (index_t j = 0; j < d; ++j) {
    for (index_t k = 0; k < j; ++k) axes.col(j) -= axes.col(k).dot(axes.col(j)) * axes.col(k);
    axes.col(j).normalize();
  }
  const Eigen::VectorXd y = axes.transpose() * (point - base);
  return y[0] >= 0 && y[0] <= (top - base).norm() && y.tail(d - 1).norm() <= radius;
}

}  // namespace

TEST_CASE_TEMPLATE("cylinders contain what a frame along their axis says, in any dimension", T,
                   ALL_SPACES) {
  const auto points = test::random_points<T>(4000, 3, -1.5, 1.5);
  random_stream random{7};
  for (int round = 0; round < 10; ++round) {
    Eigen::VectorXd base(T::dimension), top(T::dimension);
    for (int d = 0; d < T::dimension; ++d) {
      base[d] = random.uniform(-1, 1);
      top[d] = random.uniform(-1, 1);
    }
    const double radius = random.uniform(0.3, 1);
    const cylinder region{.base = base, .top = top, .radius = radius};
    const cylinder turned{.base = top, .top = base, .radius = radius};
    region.check(T::dimension);
    index_t wrong = 0, inside = 0;
    for (index_t i = 0; i < points.cols(); ++i) {
      const bool expected = is_in_frame(base, top, radius, points.col(i).template cast<double>());
      wrong += region.contains(points.col(i)) != expected;
      wrong += turned.contains(points.col(i)) != expected;
      inside += expected;
    }
    CHECK(wrong == 0);
    CHECK(inside > 0);
    CHECK(crop(points, region).cols() == inside);
    CHECK(remove_inside(points, region).cols() == points.cols() - inside);
  }
}

TEST_CASE("the boundary belongs to a cylinder, and what is one step beyond does not") {
  const cylinder upright{.base = {1, 2, 3}, .top = {1, 2, 5}, .radius = 0.5};
  const auto is_in = [&](double x, double y, double z) {
    return upright.contains(Eigen::Vector3d{x, y, z});
  };
  const double beyond = std::numeric_limits<double>::infinity();
  CHECK((is_in(1, 2, 3) && is_in(1, 2, 5) && is_in(1.5, 2, 5) && is_in(1, 1.5, 3)));
  CHECK_FALSE(is_in(1, 2, std::nextafter(5, beyond)));
  CHECK_FALSE(is_in(1, 2, std::nextafter(3, -beyond)));
  CHECK_FALSE(is_in(std::nextafter(1.5, beyond), 2, 4));
  CHECK_FALSE(is_in(1.4, 2.4, 4));
  // In the plane it is a rectangle.
  const cylinder flat{.base = {0, 0}, .top = {4, 0}, .radius = 1};
  CHECK((flat.contains(Eigen::Vector2d{4, -1}) && flat.contains(Eigen::Vector2d{0, 1})));
  CHECK_FALSE(flat.contains(Eigen::Vector2d{4.5, 0}));
  CHECK_FALSE(flat.contains(Eigen::Vector2d{2, 1.1}));
}

TEST_CASE("cylinders that are long and thin, tiny or far away are as good as others") {
  for (const double scale : {1e-150, 1e-9, 1.0, 1e9, 1e150}) {
    const cylinder wire{.base = {0, 0, 0}, .top = {scale, scale, scale}, .radius = 1e-7 * scale};
    wire.check(3);
    const Eigen::Vector3d middle = Eigen::Vector3d::Constant(0.7 * scale);
    const Eigen::Vector3d across = Eigen::Vector3d{1, -1, 0}.normalized() * wire.radius;
    CHECK(wire.contains(Eigen::Vector3d{middle + 0.999 * across}));
    CHECK_FALSE(wire.contains(Eigen::Vector3d{middle + 1.001 * across}));
  }
  const cylinder away{.base = {1e6, 0, 0}, .top = {1e6, 0, 1}, .radius = 0.25};
  CHECK(away.contains(Eigen::Vector3d{1e6 + 0.25, 0, 1}));
  CHECK_FALSE(away.contains(Eigen::Vector3d{1e6 + 0.2500001, 0, 1}));
}

TEST_CASE("cylinders without a direction, of no size and of other dimensions are refused") {
  constexpr double nan = test::nan<double>, infinity = test::infinity<double>;
  const auto refused = [](const cylinder& region, const char* why) {
    CHECK_THROWS_WITH_AS(region.check(3), doctest::Contains(why), invalid_input);
    CHECK_THROWS_AS((void)crop(Eigen::Matrix3Xf{Eigen::Matrix3Xf::Zero(3, 1)}, region),
                    invalid_input);
  };
  refused({.base = {1, 2, 3}, .top = {1, 2, 3}, .radius = 1}, "must be finite, and apart");
  refused({.base = {0, 0, 0}, .top = {0, 0, 1e-200}, .radius = 1}, "must be finite, and apart");
  refused({.base = {0, 0, 0}, .top = {0, 0, 1e200}, .radius = 1}, "must be finite, and apart");
  refused({.base = {0, 0, nan}, .top = {0, 0, 1}, .radius = 1}, "must be finite, and apart");
  refused({.base = {0, 0, 0}, .top = {0, infinity, 1}, .radius = 1}, "must be finite, and apart");
  refused({.base = {0, 0}, .top = {0, 1}, .radius = 1}, "dimension of the points");
  refused({.base = {0, 0, 0}, .top = {0, 1}, .radius = 1}, "dimension of the points");
  for (const double radius : {-1.0, 0.0, nan, infinity})
    CHECK_THROWS_AS((void)cylinder({.base = {0, 0, 0}, .top = {0, 0, 1}, .radius = radius}),
                    invalid_input);
  const cylinder sound{.base = {0, 0, 0}, .top = {0, 0, 1}, .radius = 1};
  CHECK_THROWS_AS((void)sound.contains(Eigen::Vector2d{0, 0}), invalid_input);
  CHECK_FALSE(sound.contains(Eigen::Vector3d{0, nan, 0.5}));
  CHECK_FALSE(sound.contains(Eigen::Vector3d{0, 0, infinity}));
}
