// SPDX-License-Identifier: MIT
//
// Maps that move each point in its own way, through the searchers, metrics and loop that affine
// transforms go through.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// A shift for each point: the smallest field that there is.
template <class S, int D>
struct shift_field {
  using Scalar = S;
  point_matrix<S, D> shifts;

  [[nodiscard]] index_t size() const { return shifts.cols(); }
  point_vector<S, D> operator()(index_t i, const point_vector<S, D>& p) const {
    return p + shifts.col(i);
  }
  [[nodiscard]] point_vector<S, D> normal(index_t, const point_vector<S, D>& n) const { return n; }
};

/// A field of any number of points, that says nothing about normals.
struct wave {
  using Scalar = double;
  double height;
  Eigen::Vector3d operator()(index_t, const Eigen::Vector3d& p) const {
    return p + Eigen::Vector3d{0, 0, height * std::sin(p.x())};
  }
};

template <class T>
auto some_field(index_t count, std::uint64_t seed) {
  using S = typename T::scalar;
  return shift_field<S, T::static_dimension>{test::random_points<T>(count, seed, S(-0.1), S(0.1))};
}

constexpr auto places_of = [](const auto& pair) { return std::pair{pair.source, pair.target}; };

template <class Searcher, class Map>
auto found_by(const Searcher& searcher, const Map& map) {
  pairs_of<Searcher, Map> pairs;
  searcher.find(map, pairs);
  return pairs;
}

/// Moves each point along the rows that a metric gives for its pair, and holds those without pairs.
template <class Metric>
struct field_estimator {
  using transform_type = shift_field<double, 3>;
  oriented_points_view<double, 3> source, target;
  Metric metric;

  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, std::span<const correspondence<double>> pairs) const {
    registration_step<transform_type> step{current, {}, {}};
    step.fit.pairs = std::ssize(pairs);
    step.fit.unknowns = 3 * source.points.size();
    const pair_matcher matcher{metric, current, source, target};
    std::vector<char> is_seen(std::size_t(source.points.size()), 0);
    for (const auto& pair : pairs) {
      is_seen[std::size_t(pair.source)] = 1;
      Eigen::Matrix3d information = 1e-9 * Eigen::Matrix3d::Identity();
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      weighted_rows(metric, matcher(pair), pair.distance,
                    [&](double weight, double value, const Eigen::Vector3d& g, const auto&) {
                      information += weight * g * g.transpose();
                      gradient += weight * value * g;
                    });
      const Eigen::Vector3d shift = -information.inverse() * gradient;
      step.transform.shifts.col(pair.source) += shift;
      step.change.translation = std::max(step.change.translation, shift.norm());
    }
    step.fit.undetermined = 3 * std::ranges::count(is_seen, 0);
    step.fit.overlap = double(std::ranges::count(is_seen, 1)) / double(is_seen.size());
    return step;
  }
};

}  // namespace

static_assert(PointMap<Eigen::Isometry3f, 3> && NormalMap<Eigen::Affine2d, 2>);
static_assert(PointMap<shift_field<float, 3>, 3> && NormalMap<shift_field<float, 3>, 3>);
static_assert(PointMap<wave, 3> && !NormalMap<wave, 3>);

TEST_CASE_TEMPLATE("every searcher finds under a field what it finds of points moved before", T,
                   test::f2, test::f3, test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  using S = typename T::scalar;
  auto target = test::random_points<T>(300, 1), source = test::random_points<T>(200, 2);
  target(0, 7) = test::nan<S>;
  source(1, 3) = test::infinity<S>;
  const auto still = identity_transform<test::rigid_of<T>>(T::dimension);
  using enum search_direction;
  for (const auto direction : {source_to_target, target_to_source, search_direction::both})
    for (const bool reciprocal : {false, true})
      for (const double limit : {test::infinity<double>, 0.4}) {
        const correspondence_options options{
            .direction = direction, .max_distance = limit, .reciprocal = reciprocal};
        const nearest_neighbor_searcher searcher{source, target, options};
        nearest_neighbor_memory<S> memory;
        for (std::uint64_t seed = 3; seed < 7; ++seed) {
          auto field = some_field<T>(200, seed);
          // A point that a field sends nowhere is in no pair.
          if (seed == 4) field.shifts(0, 17) = test::nan<S>;
          const auto moved = moved_points(field, source);
          CHECK(moved.col(5) == source.col(5) + field.shifts.col(5));
          const auto expected = found_by(nearest_neighbor_searcher{moved, target, options}, still);
          CHECK(!expected.empty());
          CHECK(found_by(searcher, field) == expected);
          correspondences<S> remembered;
          searcher.find(field, memory, remembered);
          CHECK(remembered == expected);
          const auto by_features =
              found_by(feature_searcher{point_features{source, target}, options}, field);
          CHECK(std::ranges::equal(by_features, expected, {}, places_of, places_of));
        }
        CHECK(
            check_correspondence_searcher(searcher, source, target,
                                          std::vector{some_field<T>(200, 1), some_field<T>(200, 2)})
                .empty());
      }
  const correspondences<S> known{{0, 5, 0}, {4, 4, 0}, {9, 0, 0}};
  const auto field = some_field<T>(200, 8);
  const auto moved = moved_points(field, source);
  CHECK(found_by(known_pairs_searcher{source, target, known}, field) ==
        found_by(known_pairs_searcher{moved, target, known}, still));
}

