// SPDX-License-Identifier: MIT
//
// From pairs of which most are wrong: right, to the noise, and sure of it only where it may be.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <sstream>
#include <stop_token>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// Points in a unit cube, and the same moved, with noise; the partners of all but `right` of them
/// are somewhere else in the cube.
template <class Space>
struct pair_problem {
  using S = typename Space::scalar;
  static constexpr int D = Space::static_dimension;

  point_matrix<S, D> source, target;
  correspondences<S> pairs;
  Eigen::MatrixXd linear;
  Eigen::VectorXd translation;

  pair_problem(index_t count, index_t right, double noise, std::uint64_t seed, double scale = 1) {
    constexpr index_t d = Space::dimension;
    random_stream random{seed, 17};
    Eigen::MatrixXd any(d, d);
    for (auto& x : any.reshaped()) x = random.normal();
    linear = scale * nearest_rotation(any);
    translation.resize(d);
    for (auto& x : translation) x = random.uniform(-5, 5);
    const auto place = [&] {
      Eigen::VectorXd p(d);
      for (auto& x : p) x = random.uniform(0, 1);
      return p;
    };
    source.resize(d, count);
    target.resize(d, count);
    for (index_t i = 0; i < count; ++i) {
      const Eigen::VectorXd p = place();
      Eigen::VectorXd q = linear * (is_right(i, count, right) ? p : place()) + translation;
      if (is_right(i, count, right))
        for (auto& x : q) x += noise * random.normal();
      source.col(i) = p.template cast<S>();
      target.col(i) = q.template cast<S>();
      pairs.push_back({std::int32_t(i), std::int32_t(i), S(0)});
    }
  }

  /// Right pairs are spread evenly among all.
  static bool is_right(index_t i, index_t count, index_t right) {
    return (i * right) / count != ((i + 1) * right) / count;
  }
  template <class T>
  [[nodiscard]] double error(const T& found) const {
    return (found.linear().template cast<double>() - linear).norm() +
           (found.translation().template cast<double>() - translation).norm();
  }
};

template <class S>
correspondences<S> reversed(correspondences<S> pairs) {
  std::ranges::reverse(pairs);
  return pairs;
}

}  // namespace

TEST_CASE("50 right pairs of 5,000 are found over a hundred seeds, exact to the noise") {
  double worst = 0;
#if __has_feature(address_sanitizer)
  constexpr std::uint64_t seeds = 5;
#else
  constexpr std::uint64_t seeds = 100;
#endif
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const pair_problem<test::d3> problem{5000, 50, 0.01, seed};
    const auto found =
        align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.03});
    CHECK(found.status == global_status::unique);
    CHECK(found.matches == 5000);
    CHECK(found.inliers.size() >= 25);
    CHECK(found.undetermined == 0);
    CHECK(found.information.rows() == 6);
    worst = std::max(worst, problem.error(found.transform));
  }
  MESSAGE("largest error: " << worst);
  CHECK(worst < 0.04);
}

TEST_CASE_TEMPLATE("99.5, 95 and 0 per cent of wrong pairs, in two and three dimensions", Space,
                   test::f3, test::d3, test::f2, test::d2) {
  const bool is_flat = Space::dimension == 2;
  for (const auto& [count, right] :
       {std::pair{5000, is_flat ? 50 : 25}, {1000, 50}, {5000, 5000}, {30, 30}}) {
    const pair_problem<Space> problem{count, right, 0.01, 3};
    const auto found =
        align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.03});
    CAPTURE(count);
    CAPTURE(right);
    CHECK(found.is_unique());
    CHECK(problem.error(found.transform) < 0.06);
    CHECK(index_t(found.inliers.size()) > right / 2);
    CHECK(found.overlap > 0);
  }
}

TEST_CASE("chance alone is never a success, and makes up no transform") {
  int made_up = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed)
    for (const index_t count : {20, 300, 1000}) {
      const pair_problem<test::d3> problem{count, 0, 0.01, seed};
      const auto found =
          align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.03});
      made_up += found.status != global_status::too_few;
      if (found.status != global_status::too_few) continue;
      CHECK(found.transform.matrix().isIdentity(0));
      CHECK(found.inliers.empty());
      CHECK(found.alternatives.empty());
    }
  CHECK(made_up == 0);
}

