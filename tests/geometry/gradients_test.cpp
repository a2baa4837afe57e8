// SPDX-License-Identifier: MIT
//
// Gradients of values along surfaces: closed forms, and what neighbours do not determine.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stop_token>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Points of a hyperplane through the origin with their normals, and a value that is linear there.
template <class T>
struct linear_on_plane {
  using S = typename T::scalar;
  point_vector<S, T::static_dimension> normal =
      test::random_points<T>(1, 77).col(0).normalized().eval();
  point_matrix<S, T::static_dimension> points, normals;
  Eigen::VectorXd slope;
  std::vector<double> values;

  explicit linear_on_plane(index_t count) : points{test::random_points<T>(count, 5)} {
    points -= (normal * (normal.transpose() * points)).eval();
    normals = normal.replicate(1, count);
    slope = Eigen::VectorXd::LinSpaced(T::dimension, -1, 2);
    slope -= normal.template cast<double>() * slope.dot(normal.template cast<double>());
    for (index_t i = 0; i < count; ++i)
      values.push_back(3 + slope.dot(points.col(i).template cast<double>()));
  }
  [[nodiscard]] auto surface() const { return oriented_points_view{points, normals}; }
};

/// Some points of the plane z = 0, one a column.
template <class S>
struct on_floor {
  Eigen::Matrix<S, 3, dynamic> points, normals;

  explicit on_floor(const std::vector<std::array<double, 2>>& places)
      : points(3, std::ssize(places)), normals(3, std::ssize(places)) {
    for (index_t i = 0; i < points.cols(); ++i) {
      points.col(i) << S(places[std::size_t(i)][0]), S(places[std::size_t(i)][1]), S(0);
      normals.col(i) << S(0), S(0), S(1);
    }
  }
  [[nodiscard]] auto gradients(const std::vector<double>& values, neighborhood_spec spec) const {
    return value_gradients(oriented_points_view{points, normals}, values, spec);
  }
};

bool is_unknown(const auto& column) {
  return std::ranges::all_of(column, [](auto x) { return std::isnan(x); });
}

}  // namespace

TEST_CASE_TEMPLATE("the gradient of a linear value on a plane is its slope", T, ALL_SPACES) {
  const linear_on_plane<T> made{500};
  const double rounding = sizeof(typename T::scalar) == 4 ? 1e-4 : 1e-12;
  for (const neighborhood_spec& spec :
       {neighborhood_spec{knn{12}}, neighborhood_spec{knn_in_radius{30, 0.9}}}) {
    const auto gradients = value_gradients(made.surface(), made.values, spec);
    for (index_t i = 0; i < 500; ++i)
      CHECK((gradients.col(i).template cast<double>() - made.slope).norm() < rounding);
  }
}

