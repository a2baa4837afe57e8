// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Clustered, in part on a lattice, in part doubled, with holes.
template <class T>
auto difficult_points(index_t count) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(count, 3);
  for (index_t i = 0; i < count; ++i) {
    if (i % 3 == 0) points.col(i) = (points.col(i) * 8).array().floor() / 8;
    if (i % 5 == 1) points.col(i) *= S(0.01);
    if (i % 7 == 6) points.col(i) = points.col(i - 1);
    if (i % 50 == 9) points(i % T::dimension, i) = test::nan<S>;
  }
  return points;
}

template <class S>
bool are_equal(const neighborhoods<S>& a, const neighborhoods<S>& b) {
  return std::ranges::equal(a.offsets(), b.offsets()) &&
         std::ranges::equal(a.indices(), b.indices()) &&
         std::ranges::equal(a.distances(), b.distances());
}

const std::vector<neighborhood_spec>& specs() {
  static const std::vector<neighborhood_spec> all{knn{1},
                                                  knn{4},
                                                  knn{8},
                                                  knn{9},
                                                  knn{16},
                                                  knn{17},
                                                  knn{24},
                                                  knn{32},
                                                  radius{0.05},
                                                  radius{0.4},
                                                  knn_in_radius{7, 0.05},
                                                  knn{33},
                                                  knn{80},
                                                  knn{12},
                                                  radius{0},
                                                  knn_in_radius{20, 0.1}};
  return all;
}

}  // namespace

TEST_CASE_TEMPLATE("every vector target finds what brute force finds, to the bit", T, ALL_SPACES) {
  const auto points = difficult_points<T>(700);
  const auto others = test::random_points<T>(211, 8);
  const brute_force_searcher truth{points};
  const kd_tree tree{points};
  for (const auto& spec : specs()) {
    const auto near_points = find_neighborhoods(truth, points, spec);
    const auto near_others = find_neighborhoods(truth, others, spec);
    for (const auto target : test::available_targets()) {
      const test::using_target use{target};
      CAPTURE(std::string{name_of(target)});
      CAPTURE(spec.max_count());
      CAPTURE(spec.max_distance());
      REQUIRE(are_equal(find_neighborhoods(tree, points, spec), near_points));
      REQUIRE(are_equal(find_neighborhoods(tree, others, spec), near_others));
    }
  }
}

TEST_CASE_TEMPLATE("a radius that holds thousands gives them in order", T, CLOUD_SPACES) {
  const auto points = test::random_points<T>(3000, 5);
  const auto queries = test::random_points<T>(20, 6);
  const auto expected = find_neighborhoods(brute_force_searcher{points}, queries, radius{1});
  REQUIRE(expected.total() > 20 * 500);
  for (const auto target : test::available_targets()) {
    const test::using_target use{target};
    CHECK(are_equal(find_neighborhoods(kd_tree{points}, queries, radius{1}), expected));
  }
}

TEST_CASE_TEMPLATE("equal points are found by index, and searching them is not quadratic", T,
                   CLOUD_SPACES) {
  // A walk that could not leave out ties would look at each of 4·10^10 pairs.
  const index_t count = 200000;
  using S = typename T::scalar;
  const point_matrix<S, T::static_dimension> points =
      point_matrix<S, T::static_dimension>::Constant(T::dimension, count, S(0.3));
  const auto found = find_neighborhoods(kd_tree{points}, points, knn{10});
  REQUIRE(found.size() == count);
  bool all = true;
  for (index_t i = 0; i < count; ++i)
    for (index_t k = 0; k < 10; ++k) all = all && found[i][k] == neighbor<S>{k, 0};
  CHECK(all);
}

TEST_CASE("the environment and the machine decide on the target") {
  CHECK(is_available(vector_target::baseline));
  CHECK(is_available(current_vector_target()));
  CHECK(name_of(vector_target::avx512) == "avx512");
  for (const auto t : {vector_target::avx2, vector_target::avx512})
    if (!is_available(t)) CHECK_THROWS_AS(use_vector_target(t), invalid_input);
  const auto before = current_vector_target();
  {
    const test::using_target use{vector_target::baseline};
    CHECK(current_vector_target() == vector_target::baseline);
  }
  CHECK(current_vector_target() == before);
}
