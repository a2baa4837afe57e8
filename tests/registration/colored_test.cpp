// SPDX-License-Identifier: MIT
//
// Registration by colours and other values, where planes alone do not determine it.
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// A smooth picture, in [0, 1].
double picture(const Eigen::VectorXd& at) {
  double value = 0.5;
  for (index_t k = 0; k + 1 < at.size(); ++k)
    value += 0.4 / double(at.size() - 1) * std::sin((9 + 4 * double(k)) * at[k] + double(k)) *
             std::cos(5 * at[(k + 1) % (at.size() - 1)]);
  return value;
}

/// A flat wall across the last axis, with a picture on it: places of their own for each seed.
template <class T>
auto wall(index_t count, std::uint64_t seed) {
  using S = typename T::scalar;
  point_cloud<S, T::static_dimension> cloud{.points = test::random_points<T>(count, seed, 0, 1)};
  cloud.points.row(T::dimension - 1).setZero();
  cloud.normals.setZero(T::dimension, count);
  cloud.normals.row(T::dimension - 1).setOnes();
  cloud.colors.resize(3, count);
  std::vector<double> intensity;
  for (index_t i = 0; i < count; ++i) {
    const double value = picture(cloud.points.col(i).template cast<double>());
    cloud.colors.col(i) << float(value + 0.05), float(value - 0.05), float(value);
    intensity.push_back(3000 + 2000 * value);
  }
  cloud.set_attribute("intensity", intensity);
  return cloud;
}

/// Two scans of the wall: 2 cm and 1 cm apart in it, and 4 mm across.
template <class T>
struct two_scans {
  point_cloud<typename T::scalar, T::static_dimension> target, source;
  test::rigid_of<T> truth;

  explicit two_scans(index_t count = 10'000)
      : target{wall<T>(count, 1)}, source{wall<T>(count, 2)} {
    Eigen::VectorXd shift = Eigen::VectorXd::Zero(T::dimension);
    shift[0] = -0.02;
    if (T::dimension > 2) shift[1] = -0.01;
    shift[T::dimension - 1] = -0.004;
    truth = make_transform<test::rigid_of<T>>(Eigen::MatrixXd::Identity(T::dimension, T::dimension),
                                              shift);
    source = transform(std::move(source), test::inverse(truth));
  }
  /// How far points of the wall are from where they belong, at most.
  [[nodiscard]] double error(const auto& found) const {
    return double(
        (transform_points(found.transform, source.points) - transform_points(truth, source.points))
            .colwise()
            .norm()
            .maxCoeff());
  }
};

}  // namespace

TEST_CASE_TEMPLATE("a picture on a flat wall decides what planes leave open", T, test::f2, test::f3,
                   test::d2, test::d3, test::dx) {
  const two_scans<T> scans;
  constexpr index_t in_the_wall = rigid_motion::unknowns(T::dimension - 1);
  const auto by_plane = align(scans.source, scans.target, {.max_distance = 0.1});
  CHECK(by_plane.status == icp_status::degenerate);
  CHECK(by_plane.undetermined == in_the_wall);

  for (const colored& metric : {colored{}, colored{0.03}, colored{1e-3 + 0.5},
                                colored{.attribute = "intensity"}, colored{0.03, "intensity"}}) {
    const auto found = align(scans.source, scans.target, {.metric = metric, .max_distance = 0.1});
    CAPTURE(found);
    CHECK(found.status == icp_status::converged);
    CHECK(found.undetermined == 0);
    CHECK(found.unobservable_directions().cols() == 0);
    CHECK(scans.error(found) < (T::dimension > 3 ? 1e-2 : 1e-4));
    // The wall is noticed across and along itself.
    CHECK(found.eigenvalues.minCoeff() > 2e-3);
    const Eigen::MatrixXd sliding = found.information.topLeftCorner(found.unknowns, found.unknowns);
    CHECK(sliding.diagonal().minCoeff() > 0);
  }
}

