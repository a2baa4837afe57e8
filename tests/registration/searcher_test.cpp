// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// All distances, in the way that is obviously right.
template <class T, class Transform>
Eigen::MatrixXd distances_between(const auto& target, const auto& source,
                                  const Transform& transform) {
  const auto moved = transform_points(transform, source);
  Eigen::MatrixXd all(target.cols(), source.cols());
  for (index_t t = 0; t < target.cols(); ++t)
    for (index_t s = 0; s < source.cols(); ++s) {
      all(t, s) = double((moved.col(s) - target.col(t)).norm());
      if (!std::isfinite(all(t, s))) all(t, s) = test::infinity<double>;
    }
  return all;
}

using index_pairs = std::vector<std::pair<index_t, index_t>>;  ///< Source, target.

index_pairs nearest_targets(const Eigen::MatrixXd& distances) {
  index_pairs pairs;
  for (index_t s = 0; s < distances.cols(); ++s) {
    index_t t = 0;
    if (distances.col(s).minCoeff(&t) < test::infinity<double>) pairs.emplace_back(s, t);
  }
  return pairs;
}
index_pairs nearest_sources(const Eigen::MatrixXd& distances) {
  index_pairs pairs;
  for (const auto& [t, s] : nearest_targets(distances.transpose())) pairs.emplace_back(s, t);
  std::ranges::sort(pairs);
  return pairs;
}

index_pairs indices_of(const auto& pairs) {
  index_pairs indices;
  for (const auto& p : pairs) indices.emplace_back(p.source, p.target);
  return indices;
}

index_pairs closer_than(const index_pairs& pairs, const Eigen::MatrixXd& distances, double limit) {
  index_pairs kept;
  for (const auto& [s, t] : pairs)
    if (distances(t, s) <= limit) kept.emplace_back(s, t);
  return kept;
}

template <class Searcher, class Transform>
auto found_by(const Searcher& searcher, const Transform& transform) {
  pairs_of<Searcher, Transform> pairs;
  searcher.find(transform, pairs);
  return pairs;
}

}  // namespace

TEST_CASE_TEMPLATE("each direction finds what comparing all points finds", T, test::f2, test::f3,
                   test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  using S = typename T::scalar;
  auto target = test::random_points<T>(120, 1), source = test::random_points<T>(80, 2);
  target(0, 7) = test::nan<S>;
  source(1, 3) = test::infinity<S>;
  const auto check = [&](const auto& transform) {
    const auto all = distances_between<T>(target, source, transform);
    const auto forward = nearest_targets(all), backward = nearest_sources(all);
    index_pairs either, agreed;
    std::ranges::set_union(forward, backward, std::back_inserter(either));
    std::ranges::set_intersection(forward, backward, std::back_inserter(agreed));
    for (const double limit : {test::infinity<double>, 0.4}) {
      using enum search_direction;
      for (const auto& [direction, expected] : {std::pair{source_to_target, forward},
                                                {target_to_source, backward},
                                                {search_direction::both, either}}) {
        const nearest_neighbor_searcher searcher{
            source, target, {.direction = direction, .max_distance = limit}};
        CHECK(indices_of(found_by(searcher, transform)) == closer_than(expected, all, limit));
        const nearest_neighbor_searcher reciprocal{
            source, target, {.direction = direction, .max_distance = limit, .reciprocal = true}};
        const auto found = found_by(reciprocal, transform);
        CHECK(indices_of(found) == closer_than(agreed, all, limit));
        for (const auto& p : found)
          CHECK(double(p.distance) == doctest::Approx(all(p.target, p.source)).epsilon(1e-5));
        // The points themselves as features are the same search.
        const feature_searcher by_features{point_features{source, target},
                                           {.direction = direction, .max_distance = limit}};
        CHECK(indices_of(found_by(by_features, transform)) == closer_than(expected, all, limit));
        CHECK(check_correspondence_searcher(searcher, source, target, std::vector{transform})
                  .empty());
      }
    }
  };
  check(test::random_rigid<T>(5, 0.5, 0.3));
  check(test::random_affine<T>(6, 0.3, 0.3));
}