TEST_CASE_TEMPLATE("the gradient on a sphere approaches the closed form", S, float, double) {
  // The largest error of evenly spread points, along a spiral with the golden angle.
  const auto worst_of = [](index_t count) {
    Eigen::Matrix<S, 3, dynamic> points(3, count);
    std::vector<S> values;
    for (index_t i = 0; i < count; ++i) {
      const double z = 1 - (2 * double(i) + 1) / double(count), r = std::sqrt(1 - z * z);
      const double turn = double(i) * std::numbers::pi * (3 - std::sqrt(5.0));
      points.col(i) << S(r * std::cos(turn)), S(r * std::sin(turn)), S(z);
      values.push_back(S(std::sin(3 * double(points(0, i))) + points(1, i) * points(2, i)));
    }
    // The points of a unit sphere are its normals.
    const auto gradients = value_gradients(oriented_points_view{points, points}, values, knn{9});
    double worst = 0;
    for (index_t i = 0; i < count; ++i) {
      const Eigen::Vector3d p = points.col(i).template cast<double>();
      const Eigen::Vector3d inside{3 * std::cos(3 * p.x()), p.z(), p.y()};
      const Eigen::Vector3d truth = inside - p * p.dot(inside);
      const Eigen::Vector3d found = gradients.col(i).template cast<double>();
      worst = std::max(worst, (found - truth).norm());
      CHECK(std::abs(found.dot(p)) < (sizeof(S) == 4 ? 1e-5 : 1e-12));
    }
    return worst;
  };
  const double coarse = worst_of(1500), fine = worst_of(24'000);
  CHECK(coarse < 0.4);  // The slope is up to 3.
  CHECK(fine < 0.3 * coarse);
}

TEST_CASE("a value that is the same everywhere has the gradient 0, rounded or not") {
  const auto points = test::random_points<test::f3>(200, 3);
  const Eigen::Matrix3Xf normals = Eigen::Vector3f{0, 0, 1}.replicate(1, 200);
  const oriented_points_view surface{points, normals};
  std::vector<float> nearly(200, 0.3f);
  for (index_t i = 0; i < 200; i += 2) nearly[std::size_t(i)] = std::nextafter(0.3f, 1.0f);
  CHECK(value_gradients(surface, nearly, knn{10}).isZero(0));
  CHECK(value_gradients(surface, std::vector<std::uint8_t>(200, 7), knn{10}).isZero(0));
  // In double, it is a difference.
  CHECK_FALSE(value_gradients(surface, std::vector<double>{nearly.begin(), nearly.end()}, knn{10})
                  .isZero(0));
}

TEST_CASE_TEMPLATE("neighbours on a line determine the gradient along the line only", S, float,
                   double) {
  // A line, and the same with jitter of a thousandth, which two neighbours would take for a slope.
  for (const double jitter : {0.0, 1e-3, 1e-7}) {
    std::vector<std::array<double, 2>> places;
    std::vector<double> values;
    random_stream random{1};
    for (int i = 0; i < 40; ++i) {
      places.push_back({0.1 * i, jitter * random.uniform(-1, 1)});
      values.push_back(0.5 * i + 0.05 * random.uniform(-1, 1));
    }
    const auto gradients = on_floor<S>{places}.gradients(values, knn{5});
    for (const auto& g : gradients.colwise()) {
      CHECK(double(g.x()) == doctest::Approx(5).epsilon(0.2));
      CHECK(std::abs(double(g.y())) < 0.1);
      CHECK(std::abs(double(g.z())) < 1e-9);
    }
  }
}

TEST_CASE(
    "two neighbours give a gradient where they are apart in two directions, and never a "
    "large one") {
  const on_floor<double> corner{{{0, 0}, {1, 0}, {0, 1}}};
  const auto exact = corner.gradients({1, 3, 0}, knn{3});
  CHECK((exact.col(0) - Eigen::Vector3d{2, -1, 0}).norm() < 1e-12);
  // Two neighbours at almost the same place, or across from each other.
  for (const auto& places : {std::vector<std::array<double, 2>>{{0, 0}, {1, 0}, {1, 1e-6}},
                             std::vector<std::array<double, 2>>{{0, 0}, {1, 0}, {-1, 1e-6}}}) {
    const auto gradients = on_floor<double>{places}.gradients({0, 0.1, 0.4}, knn{3});
    for (const auto& g : gradients.colwise()) CHECK(g.norm() < 0.5);
  }
  // The bound that is promised, for anything.
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    random_stream random{seed};
    std::vector<std::array<double, 2>> places;
    std::vector<double> values;
    const double flat = std::pow(10, random.uniform(-9, 0));
    for (int i = 0; i < 3; ++i) {
      places.push_back({random.uniform(-1, 1), flat * random.uniform(-1, 1)});
      values.push_back(random.uniform(0, 1));
    }
    const on_floor<double> made{places};
    const auto gradients = made.gradients(values, knn{3});
    for (index_t i = 0; i < 3; ++i) {
      double differences = 0, distances = 0;
      for (index_t j = 0; j < 3; ++j) {
        differences += std::pow(values[std::size_t(j)] - values[std::size_t(i)], 2);
        distances += (made.points.col(j) - made.points.col(i)).squaredNorm();
      }
      CHECK(gradients.col(i).norm() <= 10 * std::sqrt(2 * differences / distances) * (1 + 1e-9));
    }
  }
}