TEST_CASE("colours on top of colours with voxels, kernels and an origin") {
  const two_scans<test::d3> scans;
  const auto check = [&](const align_options& options, double most) {
    const auto found = align(scans.source, scans.target, options);
    CAPTURE(found);
    CHECK(found.converged());
    CHECK(found.undetermined == 0);
    CHECK(scans.error(found) < most);
  };
  check({.metric = colored{}, .scales = {{0.03, 0.1}, {0.015, 0.05}}}, 5e-4);
  check({.metric = colored{}, .scales = {{0.03, 0.1}, {0, 0.03}}}, 1e-4);
  check({.metric = colored{.attribute = "intensity"}, .scales = {{0.03, 0.1}, {0.015, 0.05}}},
        5e-4);
  check({.metric = colored{}, .max_distance = 0.1, .robust = huber{0.005}}, 1e-4);
  check({.metric = colored{}, .max_distance = 0.1, .robust = tukey{0.05}, .reciprocal = true},
        1e-4);

  // Without normals, they are estimated.
  auto bare_source = scans.source, bare_target = scans.target;
  bare_source.normals.resize(3, 0);
  bare_target.normals.resize(3, 0);
  const auto bare = align(bare_source, bare_target, {.metric = colored{}, .max_distance = 0.1});
  CHECK(bare.converged());
  CHECK(scans.error(bare) < 1e-4);

  auto far_source = scans.source, far_target = scans.target;
  const Eigen::Vector3d base{500'000, 4'100'000, 300}, offset{3, -2, 1};
  far_target.origin = base;
  far_source.origin = base + offset;
  far_source.points.colwise() -= offset;
  const auto moved = far_source | align_to(far_target, {.metric = colored{}, .max_distance = 0.1});
  CHECK((moved.points - transform_points(scans.truth, scans.source.points)).norm() < 1e-2);

  const auto affine =
      align<affine_motion>(scans.source, scans.target, {.metric = colored{}, .max_distance = 0.1});
  CHECK(affine.undetermined == 3);  // Stretches across the wall, which is flat.
}

TEST_CASE("neither the unit of length nor that of the values changes the result") {
  const two_scans<test::d3> scans{4000};
  const align_options in_metres{
      .metric = colored{}, .max_distance = 0.1, .max_iterations = 8, .tolerance = 0};
  const auto found = align(scans.source, scans.target, in_metres);
  auto source = scans.source, target = scans.target;
  source.points *= 1000;
  target.points *= 1000;
  auto options = in_metres;
  options.max_distance = 100;
  const auto in_millimetres = align(source, target, options);
  CHECK((in_millimetres.transform.translation() / 1000 - found.transform.translation()).norm() <
        1e-6);
  CHECK((in_millimetres.eigenvalues - found.eigenvalues).norm() < 1e-6);
  options = in_metres;
  options.metric = colored{.attribute = "intensity"};
  const auto by_intensity = align(scans.source, scans.target, options);
  CHECK(test::difference(by_intensity.transform, found.transform) < 1e-6);
  CHECK((by_intensity.eigenvalues - found.eigenvalues).norm() < 1e-5);
}

TEST_CASE("values of yours over bare points, taken apart, and the same bits as align's") {
  const two_scans<test::f3> scans{3000};
  const auto& [target, source, truth] = scans;
  const auto at_once = align(source, target, {.metric = colored{}, .max_distance = 0.1});
  for (const int threads : {1, 3}) {
    const auto again =
        align(source, target, {.metric = colored{}, .max_distance = 0.1, .threads = threads});
    CHECK(again.transform.matrix() == at_once.transform.matrix());
    CHECK(again.information == at_once.information);
  }

  const colored_point_to_plane metric{intensities(source), intensities(target),
                                      color_gradients(target, knn{20})};
  const oriented_points_view onto{target.points, target.normals};
  const auto by_hand = icp(nearest_neighbor_searcher{source.points, onto, {.max_distance = 0.1}},
                           least_squares_estimator{source.points, onto, metric});
  CHECK(by_hand.transform.matrix() == at_once.transform.matrix());
  CHECK(by_hand.information == at_once.information);
  CHECK(by_hand.pairs == at_once.pairs);
  const auto as_argument = align(source.points, onto, metric, {.max_distance = 0.1});
  CHECK(as_argument.transform.matrix() == at_once.transform.matrix());
  CHECK(evaluate(source, target, at_once.transform, {.metric = colored{}, .max_distance = 0.1})
            .residual == at_once.residual);

  // With others beside it, and with a weight of its own.
  const auto combined = align(
      source.points, onto,
      combined_metric{weighted_term{metric, 0.5, unit_weight{}, huber{0.01}}, point_to_plane{}},
      {.max_distance = 0.1});
  CHECK(combined.converged());
  CHECK(scans.error(combined) < 1e-4);

  // Values are those of certain points: reduced ones have others.
  CHECK_THROWS_AS((void)align(source.points, onto, metric, {.scales = {{0.1, 0.1}}}),
                  invalid_input);
  const auto few = source | take(10);
  CHECK_THROWS_AS((least_squares_estimator{few, target, metric}), invalid_input);
}

TEST_CASE("the metric keeps the contract of residual terms") {
  const std::vector<float> source{0.25f}, target{0.75f};
  const auto check = [&]<int D>() {
    const auto gradient = point_matrix<double, D>::Constant(D == dynamic ? 4 : D, 1, 2.0).eval();
    for (const double share : {0.0, 0.3, 1.0})
      CHECK(
          check_residual_term<D>(colored_point_to_plane{source, target, gradient, share}).empty());
  };
  check.operator()<2>();
  check.operator()<3>();
  check.operator()<dynamic>();

  // The two rows, by hand: γ is the length of the only gradient.
  const Eigen::Matrix3Xd gradient = Eigen::Vector3d{4, 0, 0};
  const colored_point_to_plane metric{source, target, gradient, 0.36};
  std::vector<double> rows;
  const auto emit = [&](double value, const auto&...) { rows.push_back(value); };
  metric(matched_pair<3>{{0.1, 0, 0.2}, {0, 0, 0}, {0, 0, 0}, {0, 0, 1}, 0, 0}, emit);
  REQUIRE(rows.size() == 2);
  CHECK(rows[0] == doctest::Approx(0.8 * 0.2));
  CHECK(rows[1] == doctest::Approx(0.6 * (0.75 + 4 * 0.1 - 0.25) / 4));
}

TEST_CASE("what has no colour counts by its plane, and nothing without pairs is perfect") {
  two_scans<test::d3> scans{4000};
  auto& [target, source, truth] = scans;
  for (index_t i = 0; i < 4000; i += 3) source.colors.col(i).setConstant(test::nan<float>);
  for (index_t i = 0; i < 4000; i += 5) target.colors.col(i).setConstant(test::nan<float>);
  for (index_t i = 0; i < 4000; i += 7) target.normals.col(i).setZero();
  for (const robust_kernel& robust : {robust_kernel{}, robust_kernel{huber{0.01}}}) {
    const auto found =
        align(source, target, {.metric = colored{}, .max_distance = 0.1, .robust = robust});
    CHECK(found.converged());
    CHECK(scans.error(found) < 2e-4);
  }

  // A wall of one colour is as open as one without.
  auto grey = target;
  grey.colors.setConstant(0.3f);
  const auto open = align(source, grey, {.metric = colored{}, .max_distance = 0.1});
  CHECK(open.status == icp_status::degenerate);
  CHECK(open.undetermined == 3);
  const auto only = align(source, grey, {.metric = colored{1}, .max_distance = 0.1});
  CHECK(only.status == icp_status::degenerate);
  CHECK(only.undetermined == 6);

  auto elsewhere = source;
  elsewhere.points.row(2).array() += 9;
  const auto none = align(elsewhere, target, {.metric = colored{}, .max_distance = 0.1});
  CHECK(none.status == icp_status::too_few_pairs);
  CHECK(none.pairs == 0);
  CHECK(none.overlap == 0);
  CHECK_FALSE(none.converged());
  CHECK(align(point_cloud<double, 3>{}, target, {.metric = colored{}}).status ==
        icp_status::too_few_pairs);
}

TEST_CASE("colours that are missing, and shares that are none, are refused with a sentence") {
  const two_scans<test::f3> scans{500};
  auto plain = scans.source;
  plain.colors.resize(3, 0);
  CHECK_THROWS_WITH_AS((void)align(plain, scans.target, {.metric = colored{}}),
                       "align: the metric `colored` needs colors, and the source has none",
                       invalid_input);
  CHECK_THROWS_WITH_AS((void)align(scans.source, plain, {.metric = colored{}}),
                       "align: the metric `colored` needs colors, and the target has none",
                       invalid_input);
  CHECK_THROWS_AS((void)align(plain.points, plain.points, {.metric = colored{}}), invalid_input);
  CHECK_THROWS_WITH_AS(
      (void)align(scans.source, scans.target, {.metric = colored{.attribute = "heat"}}),
      "align: the metric `colored` needs the attribute \"heat\", and the source has none",
      invalid_input);
  CHECK_THROWS_AS(
      (void)align(plain.points, plain.points, {.metric = colored{.attribute = "intensity"}}),
      invalid_input);
  for (const double share : {-0.1, 1.1, test::nan<double>})
    CHECK_THROWS_AS((void)align(scans.source, scans.target, {.metric = colored{share}}),
                    invalid_input);
  const std::vector<float> two(2), three(3);
  CHECK_THROWS_AS((colored_point_to_plane{two, three, Eigen::Matrix3Xf::Zero(3, 2).eval()}),
                  invalid_input);
}