TEST_CASE_TEMPLATE("what a search remembers changes nothing but the time", T, test::f2, test::f3,
                   test::fx, test::d3, test::d5) {
  using S = typename T::scalar;
  const auto target = test::random_points<T>(400, 1);
  auto source = test::random_points<T>(300, 2);
  source.leftCols(20) = target.leftCols(20);        // Exactly on a point,
  source.middleCols(20, 20) = target.leftCols(20);  // and with ties.
  std::vector<test::rigid_of<T>> steps{identity_transform<test::rigid_of<T>>(T::dimension)};
  // Ever smaller steps, as a registration makes them, and then a large one.
  for (int i = 0; i < 12; ++i)
    steps.push_back(
        test::random_rigid<T>(std::uint64_t(i), 0.3 * std::pow(0.4, i), 0.3 * std::pow(0.4, i)) *
        steps.back());
  steps.push_back(test::random_rigid<T>(99, 1, 1));
  steps.push_back(steps.back());
  for (const double limit : {test::infinity<double>, 0.1, 0.0})
    for (const bool reciprocal : {false, true})
      for (const auto direction : {search_direction::source_to_target, search_direction::both}) {
        const nearest_neighbor_searcher searcher{
            source,
            target,
            {.direction = direction, .max_distance = limit, .reciprocal = reciprocal}};
        CHECK(check_correspondence_searcher(searcher, source, target, steps).empty());
      }
  // A memory that another searcher has filled is not believed.
  const nearest_neighbor_searcher one{source, target}, other{source, target};
  nearest_neighbor_memory<S> memory;
  correspondences<S> pairs;
  other.find(steps[0], memory, pairs);
  one.find(steps[0], memory, pairs);
  CHECK(pairs == found_by(one, steps[0]));
}

TEST_CASE("the rules of selection apply in their order: distance, reciprocity, one to one, share") {
  // On a line: four targets, and sources around them.
  const Eigen::Matrix2Xf target{{0, 1, 2, 10}, {0, 0, 0, 0}};
  const Eigen::Matrix2Xf source{{0.1f, 0.3f, 0.9f, 1.2f, 2.4f, 6.5f}, {0, 0, 0, 0, 0, 0}};
  const auto identity = Eigen::Isometry2f::Identity();
  const auto found = [&](const correspondence_options& options) {
    return indices_of(found_by(nearest_neighbor_searcher{source, target, options}, identity));
  };
  CHECK(found({}) == index_pairs{{0, 0}, {1, 0}, {2, 1}, {3, 1}, {4, 2}, {5, 3}});
  CHECK(found({.max_distance = 0.45}) == index_pairs{{0, 0}, {1, 0}, {2, 1}, {3, 1}, {4, 2}});
  CHECK(found({.one_to_one = sides::source}) == found({}));
  CHECK(found({.one_to_one = sides::target}) == index_pairs{{0, 0}, {2, 1}, {4, 2}, {5, 3}});
  CHECK(found({.one_to_one = sides::both}) == index_pairs{{0, 0}, {2, 1}, {4, 2}, {5, 3}});
  CHECK(found({.reciprocal = true}) == index_pairs{{0, 0}, {2, 1}, {4, 2}, {5, 3}});
  // Half of the six pairs; half of the four that are left once they are one to one.
  CHECK(found({.fraction = 0.5}) == index_pairs{{0, 0}, {2, 1}, {3, 1}});
  CHECK(found({.one_to_one = sides::target, .fraction = 0.5}) == index_pairs{{0, 0}, {2, 1}});
  CHECK(found({.max_distance = 0.2, .one_to_one = sides::target, .fraction = 0.5}) ==
        index_pairs{{0, 0}});
}

// In the first cilantro, one-to-one did nothing when both directions were searched.
TEST_CASE_TEMPLATE("one to one means what it says in every direction", S, float, double) {
  using space = test::space<S, 3>;
  const auto target = test::random_points<space>(60, 3),
             source = test::random_points<space>(200, 4);
  const auto identity = rigid_transform<S, 3>::Identity();
  using enum search_direction;
  for (const auto direction : {source_to_target, target_to_source, search_direction::both})
    for (const auto side : {sides::source, sides::target, sides::both}) {
      const auto pairs = found_by(
          nearest_neighbor_searcher{source, target, {.direction = direction, .one_to_one = side}},
          identity);
      CHECK(!pairs.empty());
      std::vector<int> sources(200), targets(60);
      for (const auto& p : pairs) {
        ++sources[std::size_t(p.source)];
        ++targets[std::size_t(p.target)];
      }
      if (side != sides::target) CHECK(*std::ranges::max_element(sources) == 1);
      if (side != sides::source) CHECK(*std::ranges::max_element(targets) == 1);
      // No two points that are left over would be a pair of the search.
      if (side == sides::both)
        for (const auto& p : found_by(
                 nearest_neighbor_searcher{source, target, {.direction = direction}}, identity))
          CHECK((sources[std::size_t(p.source)] == 1 || targets[std::size_t(p.target)] == 1));
    }
}