TEST_CASE_TEMPLATE("what is remembered of fields and affine maps misleads no later search", T,
                   test::f2, test::d3, test::dx) {
  using S = typename T::scalar;
  const auto target = test::random_points<T>(500, 1), source = test::random_points<T>(400, 2);
  const auto field = some_field<T>(400, 3);
  const auto rigid = test::random_rigid<T>(4, 0.2, 0.1);
  const auto affine = test::random_affine<T>(5, 0.2, 0.1);
  using enum search_direction;
  for (const auto direction : {source_to_target, target_to_source, search_direction::both})
    for (const bool reciprocal : {false, true}) {
      const nearest_neighbor_searcher searcher{
          source, target, {.direction = direction, .reciprocal = reciprocal}};
      nearest_neighbor_memory<S> memory;
      correspondences<S> pairs;
      const auto check = [&](const auto& map) {
        searcher.find(map, memory, pairs);
        CHECK(pairs == found_by(searcher, map));
      };
      check(field);
      check(rigid);
      check(affine);
      check(rigid);
      check(field);
      check(affine);
    }
}

TEST_CASE("a point that is not finite is in no pair, wherever a map puts it") {
  struct anywhere {
    using Scalar = double;
    Eigen::Vector3d operator()(index_t i, const Eigen::Vector3d&) const {
      return Eigen::Vector3d::Constant(0.1 * double(i));
    }
  };
  const auto target = test::random_points<test::d3>(50, 1);
  auto source = test::random_points<test::d3>(20, 2);
  source(1, 4) = test::nan<double>;
  const Eigen::MatrixXd wide_target = target, wide_source = source;
  const auto check = [](const auto& pairs) {
    CHECK(pairs.size() == 19);
    CHECK(std::ranges::count(pairs, 4, [](const auto& p) { return p.source; }) == 0);
  };
  check(found_by(nearest_neighbor_searcher{source, target}, anywhere{}));
  check(found_by(nearest_neighbor_searcher{wide_source, wide_target}, anywhere{}));
  check(found_by(feature_searcher{point_features{source, target}}, anywhere{}));
  const nearest_neighbor_searcher backward{
      source, target, {.direction = search_direction::target_to_source}};
  CHECK(std::ranges::count(found_by(backward, anywhere{}), 4,
                           [](const auto& p) { return p.source; }) == 0);
}

TEST_CASE("a map of another dimension is refused, whatever types Eigen converts") {
  const Eigen::MatrixXd flat = Eigen::MatrixXd::Random(2, 30),
                        deep = Eigen::MatrixXd::Random(5, 30);
  CHECK_THROWS_AS((void)moved_points(wave{0.1}, flat), invalid_input);
  CHECK_THROWS_AS((void)moved_points(wave{0.1}, deep), invalid_input);
  const auto points = test::random_points<test::d3>(30, 1);
  const auto plane = identity_transform<rigid_transform<double, dynamic>>(2);
  CHECK_THROWS_AS((void)found_by(nearest_neighbor_searcher{points, points}, plane), invalid_input);
  CHECK(check_point_map(plane, points).size() == 1);
  CHECK_THROWS_AS((pair_matcher{point_to_point{}, plane, points, points}), invalid_input);
  CHECK(check_point_map(Eigen::Affine3d{Eigen::Scaling(1.0, 1.0, 0.0)}, points).size() == 1);
}