TEST_CASE("no pairs, one, equal ones, and all to one point are too few") {
  const Eigen::Matrix3Xd points = test::random_points<test::d3>(50);
  const auto status = [&](const correspondences<double>& pairs) {
    return align_globally(points, points, pairs, {.max_distance = 0.1}).status;
  };
  CHECK(status({}) == global_status::too_few);
  CHECK(status({{0, 0, 0}}) == global_status::too_few);
  CHECK(status(correspondences<double>(40, {3, 5, 0})) == global_status::too_few);
  correspondences<double> to_one;
  for (std::int32_t i = 0; i < 50; ++i) to_one.push_back({i, 7, 0});
  CHECK(status(to_one) == global_status::too_few);
  const Eigen::Matrix3Xd none(3, 0);
  CHECK(align_globally(none, none, correspondences<double>{}, {.max_distance = 0.1}).status ==
        global_status::too_few);
}

TEST_CASE("two equally good answers are both returned, and called ambiguous") {
  // Half of the pairs were moved in one way, half in another.
  const pair_problem<test::d3> one{200, 200, 0.005, 1};
  pair_problem<test::d3> both{200, 200, 0.005, 2};
  for (index_t i = 0; i < 200; i += 2) {
    both.source.col(i) = one.source.col(i);
    both.target.col(i) = one.target.col(i);
  }
  const auto found = align_globally(both.source, both.target, both.pairs, {.max_distance = 0.02});
  CHECK(found.status == global_status::ambiguous);
  REQUIRE(found.alternatives.size() == 1);
  const auto& other = found.alternatives[0].transform;
  CHECK(std::min(one.error(found.transform), one.error(other)) < 0.03);
  CHECK(std::min(both.error(found.transform), both.error(other)) < 0.03);
}

TEST_CASE("a patch that is matched wrongly as a whole is no proof") {
  // Wrong pairs next to one another agree, as those of a wall do.
  pair_problem<test::d3> problem{300, 0, 0, 3};
  random_stream random{5};
  for (index_t i = 0; i < 30; ++i) {
    const Eigen::Vector3d p{0.5 + random.uniform(0, 0.12), 0.5 + random.uniform(0, 0.12), 0.5};
    problem.source.col(i) = p;
    problem.target.col(i) =
        problem.linear * (p + Eigen::Vector3d{0.1, -0.2, 0.1}) + problem.translation;
  }
  const auto found =
      align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.03});
  CHECK(found.status == global_status::ambiguous);
  CHECK(found.inliers.size() >= 30);
}

TEST_CASE("points on a plane fix the transform, and a mirror image never wins") {
  pair_problem<test::d3> problem{300, 300, 0, 5};
  for (index_t i = 0; i < 300; ++i) {
    problem.source(2, i) = 0;
    problem.target.col(i) = problem.linear * problem.source.col(i) + problem.translation;
  }
  const auto found =
      align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.02});
  CHECK(found.is_unique());
  CHECK(problem.error(found.transform) < 1e-9);

  // A mirrored set has no rigid transform.
  Eigen::Matrix3Xd mirrored = test::random_points<test::d3>(300);
  Eigen::Matrix3Xd original = mirrored;
  mirrored.row(0) *= -1;
  const auto none = align_globally(original, mirrored, problem.pairs, {.max_distance = 0.02});
  CHECK(none.transform.linear().determinant() > 0);
  CHECK(!none.is_unique());
}

TEST_CASE("pairs on a line leave the rotation about it open, which is said") {
  pair_problem<test::d3> problem{200, 200, 0, 6};
  for (index_t i = 0; i < 200; ++i) {
    problem.source.col(i) << double(i) / 200, 0, 0;
    problem.target.col(i) = problem.linear * problem.source.col(i) + problem.translation;
  }
  const auto found =
      align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.02});
  CHECK(found.status == global_status::degenerate);
  // Where the pairs say something, it is right.
  for (index_t i = 0; i < 200; ++i)
    CHECK(
        (found.transform * Eigen::Vector3d{problem.source.col(i)} - problem.target.col(i)).norm() <
        1e-6);
}

TEST_CASE_TEMPLATE("a scale is found, too", Space, test::f3, test::d3, test::d2) {
  for (const double scale : {0.55, 1.0, 1.9}) {
    const pair_problem<Space> problem{500, 60, 0.005, 4, scale};
    const auto found =
        align_globally<similarity_motion>(problem.source, problem.target, problem.pairs,
                                          {.max_distance = 0.015, .scales = scale_range{0.5, 2}});
    CHECK(found.is_unique());
    CHECK(problem.error(found.transform) < 0.04);
    CHECK(found.unknowns == similarity_motion::unknowns(Space::dimension));
  }
  const pair_problem<Space> problem{500, 60, 0.005, 4, 3};
  CHECK(align_globally<similarity_motion>(problem.source, problem.target, problem.pairs,
                                          {.max_distance = 0.015, .scales = scale_range{0.5, 2}})
            .status == global_status::too_few);
}

