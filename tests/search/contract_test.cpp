// SPDX-License-Identifier: MIT
#include <algorithm>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// A searcher with a fault that can be chosen.
struct faulty {
  using scalar = float;
  static constexpr int static_dimension = 3;
  enum class fault { none, keeps_old, squared, exclusive, misses_last, unsorted, ignores_k };

  brute_force_searcher<float, 3> inner;
  fault f = fault::none;

  [[nodiscard]] index_t size() const { return inner.size(); }
  [[nodiscard]] index_t dimension() const { return 3; }
  void find(const Eigen::Vector3f& query, neighborhood_spec spec,
            std::vector<neighbor<float>>& out) const {
    const auto before = out;
    inner.find(query, f == fault::ignores_k ? radius{spec.max_distance()} : spec, out);
    if (f == fault::keeps_old) out.insert(out.end(), before.begin(), before.end());
    if (f == fault::squared)
      for (auto& n : out) n.distance *= n.distance;
    if (f == fault::exclusive)
      std::erase_if(out, [&](const auto& n) { return n.distance >= float(spec.max_distance()); });
    if (f == fault::misses_last && out.size() > 1) out.erase(out.begin());
    if (f == fault::unsorted) std::ranges::reverse(out);
  }
};

/// Not even the member `find`.
struct without_find {
  using scalar = float;
  static constexpr int static_dimension = 3;
  [[nodiscard]] index_t size() const { return 0; }
  [[nodiscard]] index_t dimension() const { return 3; }
};

/// In one text, so that a failure shows them.
std::string violations(const std::vector<std::string>& all) {
  std::string text;
  for (const auto& v : all) text += v + '\n';
  return text;
}

}  // namespace

static_assert(NeighborSearcher<faulty>);
static_assert(!NeighborSearcher<without_find>);
static_assert(!NeighborSearcher<int>);
static_assert(CoordinateMetric<euclidean> && !CoordinateMetric<int>);

TEST_CASE_TEMPLATE("the shipped searchers keep the contract", T, ALL_SPACES) {
  auto points = test::random_points<T>(300);
  points.rightCols(50) = points.leftCols(50).eval();
  points(0, 7) = test::nan<typename T::scalar>;
  const kd_tree tree{points};
  CHECK(violations(check_neighbor_searcher(tree, points)) == "");
  const brute_force_searcher brute{points};
  CHECK(violations(check_neighbor_searcher(brute, points)) == "");
}

TEST_CASE("the contract holds for no points and for one") {
  for (const index_t n : {0, 1}) {
    const auto points = test::random_points<test::d2>(n);
    CHECK(violations(check_neighbor_searcher(kd_tree{points}, points)) == "");
  }
}

TEST_CASE("every broken rule of the contract is noticed and named") {
  auto points = test::random_points<test::f3>(200, 3);
  const auto violations_of = [&](faulty::fault f) {
    const faulty searcher{brute_force_searcher{points}, f};
    return violations(check_neighbor_searcher(searcher, points));
  };
  const auto names = [&](faulty::fault f, const char* what) {
    return violations_of(f).find(what) != std::string::npos;
  };
  using fault = faulty::fault;
  CHECK(violations_of(fault::none) == "");
  CHECK(names(fault::keeps_old, "two searches for the same give different results"));
  CHECK(names(fault::squared, "a distance is not that of its point"));
  CHECK(names(fault::exclusive, "radius{0}: there are too few neighbors"));
  CHECK(names(fault::misses_last, "these are not the nearest points"));
  CHECK(names(fault::misses_last, "there are too few neighbors"));
  CHECK(names(fault::unsorted, "not in ascending order"));
  CHECK(names(fault::ignores_k, "there are too many neighbors"));
  const auto fewer = points.leftCols(10).eval();
  CHECK(check_neighbor_searcher(faulty{brute_force_searcher{fewer}}, points) ==
        std::vector<std::string>{"size() is not the number of points"});
}