TEST_CASE_TEMPLATE("cameras and normals take part under a field", S, float, double) {
  using space = test::space<S, 3>;
  auto target = test::bumpy_surface<space>(300, 1), source = test::bumpy_surface<space>(200, 2);
  const auto field = some_field<space>(200, 3);
  auto moved = source;
  moved.points += field.shifts;
  const auto still = Eigen::Transform<S, 3, Eigen::Isometry>::Identity();
  pinhole_camera<S> camera{.width = 20, .height = 20, .fx = 10, .fy = 10, .cx = 10, .cy = 10};
  camera.to_world.translation().z() = -3;
  const auto seen = found_by(projective_searcher{source, target, camera}, field);
  CHECK(seen == found_by(projective_searcher{moved, target, camera}, still));
  CHECK(seen.size() > 20);
  const feature_weights weights{.normals = 0.5};
  CHECK(found_by(feature_searcher{joint_features{source, target, weights}}, field) ==
        found_by(feature_searcher{joint_features{moved, target, weights}}, still));
}

TEST_CASE("a field of other points, or without the normals that are asked for, is refused") {
  using space = test::d3;
  const auto target = test::bumpy_surface<space>(50, 1), source = test::bumpy_surface<space>(40, 2);
  const auto short_field = some_field<space>(39, 1);
  const pinhole_camera<double> camera{
      .width = 20, .height = 20, .fx = 10, .fy = 10, .cx = 10, .cy = 10};
  const auto refuses = [&](const auto& searcher, const auto& map) {
    CHECK_THROWS_AS((void)found_by(searcher, map), invalid_input);
  };
  refuses(nearest_neighbor_searcher{source, target}, short_field);
  refuses(known_pairs_searcher{source, target, correspondences<double>{}}, short_field);
  refuses(projective_searcher{source, target, camera}, short_field);
  refuses(feature_searcher{point_features{source, target}}, short_field);
  refuses(feature_searcher{joint_features{source, target, {.normals = 1}}}, wave{0.1});
  CHECK(found_by(feature_searcher{joint_features{source, target, {}}}, wave{0.1}).size() == 40);
  CHECK_THROWS_WITH_AS((void)moved_points(short_field, source),
                       "moved_points: the map moves 39 points, but there are 40", invalid_input);
}

TEST_CASE("a metric sees pairs under an affine map as the estimator does") {
  using space = test::d3;
  const auto target = test::bumpy_surface<space>(100, 1),
             source = test::bumpy_surface<space>(80, 2);
  const auto affine = test::random_affine<space>(3, 0.3, 0.3);
  const auto pairs = found_by(nearest_neighbor_searcher{source, target}, affine);
  const least_squares_estimator estimator{source, target, symmetric{}, affine_motion{}};
  const auto residuals = estimator.residuals(affine, pairs);
  const pair_matcher matcher{symmetric{}, affine, source, target};
  CHECK_THROWS_AS((void)matcher({80, 0, 0}), invalid_input);
  CHECK_THROWS_AS((pair_matcher{symmetric{}, affine, source.points, target}), invalid_input);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    weighted_rows(symmetric{}, matcher(pairs[i]), pairs[i].distance,
                  [&](double, double value, const auto&, const auto&) {
                    CHECK(value == doctest::Approx(residuals[index_t(i)]));
                  });
}

TEST_CASE("a field goes through the same searcher, metrics and loop as a transform") {
  using space = test::d3;
  const auto target = test::bumpy_surface<space>(2000, 1);
  auto source = test::bumpy_surface<space>(300, 2);
  for (index_t i = 0; i < 300; ++i) source.points(2, i) += 0.02 * std::sin(3 * source.points(0, i));
  const oriented_points_view<double, 3> moving{source}, onto{target};
  const nearest_neighbor_searcher searcher{source, target, {.max_distance = 0.5}};
  const auto check = [&](const auto& metric) {
    const auto found =
        icp(searcher, field_estimator<std::decay_t<decltype(metric)>>{moving, onto, metric},
            shift_field<double, 3>{Eigen::Matrix3Xd::Zero(3, 300)},
            {.max_iterations = 60, .tolerance = 1e-7});
    CHECK(found.converged());
    CHECK(found.undetermined == 0);
    CHECK(found.information.size() == 0);
    correspondences<double> pairs;
    searcher.find(found.transform, pairs);
    CHECK(pairs.size() == 300);
    for (const auto& pair : pairs)
      weighted_rows(
          metric, pair_matcher{metric, found.transform, moving, onto}(pair), pair.distance,
          [](double, double value, const auto&, const auto&) { CHECK(std::abs(value) < 1e-6); });
  };
  check(point_to_point{});
  check(generalized_icp{});
  check(combined_metric{weighted_term{point_to_plane{}, 1, unit_weight{}, huber{0.01}},
                        weighted_term{point_to_point{}, 0.1}});
}