TEST_CASE("a threshold is a distance, not its square, and what lies exactly on it belongs") {
  const Eigen::Matrix2Xd target = Eigen::Vector2d{0, 0}, source = Eigen::Vector2d{0, 0.5};
  const auto count = [&](double limit) {
    return found_by(nearest_neighbor_searcher{source, target, {.max_distance = limit}},
                    Eigen::Isometry2d::Identity())
        .size();
  };
  CHECK(count(0.5) == 1);
  CHECK(count(0.49) == 0);
  CHECK(count(0.3) == 0);  // Its square root would be enough.
}

TEST_CASE("points that are nowhere near, or not there, are no pairs and no error") {
  const Eigen::Matrix3Xf target = test::random_points<test::f3>(10), none(3, 0);
  const Eigen::Matrix3Xf far = target.array() + 100;
  const Eigen::Matrix3Xf unknown = Eigen::Matrix3Xf::Constant(3, 4, test::nan<float>);
  const auto identity = Eigen::Isometry3f::Identity();
  for (const auto direction : {search_direction::source_to_target,
                               search_direction::target_to_source, search_direction::both}) {
    const correspondence_options options{.direction = direction, .max_distance = 1};
    CHECK(found_by(nearest_neighbor_searcher{far, target, options}, identity).empty());
    CHECK(found_by(nearest_neighbor_searcher{none, target, options}, identity).empty());
    CHECK(found_by(nearest_neighbor_searcher{target, none, options}, identity).empty());
    CHECK(found_by(nearest_neighbor_searcher{none, none, options}, identity).empty());
    CHECK(found_by(nearest_neighbor_searcher{unknown, target, options}, identity).empty());
    CHECK(found_by(nearest_neighbor_searcher{target, unknown, options}, identity).empty());
    CHECK(found_by(feature_searcher{point_features{far, target}, options}, identity).empty());
    CHECK(found_by(feature_searcher{point_features{far, none}, options}, identity).empty());
    CHECK(found_by(feature_searcher{point_features{unknown, target}, options}, identity).empty());
  }
}

TEST_CASE("a search that makes no sense is refused") {
  const auto points = test::random_points<test::f3>(10);
  const Eigen::MatrixXf flat = Eigen::MatrixXf::Zero(2, 5), deep = Eigen::MatrixXf::Zero(3, 5);
  using searcher = nearest_neighbor_searcher<float, 3>;
  CHECK_THROWS_AS((searcher{points, points, {.max_distance = -1}}), invalid_input);
  CHECK_THROWS_AS((searcher{points, points, {.max_distance = test::nan<double>}}), invalid_input);
  CHECK_THROWS_AS((searcher{points, points, {.fraction = 0}}), invalid_input);
  CHECK_THROWS_AS((searcher{points, points, {.fraction = 1.5}}), invalid_input);
  CHECK_THROWS_AS((nearest_neighbor_searcher{deep, flat}), invalid_input);
  CHECK_THROWS_AS((point_features{deep, flat}), invalid_input);
  CHECK_THROWS_AS((known_pairs_searcher{points, points, {{10, 0, 0}}}), invalid_input);
  CHECK_THROWS_AS((known_pairs_searcher{points, points, {{0, -1, 0}}}), invalid_input);
  const nearest_neighbor_searcher run_time{deep, deep};
  correspondences<float> pairs;
  CHECK_THROWS_AS(run_time.find(Eigen::Isometry2f::Identity(), pairs), invalid_input);
  const pinhole_camera<float> camera{4, 4, 1, 1, 2, 2};
  CHECK_THROWS_AS((projective_searcher{points, points, camera, {.reciprocal = true}}),
                  invalid_input);
}

TEST_CASE_TEMPLATE("known pairs are measured anew for every transform", T, test::f3, test::d5,
                   test::dx) {
  using S = typename T::scalar;
  const auto target = test::random_points<T>(50, 1);
  auto source = test::random_points<T>(50, 2);
  source(0, 9) = test::nan<S>;
  // Given in disorder.
  auto known = test::same_indices<S>(50);
  std::ranges::reverse(known);
  const known_pairs_searcher searcher{source, target, known, {.max_distance = 1.2}};
  const auto transform = test::random_rigid<T>(1, 0.4, 0.4);
  const auto all = distances_between<T>(target, source, transform);
  const auto pairs = found_by(searcher, transform);
  index_t expected = 0;
  for (index_t i = 0; i < 50; ++i) expected += all(i, i) <= 1.2;
  CHECK(std::ssize(pairs) == expected);
  for (const auto& p : pairs) {
    CHECK(p.source == p.target);
    CHECK(double(p.distance) == doctest::Approx(all(p.target, p.source)).epsilon(1e-5));
  }
  CHECK(check_correspondence_searcher(searcher, source, target, std::vector{transform}).empty());
}