TEST_CASE("what is not known is NaN, and spoils nothing around it") {
  on_floor<double> grid{[] {
    std::vector<std::array<double, 2>> places;
    for (int i = 0; i < 100; ++i) places.push_back({0.1 * (i % 10), 0.1 * (i / 10)});
    places.push_back({50, 50});  // 100: alone within its radius.
    places.push_back({90, 90});  // 101 and 102: the same place twice.
    places.push_back({90, 90});
    return places;
  }()};
  std::vector<double> values;
  for (index_t i = 0; i < grid.points.cols(); ++i)
    values.push_back(grid.points(0, i) - 2 * grid.points(1, i));
  values[102] = 5;
  values[44] = test::nan<double>;
  values[45] = test::infinity<double>;
  grid.points(2, 12) = test::nan<double>;
  grid.normals.col(33).setZero();
  grid.normals(0, 77) = test::nan<double>;
  const auto gradients = grid.gradients(values, radius{0.16});
  const std::vector<index_t> unknown{12, 33, 44, 45, 77, 100, 101, 102};
  for (index_t i = 0; i < gradients.cols(); ++i) {
    if (std::ranges::find(unknown, i) != unknown.end())
      CHECK(is_unknown(gradients.col(i)));
    else
      CHECK((gradients.col(i) - Eigen::Vector3d{1, -2, 0}).norm() < 1e-9);
  }
}

TEST_CASE(
    "gradients of values do not depend on threads, on the type of the range, or on how far "
    "away the points are") {
  const linear_on_plane<test::f3> made{3000};
  std::vector<double> values = made.values;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::sin(values[i]);
  const auto one = value_gradients(made.surface(), values, knn{15}, {.threads = 1});
  for (const int threads : {2, 7})
    CHECK(test::same_bits(one,
                          value_gradients(made.surface(), values, knn{15}, {.threads = threads})));
  const Eigen::VectorXd in_eigen = Eigen::Map<const Eigen::VectorXd>{values.data(), 3000};
  CHECK(test::same_bits(one, value_gradients(made.surface(), in_eigen, knn{15})));

  // 100 km away in single precision, points are 8 mm apart at best.
  const auto far = (made.points.array() + 1e5f).matrix().eval();
  const auto rounded =
      value_gradients(oriented_points_view{far, made.normals}, values, radius{0.2});
  for (const auto& g : rounded.colwise()) CHECK((is_unknown(g) || g.norm() < 10));
}

TEST_CASE("gradients of clouds are those of their colours, or of an attribute") {
  const linear_on_plane<test::d3> made{300};
  point_cloud<double, 3> cloud{.points = made.points, .normals = made.normals};
  CHECK_THROWS_WITH_AS((void)color_gradients(cloud, knn{10}),
                       "color_gradients: the cloud has no colors", invalid_input);
  cloud.colors.resize(3, 300);
  std::vector<std::uint16_t> counts;
  for (index_t i = 0; i < 300; ++i) {
    const auto value = float(made.values[std::size_t(i)] / 10);
    cloud.colors.col(i) << value + 0.1f, value, value - 0.1f;
    counts.push_back(static_cast<std::uint16_t>(1000 * made.values[std::size_t(i)]));
  }
  cloud.set_attribute("counts", counts);
  cloud.origin << 500'000, 4'100'000, 0;
  const auto by_color = color_gradients(cloud, knn{12});
  const auto by_counts = attribute_gradients(cloud, "counts", knn{12});
  for (index_t i = 0; i < 300; ++i) {
    CHECK((10 * by_color.col(i) - made.slope).norm() < 1e-4);
    CHECK((by_counts.col(i) / 1000 - made.slope).norm() < 0.02);
  }
  CHECK_THROWS_AS((void)attribute_gradients(cloud, "intensity", knn{12}), invalid_input);
  cloud.normals.resize(3, 0);
  CHECK_THROWS_WITH_AS((void)color_gradients(cloud, knn{10}),
                       "value_gradients: the points have no normals; estimate them first",
                       invalid_input);
  CHECK(color_gradients(point_cloud<float, 3>{}, knn{10}).cols() == 0);
}

TEST_CASE("gradients of what makes no sense are refused") {
  const linear_on_plane<test::d3> made{50};
  CHECK_THROWS_AS((void)value_gradients(made.surface(), std::vector<float>(49), knn{9}),
                  invalid_input);
  CHECK_THROWS_AS((void)value_gradients(made.surface(), made.values, knn{2}), invalid_input);
  CHECK_THROWS_AS(
      (void)value_gradients(oriented_points_view{made.points, made.points}, made.values, knn{9}),
      invalid_input);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)value_gradients(made.surface(), made.values, knn{9},
                                        {.monitor = {.stop = stop.get_token()}}),
                  cancelled);
}