TEST_CASE("what no pair reaches is counted, and does not keep a field from converging") {
  using space = test::d3;
  const auto target = test::bumpy_surface<space>(300, 1);
  auto source = target;
  source.points.leftCols(30).array() += 50;
  const nearest_neighbor_searcher searcher{source, target, {.max_distance = 1}};
  const field_estimator<point_to_point> estimator{
      oriented_points_view<double, 3>{source}, oriented_points_view<double, 3>{target}, {}};
  const shift_field<double, 3> start{Eigen::Matrix3Xd::Zero(3, 300)};
  const auto found = icp(searcher, estimator, start);
  CHECK(found.converged());
  CHECK(found.undetermined == 90);
  CHECK(found.undetermined_share() == 0.1);
  CHECK(icp(searcher, estimator, start, {.max_undetermined = 0.05}).status ==
        icp_status::degenerate);
  CHECK(icp(searcher, estimator, start, {.max_undetermined = 0.1}).converged());
  CHECK_THROWS_AS((void)icp(searcher, estimator, start, {.max_undetermined = 2}), invalid_input);
  // A few directions of a rigid motion are a few too many, and so they are of whatever has no size.
  CHECK(icp_options<Eigen::Isometry3d>{}.max_undetermined == 0);
  CHECK(icp_options<wave>{}.max_undetermined == 0);
}

TEST_CASE("the contract of estimators looks at fields, too") {
  using space = test::d3;
  const auto target = test::bumpy_surface<space>(50, 1), source = test::bumpy_surface<space>(40, 2);
  const field_estimator<point_to_point> estimator{
      oriented_points_view<double, 3>{source}, oriented_points_view<double, 3>{target}, {}};
  const auto field = some_field<space>(40, 3);
  const auto pairs = found_by(nearest_neighbor_searcher{source, target}, field);
  CHECK(check_transform_estimator(estimator, field, pairs).empty());
  struct restless : field_estimator<point_to_point> {
    [[nodiscard]] registration_step<transform_type> estimate(
        const transform_type& current, std::span<const correspondence<double>> given) const {
      auto step = field_estimator::estimate(current, given);
      step.transform.shifts(0, 0) += 1;
      return step;
    }
  };
  CHECK(check_transform_estimator(restless{estimator}, field, pairs) ==
        std::vector<std::string>{"without pairs, the transform changes"});
}

TEST_CASE_TEMPLATE("the contract finds a map that turns normals the wrong way", S, float, double) {
  using space = test::space<S, 3>;
  struct rotations {
    using Scalar = S;
    bool is_wrong = false;
    [[nodiscard]] Eigen::Matrix<S, 3, 3> rotation(index_t i) const {
      return Eigen::AngleAxis<S>{S(0.01) * S(i), Eigen::Matrix<S, 3, 1>{1, 2, 2} / 3}
          .toRotationMatrix();
    }
    Eigen::Matrix<S, 3, 1> operator()(index_t i, const Eigen::Matrix<S, 3, 1>& p) const {
      return rotation(i) * p;
    }
    [[nodiscard]] Eigen::Matrix<S, 3, 1> normal(index_t i, const Eigen::Matrix<S, 3, 1>& n) const {
      if (is_wrong) return rotation(i).transpose() * n;
      return rotation(i) * n;
    }
  };
  const auto points = test::random_points<space>(100, 1);
  CHECK(check_point_map(rotations{}, points).empty());
  CHECK(!check_point_map(rotations{true}, points).empty());
  CHECK(check_point_map(test::random_affine<space>(1, 0.3, 0.3), points).empty());
  CHECK(check_point_map(some_field<space>(100, 1), points).empty());
  CHECK(!check_point_map(some_field<space>(99, 1), points).empty());
}
