// SPDX-License-Identifier: MIT
//
// What is proved of a transform, against an exhaustive search.
#include <algorithm>
#include <cstdint>
#include <sstream>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// Points in a unit cube and moved ones, of which the first `right` are where they belong.
template <class Space>
struct few_pairs {
  using S = typename Space::scalar;
  static constexpr int D = Space::static_dimension;

  test::rigid_of<Space> truth;
  point_matrix<S, D> source, target;
  correspondences<S> pairs;

  few_pairs(index_t count, index_t right, double noise, std::uint64_t seed)
      : truth{test::random_rigid<Space>(seed, 1, 2)},
        source{test::random_points<Space>(count, seed)},
        pairs{test::same_indices<S>(count)} {
    target = moved(source);
    const point_matrix<S, D> elsewhere = moved(test::random_points<Space>(count, seed + 1000));
    target.rightCols(count - right) = elsewhere.rightCols(count - right);
    random_stream random{seed, 5};
    for (auto& x : target.reshaped()) x += S(noise * random.normal());
  }

  [[nodiscard]] point_matrix<S, D> moved(const point_matrix<S, D>& points) const {
    return ((truth.linear() * points).colwise() + truth.translation()).eval();
  }

  /// The most pairs that agree with any transform of D of them: no more than any transform has.
  [[nodiscard]] index_t best_of_samples(double max_distance) const {
    index_t best = 0;
    const index_t n = source.cols(), last = Space::dimension == 3 ? n : 1;
    for (index_t a = 0; a < n; ++a)
      for (index_t b = a + 1; b < n; ++b)
        for (index_t c = Space::dimension == 3 ? b + 1 : 0; c < last; ++c) {
          correspondences<S> sample{pairs[a], pairs[b]};
          if (Space::dimension == 3) sample.push_back(pairs[c]);
          const auto found = point_to_point_estimator{source, target}.estimate(
              test::rigid_of<Space>::Identity(), sample);
          const auto off =
              (((found.transform.linear() * source).colwise() + found.transform.translation()) -
               target)
                  .colwise()
                  .norm()
                  .eval();
          best = std::max<index_t>(best, (off.array() <= S(max_distance)).count());
        }
    return best;
  }
};

}  // namespace

TEST_CASE_TEMPLATE("no transform has more pairs than is proved, by an exhaustive search", Space,
                   test::f3, test::d3, test::d2) {
  for (std::uint64_t seed = 0; seed < 4; ++seed)
    for (const auto& [count, right] : {std::pair{9, 0}, {14, 4}, {16, 9}}) {
      const few_pairs<Space> problem{count, right, 0.01, seed};
      for (const double distance : {0.03, 0.2}) {
        const auto proved = certify(problem.truth, problem.source, problem.target, problem.pairs,
                                    {.max_distance = distance});
        CHECK(proved.pairs == count);
        CHECK(proved.most >= problem.best_of_samples(distance));
        CHECK(proved.most >= proved.agreeing);
        CHECK(proved.most <= count);
        CHECK(proved.share_of_best() >= 0);
        CHECK(proved.share_of_best() <= 1);
      }
    }
}

TEST_CASE("right pairs among few wrong ones are proved to be the best") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const few_pairs<test::d3> problem{300, 240, 0.002, seed};
    const auto found =
        align_globally(problem.source, problem.target, problem.pairs, {.max_distance = 0.02});
    const auto proved = certify(found.transform, problem.source, problem.target, problem.pairs,
                                {.max_distance = 0.02});
    CHECK(proved.agreeing >= 240);
    CHECK(proved.is_optimal());
    CHECK(proved.share_of_best() == 1);
    // Of a wrong transform, it is not claimed.
    CHECK_FALSE(certify(Eigen::Isometry3d::Identity(), problem.source, problem.target,
                        problem.pairs, {.max_distance = 0.02})
                    .is_optimal());
  }
}

TEST_CASE("a certificate says how many, for any number of threads") {
  const few_pairs<test::d3> problem{400, 200, 0.005, 1};
  const auto with = [&](int threads) {
    std::ostringstream text;
    text << certify(problem.truth, problem.source, problem.target, problem.pairs,
                    {.max_distance = 0.03, .threads = threads});
    return text.str();
  };
  CHECK(with(1) == with(4));
  CHECK(with(1).find("of 400 pairs agree") != std::string::npos);
}

TEST_CASE("no pairs, and pairs of points that are not finite, prove nothing") {
  Eigen::Matrix3Xd points = test::random_points<test::d3>(10);
  points.col(3).setConstant(test::nan<double>);
  const auto still = Eigen::Isometry3d::Identity();
  const auto none = certify(still, points, points, correspondences<double>{}, {.max_distance = 1});
  CHECK(none.pairs == 0);
  CHECK(none.most == 0);
  CHECK(none.is_optimal());
  const auto all =
      certify(still, points, points, test::same_indices<double>(10), {.max_distance = 0.1});
  CHECK(all.pairs == 9);
  CHECK(all.agreeing == 9);
  CHECK(all.is_optimal());
}

TEST_CASE("what cannot be certified gets a sentence, and a stop is an exception") {
  const Eigen::Matrix3Xd points = test::random_points<test::d3>(10);
  const auto still = Eigen::Isometry3d::Identity();
  const auto pairs = test::same_indices<double>(10);
  for (const double distance : {0.0, -1.0, test::nan<double>, test::infinity<double>})
    CHECK_THROWS_AS((void)certify(still, points, points, pairs, {.max_distance = distance}),
                    invalid_input);
  struct far_pair {
    std::int64_t source, target;
  };
  for (const far_pair pair : {far_pair{0, 10}, {-1, 0}, {std::int64_t{1} << 32, 0}})
    CHECK_THROWS_AS((void)certify(still, points, points, std::vector{pair}, {.max_distance = 1}),
                    invalid_input);
  const correspondences<double> too_many(most_graph_pairs + 1, {1, 1, 0});
  CHECK_THROWS_AS((void)certify(still, points, points, too_many, {.max_distance = 1}),
                  invalid_input);
  CHECK_THROWS_AS(
      (void)certify(Eigen::Isometry2d::Identity(), points, points, pairs, {.max_distance = 1}),
      invalid_input);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)certify(still, points, points, pairs,
                                {.max_distance = 1, .monitor = {{}, stop.get_token()}}),
                  cancelled);
}