TEST_CASE_TEMPLATE("features of normals and colours find what comparing all of them finds", S,
                   float, double) {
  using space = test::space<S, 3>;
  auto target = test::bumpy_surface<space>(150, 1), source = test::bumpy_surface<space>(100, 2);
  target.colors = test::random_points<test::f3>(150, 3, 0, 1);
  source.colors = test::random_points<test::f3>(100, 4, 0, 1);
  const auto check = [&](const auto& transform, const feature_weights& weights) {
    const auto moved = cilantro::transform(source, transform);
    const auto squared = [&](index_t t, index_t s) {
      double sum = double((moved.points.col(s) - target.points.col(t)).squaredNorm());
      sum += weights.normals * weights.normals *
             double((moved.normals.col(s) - target.normals.col(t)).squaredNorm());
      return sum + weights.colors * weights.colors *
                       double((source.colors.col(s) - target.colors.col(t)).squaredNorm());
    };
    const joint_features space_of_both{source, target, weights};
    CHECK(check_feature_space(space_of_both, transform).empty());
    const auto pairs = found_by(feature_searcher{space_of_both}, transform);
    REQUIRE(pairs.size() == 100);
    for (index_t s = 0; s < 100; ++s) {
      double least = test::infinity<double>;
      for (index_t t = 0; t < 150; ++t) least = std::min(least, squared(t, s));
      CHECK(double(pairs[std::size_t(s)].distance) ==
            doctest::Approx(std::sqrt(least)).epsilon(1e-4));
      CHECK(squared(pairs[std::size_t(s)].target, s) == doctest::Approx(least).epsilon(1e-4));
    }
  };
  const auto rigid = test::random_rigid<space>(1, 0.5, 0.2);
  const auto affine = test::random_affine<space>(2, 0.2, 0.2);
  for (const auto& weights :
       {feature_weights{}, {.normals = 0.5}, {.colors = 2}, {.normals = 1, .colors = 0.3}}) {
    check(rigid, weights);
    check(affine, weights);
  }
  const oriented_points_view<S, 3> plain_source{source}, plain_target{target};
  CHECK(found_by(feature_searcher{joint_features{plain_source, plain_target, {.normals = 1}}},
                 rigid) ==
        found_by(feature_searcher{joint_features{source, target, {.normals = 1}}}, rigid));
  CHECK_THROWS_AS((joint_features{plain_source, plain_target, {.colors = 1}}), invalid_input);
  source.normals.resize(3, 0);
  CHECK_THROWS_AS((joint_features{source, target, {.normals = 1}}), invalid_input);
  CHECK_THROWS_AS((joint_features{source, target, {.colors = -1}}), invalid_input);
}

TEST_CASE_TEMPLATE("clouds with different origins have no pairs", S, float, double) {
  using space = test::space<S, 3>;
  const auto target = test::bumpy_surface<space>(50, 1);
  auto source = test::bumpy_surface<space>(50, 2);
  source.origin = Eigen::Vector3d{100, 0, 0};
  const pinhole_camera<S> camera{.width = 4, .height = 4, .fx = 2, .fy = 2, .cx = 2, .cy = 2};
  CHECK_THROWS_AS((nearest_neighbor_searcher{source, target}), invalid_input);
  CHECK_THROWS_AS((known_pairs_searcher{source, target, correspondences<S>{}}), invalid_input);
  CHECK_THROWS_AS((projective_searcher{source, target, camera}), invalid_input);
  CHECK_THROWS_AS((point_features{source, target}), invalid_input);
  CHECK_THROWS_AS((joint_features{source, target, {}}), invalid_input);
}

TEST_CASE("another judge decides which pairs of a search are accepted, and at which distance") {
  using space = test::d3;
  const auto target = test::bumpy_surface<space>(300, 1),
             source = test::bumpy_surface<space>(200, 2);
  const auto identity = Eigen::Isometry3d::Identity();
  const point_features places{source.points, target.points};
  // Nearest in space, accepted by the angle between the normals.
  const auto angle = [&](index_t s, index_t t, double) {
    return angle_between(target.normals.col(t), source.normals.col(s));
  };
  const feature_searcher by_angle{places, {.max_distance = 0.1}, angle};
  const auto pairs = found_by(by_angle, identity);
  const auto all = found_by(feature_searcher{places}, identity);
  CHECK(!pairs.empty());
  CHECK(pairs.size() < all.size());
  for (const auto& p : pairs) CHECK(p.distance <= 0.1);
  CHECK(std::ranges::count_if(all, [&](const auto& p) {
          return angle(p.source, p.target, 0) <= 0.1;
        }) == std::ssize(pairs));
  // Nearest with normals, accepted in space.
  const feature_searcher by_place{
      joint_features{source, target, {.normals = 5}}, {.max_distance = 0.2}, places};
  for (const auto& p : found_by(by_place, identity))
    CHECK(p.distance == (target.points.col(p.target) - source.points.col(p.source)).norm());
}