TEST_CASE("a known vertical is kept, and lets fewer pairs suffice") {
  pair_problem<test::d3> problem{2000, 25, 0.01, 7};
  const Eigen::Matrix3d turn = Eigen::AngleAxisd{2.5, Eigen::Vector3d::UnitZ()}.toRotationMatrix();
  for (index_t i = 0; i < 2000; ++i)
    problem.target.col(i) =
        turn * problem.linear.transpose() * (problem.target.col(i) - problem.translation);
  const auto found = align_globally(problem.source, problem.target, problem.pairs,
                                    {.max_distance = 0.03, .up = coordinates{0, 0, 2}});
  CHECK(found.is_unique());
  CHECK((found.transform.linear() - turn).norm() < 0.03);
  CHECK(found.transform.linear().col(2).isApprox(Eigen::Vector3d::UnitZ(), 1e-12));

  // What is turned over cannot keep its vertical.
  for (index_t i = 0; i < 2000; ++i) problem.target.col(i)[2] *= -1;
  for (index_t i = 0; i < 2000; ++i) problem.target.col(i)[1] *= -1;
  CHECK(!align_globally(problem.source, problem.target, problem.pairs,
                        {.max_distance = 0.03, .up = coordinates{0, 0, 1}})
             .is_unique());
}

TEST_CASE("solvers of every kind find the transform, in the same words") {
  const pair_problem<test::d3> problem{400, 200, 0.01, 8};
  struct {
    const char* name;
    any_pair_solver solver;
  } const all[] = {{"graph", pair_graph<>{}},
                   {"lengths", pair_graph{equal_lengths{}}},
                   {"a lambda", pair_graph{[](const auto& a, const auto& b, const auto& pairs) {
                      return std::abs((a.source - b.source).norm() - (a.target - b.target).norm()) <
                             pairs.max_distance;
                    }}},
                   {"samples", sampled_pairs{}},
                   {"graduated", graduated_pairs{}},
                   {"graduated, all pairs", graduated_pairs{.tuples = 0}}};
  for (const auto& [name, solver] : all) {
    CAPTURE(name);
    const auto found = align_globally(problem.source, problem.target, problem.pairs,
                                      {.max_distance = 0.03, .solver = solver});
    CHECK(found.is_unique());
    CHECK(problem.error(found.transform) < 0.02);
  }
}

TEST_CASE("the order of pairs, threads and repetition do not matter") {
  const pair_problem<test::f3> problem{1000, 100, 0.01, 9};
  for (const any_pair_solver& solver :
       {any_pair_solver{pair_graph<>{}}, any_pair_solver{sampled_pairs{}},
        any_pair_solver{graduated_pairs{}}}) {
    global_options options{.max_distance = 0.03, .solver = solver, .threads = 1};
    const auto one = align_globally(problem.source, problem.target, problem.pairs, options);
    options.threads = 4;
    const auto four = align_globally(problem.source, problem.target, problem.pairs, options);
    CHECK(test::same_bits(one.transform.matrix(), four.transform.matrix()));
    CHECK(one.inliers == four.inliers);
  }
  const auto found = align_globally(problem.source, problem.target, reversed(problem.pairs),
                                    {.max_distance = 0.03});
  CHECK(problem.error(found.transform) < 0.03);
  for (const auto target : test::available_targets()) {
    const test::using_target used{target};
    const auto again =
        align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.03});
    const auto first = align_globally(problem.source, problem.target, problem.pairs,
                                      {.max_distance = 0.03, .threads = 3});
    CHECK(test::same_bits(again.transform.matrix(), first.transform.matrix()));
  }
}

TEST_CASE("points that are not finite take part in nothing, and pairs keep their numbers") {
  pair_problem<test::d3> problem{300, 300, 0.001, 10};
  for (index_t i = 0; i < 300; i += 7) problem.source(0, i) = test::nan<double>;
  for (index_t i = 3; i < 300; i += 11) problem.target(1, i) = test::infinity<double>;
  const auto found =
      align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.01});
  CHECK(found.is_unique());
  CHECK(problem.error(found.transform) < 0.01);
  for (const auto& pair : found.inliers) {
    CHECK(pair.source == pair.target);
    CHECK(problem.source.col(pair.source).allFinite());
    CHECK(problem.target.col(pair.target).allFinite());
  }
}