TEST_CASE_TEMPLATE("a camera pairs each point with what it sees in the same pixel", S, float,
                   double) {
  // A slope before a camera, seen from two places; the target is organised.
  pinhole_camera<S> camera{40, 30, 40, 40, S(19.5), S(14.5)};
  camera.to_world.translation() << S(0.2), S(-0.1), S(0.3);
  image<S> depth(40, 30);
  for (int v = 0; v < 30; ++v)
    for (int u = 0; u < 40; ++u) depth(u, v) = v == 3 ? S(0) : S(2) + S(u) / 40;
  const auto target = unproject(depth, camera);
  const auto source = test::random_points<test::space<S, 3>>(3000, 1, -1.5, 3.5);
  const auto transform = test::random_rigid<test::space<S, 3>>(2, 0.1, 0.1);
  const projective_searcher searcher{source, target, camera, {.max_distance = 0.5}};
  const auto pairs = found_by(searcher, transform);
  CHECK(check_correspondence_searcher(searcher, source, target, std::vector{transform}).empty());
  const auto moved = transform_points(transform, source);
  std::size_t expected = 0;
  for (index_t s = 0; s < 3000; ++s) {
    const auto p = (camera.to_world.inverse() * moved.col(s)).eval();
    const int u = int(std::round(camera.fx * p.x() / p.z() + camera.cx));
    const int v = int(std::round(camera.fy * p.y() / p.z() + camera.cy));
    if (p.z() <= 0 || u < 0 || u >= 40 || v < 0 || v >= 30) continue;
    const index_t t = v * 40 + u;
    if (!((target.col(t) - moved.col(s)).norm() <= S(0.5))) continue;
    REQUIRE(expected < pairs.size());
    CHECK(pairs[expected].source == s);
    CHECK(pairs[expected++].target == t);
  }
  CHECK(expected == pairs.size());
  CHECK(expected > 20);
}

TEST_CASE("a combined searcher yields the pairs of each of its searchers") {
  const auto target = test::random_points<test::d3>(100, 1),
             source = test::random_points<test::d3>(80, 2);
  const nearest_neighbor_searcher near{source, target, {.max_distance = 0.2}};
  const known_pairs_searcher known{source, target, {{3, 4, 0}}};
  const combined_searcher both{near, known};
  const auto transform = test::random_rigid<test::d3>(1, 0.1, 0.1);
  const auto pairs = found_by(both, transform);
  CHECK(pairs[0] == found_by(near, transform));
  CHECK(pairs[1] == found_by(known, transform));
  CHECK(check_correspondence_searcher(both, source, target, std::vector{transform}).empty());
}

TEST_CASE("the same pairs for any number of threads") {
  const auto target = test::random_points<test::f3>(3000, 1),
             source = test::random_points<test::f3>(2500, 2);
  const auto transform = test::random_rigid<test::f3>(1, 0.1, 0.1);
  for (const auto direction : {search_direction::source_to_target, search_direction::both}) {
    correspondence_options options{.direction = direction, .threads = 1};
    const auto one = found_by(nearest_neighbor_searcher{source, target, options}, transform);
    for (const int threads : {2, 5}) {
      options.threads = threads;
      CHECK(one == found_by(nearest_neighbor_searcher{source, target, options}, transform));
    }
  }
}

TEST_CASE_TEMPLATE("at a distance of 0 only equal points are pairs", T, test::f2, test::f3,
                   test::d3, test::dx) {
  using S = typename T::scalar;
  const auto a = test::random_points<T>(1000, 1), b = test::random_points<T>(1000, 2);
  const auto here = identity_transform<test::rigid_of<T>>(T::dimension);
  // The square of the second is 0.
  for (const double limit : {0.0, sizeof(S) == 4 ? 1e-30 : 1e-300}) {
    const auto self = evaluate(a, a, here, {.metric = point_to_point{}, .max_distance = limit});
    CHECK(self.pairs == 1000);
    CHECK(self.rmse == 0);
    const auto apart = evaluate(a, b, here, {.metric = point_to_point{}, .max_distance = limit});
    CHECK(apart.pairs == 0);
  }
}