TEST_CASE("a dimension known at run time gives the same as one known at compile time") {
  const pair_problem<test::d3> problem{500, 100, 0.01, 11};
  const Eigen::MatrixXd source = problem.source, target = problem.target;
  const auto fixed =
      align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.03});
  const auto open = align_globally(source, target, problem.pairs, {.max_distance = 0.03});
  CHECK(open.is_unique());
  CHECK(test::same_bits(fixed.transform.matrix(), open.transform.matrix()));
  const Eigen::MatrixXd four = Eigen::MatrixXd::Random(4, 20);
  CHECK_THROWS_AS((void)align_globally(four, four, problem.pairs, {.max_distance = 0.03}),
                  invalid_input);
}

TEST_CASE("a stop is a status") {
  const pair_problem<test::d3> problem{3000, 100, 0.01, 12};
  std::stop_source stop;
  stop.request_stop();
  const auto found = align_globally(problem.source, problem.target, problem.pairs,
                                    {.max_distance = 0.03, .monitor = {{}, stop.get_token()}});
  CHECK(found.status == global_status::cancelled);
}

TEST_CASE("more pairs than a graph takes are thinned, and all of them count") {
  const pair_problem<test::f3> problem{most_graph_pairs * 2, 2000, 0.005, 13};
  const auto found =
      align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.015});
  CHECK(found.is_unique());
  CHECK(problem.error(found.transform) < 0.01);
  CHECK(found.inliers.size() > 1500);
}

TEST_CASE("wrong options of a global registration get a sentence") {
  const Eigen::Matrix3Xd points = test::random_points<test::d3>(20);
  const correspondences<double> pairs = test::same_indices<double>(20);
  const auto refuse = [&](const global_options& options) {
    CHECK_THROWS_AS((void)align_globally(points, points, pairs, options), invalid_input);
  };
  refuse({});
  refuse({.max_distance = 0});
  refuse({.max_distance = -1});
  refuse({.max_distance = test::nan<double>});
  refuse({.voxel = -1, .max_distance = 1});
  refuse({.max_distance = 1, .normals = knn{5}});
  refuse({.max_distance = 1, .features = knn{5}});
  refuse({.max_distance = 1, .source_viewpoint = coordinates{0, 0, 0}});
  refuse({.max_distance = 1, .up = coordinates{0, 0, 0}});
  refuse({.max_distance = 1, .up = coordinates{0, 1}});
  refuse({.max_distance = 1, .scales = scale_range{0.5, 2}});
  refuse({.max_distance = 1, .solver = pair_graph<>{.seeds = 0}});
  refuse({.max_distance = 1, .solver = sampled_pairs{.max_samples = 0}});
  refuse({.max_distance = 1, .solver = sampled_pairs{.confidence = 1}});
  refuse({.max_distance = 1, .solver = graduated_pairs{.narrowing = 1}});
  refuse({.max_distance = 1, .solver = graduated_pairs{.alike = 0}});
  CHECK_THROWS_AS((void)align_globally(points, points, correspondences<double>{{0, 20, 0}},
                                       {.max_distance = 1}),
                  invalid_input);
  CHECK_THROWS_AS((void)align_globally(points, points, {}), invalid_input);
  CHECK_THROWS_AS(
      (void)align_globally<similarity_motion>(points, points, pairs, {.max_distance = 1}),
      invalid_input);
  std::ostringstream text;
  text << align_globally(points, points, pairs, {.max_distance = 0.1});
  CHECK(text.str().find("unique, 20 of 20 pairs agree") == 0);
}

TEST_CASE("an index that no point can have is not taken for another one") {
  const Eigen::Matrix3Xd points = test::random_points<test::d3>(50);
  struct far_pair {
    std::int64_t source, target;
  };
  std::vector<far_pair> pairs;
  for (std::int64_t i = 0; i < 50; ++i) pairs.push_back({i, i});
  CHECK(align_globally(points, points, pairs, {.max_distance = 0.1}).is_unique());
  pairs[7].source += std::int64_t{1} << 32;
  CHECK_THROWS_AS((void)align_globally(points, points, pairs, {.max_distance = 0.1}),
                  invalid_input);
}

TEST_CASE("no more samples are drawn than allowed, and pairs may be made by hand") {
  const pair_problem<test::d3> problem{60, 60, 0.001, 4};
  // Without numbers, pairs are in order.
  const putative_pairs<3> pairs{
      .source = problem.source, .target = problem.target, .max_distance = 0.01};
  CHECK(pairs[7].index == 7);
  CHECK(sampled_pairs{.max_samples = 1}.propose(pairs, {}).size() <= 1);
  CHECK(sampled_pairs{.max_samples = 5}.propose(pairs, {}).size() <= 5);
  CHECK(sampled_pairs{}.propose(pairs, {}).size() > 5);
}
