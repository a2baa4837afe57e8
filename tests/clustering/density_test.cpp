// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <limits>
#include <stop_token>
#include <tuple>
#include <vector>

#include "spaces.hpp"

import cilantro;
import clustering_support;
import test_support;

using namespace cilantro;

namespace {

/// The algorithm as published, point by point, with borders to the nearest core.
template <class M>
std::vector<std::int32_t> dbscan_by_hand(const M& points, double reach, index_t min_points) {
  using S = typename M::Scalar;
  const index_t n = points.cols();
  const auto distance = [&](index_t i, index_t j) {
    return (points.col(i) - points.col(j)).norm();
  };
  std::vector<std::vector<index_t>> near(std::size_t{0} + std::size_t(n));
  for (index_t i = 0; i < n; ++i)
    for (index_t j = 0; j < n; ++j)
      if (distance(i, j) <= S(reach)) near[std::size_t(i)].push_back(j);
  const auto is_core = [&](index_t i) { return std::ssize(near[std::size_t(i)]) >= min_points; };
  std::vector<std::int32_t> labels(std::size_t(n), -1);
  std::int32_t next = 0;
  for (index_t start = 0; start < n; ++start) {
    if (!is_core(start) || labels[std::size_t(start)] >= 0) continue;
    std::vector<index_t> open{start};
    labels[std::size_t(start)] = next;
    while (!open.empty()) {
      const index_t i = open.back();
      open.pop_back();
      for (const index_t j : near[std::size_t(i)])
        if (is_core(j) && labels[std::size_t(j)] < 0) {
          labels[std::size_t(j)] = next;
          open.push_back(j);
        }
    }
    ++next;
  }
  for (index_t i = 0; i < n; ++i) {
    if (is_core(i)) continue;
    S best = std::numeric_limits<S>::infinity();
    for (const index_t j : near[std::size_t(i)])
      if (is_core(j) && distance(i, j) < best) {
        best = distance(i, j);
        labels[std::size_t(i)] = labels[std::size_t(j)];
      }
  }
  return labels;
}

/// Prim's tree over all pairs by mutual reachability: its weights, ascending.
std::vector<double> spanning_weights(const Eigen::MatrixXd& points, index_t min_points) {
  const index_t n = points.cols();
  Eigen::MatrixXd d(n, n);
  for (index_t i = 0; i < n; ++i) d.col(i) = (points.colwise() - points.col(i)).colwise().norm();
  Eigen::VectorXd core(n);
  for (index_t i = 0; i < n; ++i) {
    std::vector<double> row(d.col(i).begin(), d.col(i).end());
    std::ranges::sort(row);
    core[i] = row[std::size_t(min_points) - 1];
  }
  std::vector<bool> in(std::size_t{0} + std::size_t(n));
  std::vector<double> best(std::size_t(n), std::numeric_limits<double>::infinity()), weights;
  best[0] = 0;
  for (index_t step = 0; step < n; ++step) {
    index_t next = -1;
    for (index_t i = 0; i < n; ++i)
      if (!in[std::size_t(i)] && (next < 0 || best[std::size_t(i)] < best[std::size_t(next)]))
        next = i;
    in[std::size_t(next)] = true;
    if (step > 0) weights.push_back(best[std::size_t(next)]);
    for (index_t i = 0; i < n; ++i)
      best[std::size_t(i)] =
          std::min(best[std::size_t(i)], std::max({core[i], core[next], d(i, next)}));
  }
  std::ranges::sort(weights);
  return weights;
}

}  // namespace

TEST_CASE_TEMPLATE("density clusters are those of the published algorithm", T, ALL_SPACES) {
  const auto centers = test::corners<T>(3, 2);
  auto points = test::blobs<T>(centers, 90, 0.8, 5);
  const double reach = T::dimension == 2 ? 0.16 : T::dimension == 3 ? 0.35 : 0.85;
  for (const index_t min_points : {1, 4, 7}) {
    const auto found = dbscan(points, {.radius = reach, .min_points = min_points, .threads = 1});
    CHECK(test::same_partition(found.labels(), dbscan_by_hand(points, reach, min_points)));
    for (const int threads : {2, 5}) {
      const auto again =
          dbscan(points, {.radius = reach, .min_points = min_points, .threads = threads});
      CHECK(again == found);
      CHECK(again.is_core == found.is_core);
    }
    if (min_points == 1) CHECK(found.unlabeled() == 0);
  }
}

TEST_CASE("a border point goes to the nearest core, and to the first of equally near ones") {
  // Of each group only the end is near the point in the middle, which has too few around itself.
  std::vector<Eigen::Vector2d> points{{2, 0},    {2.9, 0},  {2.9, 0},  {2.9, 0}, {0, 0},
                                      {-0.9, 0}, {-0.9, 0}, {-0.9, 0}, {1, 0}};
  const auto tied = dbscan(points, {.radius = 1, .min_points = 4});
  CHECK(tied.size() == 2);
  CHECK(tied.is_core[8] == 0);
  CHECK(tied.labels()[8] == tied.labels()[0]);
  points[8].x() = 0.9;
  const auto nearer = dbscan(points, {.radius = 1.1, .min_points = 4});
  CHECK(nearer.labels()[8] == nearer.labels()[4]);
  CHECK(nearer.labels()[8] != nearer.labels()[0]);
}

TEST_CASE("density clusters of nothing, of one point, of equal points and of NaN") {
  const Eigen::Matrix3Xf nothing(3, 0);
  CHECK(dbscan(nothing, {.radius = 1}).empty());
  const Eigen::Matrix3Xf one = Eigen::Matrix3Xf::Zero(3, 1);
  CHECK(dbscan(one, {.radius = 1}).unlabeled() == 1);
  CHECK(dbscan(one, {.radius = 1, .min_points = 1}).size() == 1);
  Eigen::Matrix3Xf equal = Eigen::Matrix3Xf::Zero(3, 9);
  equal(1, 4) = test::nan<float>;
  const auto found = dbscan(equal, {.radius = 1e-3});
  CHECK(found.sizes() == std::vector<index_t>{8});
  CHECK(found.labels()[4] == -1);
  CHECK_THROWS_AS((void)dbscan(equal, {.radius = 1, .min_points = 0}), invalid_input);
  CHECK_THROWS_AS((void)dbscan(equal, {.radius = -1}), invalid_input);
  CHECK(hdbscan(nothing, knn{5}).empty());
  CHECK(hdbscan(one, knn{5}).unlabeled() == 1);
  CHECK(hdbscan(equal, knn{9}, {.allow_single_cluster = true}).sizes() == std::vector<index_t>{8});
  CHECK_THROWS_AS((void)hdbscan(equal, knn{5}, {.min_cluster_size = 1}), invalid_input);
}

TEST_CASE_TEMPLATE("clusters of different density are told apart where one radius cannot", T,
                   test::f2, test::d2, test::f3, test::dx) {
  using S = typename T::scalar;
  const auto centers = test::corners<T>(3, 10);
  auto points = test::blobs<T>(centers, 80, 0.1, 3);
  points.rightCols(80) = test::blobs<T>(centers.rightCols(1), 80, 3.0, 4);
  const auto found = hdbscan(points, knn{20}, {.min_cluster_size = 15});
  REQUIRE(found.size() == 3);
  index_t right = 0;
  for (const auto cluster : found) {
    std::vector<index_t> of(3);
    for (const auto i : cluster) ++of[std::size_t(i / 80)];
    right += std::ranges::max(of);
  }
  CHECK(right >= 225);
  for (const auto strength : found.strengths) {
    CHECK(strength >= 0);
    CHECK(strength <= 1);
  }
  CHECK(std::ssize(found.stabilities) == 3);
  const auto moved =
      hdbscan((points.array() + S(1)).matrix().eval(), knn{20}, {.min_cluster_size = 15});
  CHECK(moved.size() == 3);
}

TEST_CASE("with all neighbours the hierarchy is that of all pairs") {
  const auto points = test::random_points<test::d2>(120, 9);
  const auto weights = spanning_weights(points, 4);
  // A cluster for each cut of the hierarchy: the components below a weight are those of the tree.
  const kd_tree tree{points};
  for (const std::size_t cut : {30u, 60u, 90u, 110u}) {
    const double reach = weights[cut] * (1 + 1e-12);
    index_t merges = 0;
    for (const double w : weights) merges += w <= reach;
    const auto found = dbscan(points, {.radius = reach, .min_points = 4});
    index_t cores = 0;
    for (const auto c : found.is_core) cores += c;
    CHECK(cores - found.size() == merges);
  }
  CHECK(hdbscan(points, knn{120}, {.min_cluster_size = 10, .min_points = 4}) ==
        hdbscan(points, knn{119}, {.min_cluster_size = 10, .min_points = 4}));
}

TEST_CASE("progress rises to 1 through all passes, and a stop ends them") {
  const auto points = test::random_points<test::f3>(3000);
  double last = 0;
  (void)dbscan(points, {.radius = 0.1, .monitor = {.progress = [&](double share) {
                                         CHECK(share >= last);
                                         last = share;
                                       }}});
  CHECK(last == doctest::Approx(1));
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)dbscan(points, {.radius = 0.1, .monitor = {.stop = stop.get_token()}}),
                  cancelled);
}

TEST_CASE("edges of one weight go at once: by hand, where no cluster remains") {
  // Core distances 18 11 14 13 10 13, edges of the tree 18 14 14 13 13: at 14 the points 14 and 25
  // leave one by one, and {39, 49, 52} goes on as what it was.
  Eigen::RowVectorXd line(6), mixed(6);
  line << 7, 14, 25, 39, 49, 52;
  mixed << 39, 49, 7, 25, 14, 52;
  const hdbscan_options pairs{.min_cluster_size = 2, .min_points = 3};
  CHECK(hdbscan(line, knn{6}, pairs).empty());
  CHECK_THROWS_AS((void)hdbscan(line, knn{0}, pairs), invalid_input);
  CHECK(hdbscan(mixed, knn{6}, pairs).empty());
}

TEST_CASE_TEMPLATE("a hierarchy of densities does not depend on the order of the points", T,
                   test::f2, test::d2, test::d3) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    // On a lattice nearly all weights are tied.
    auto points = test::random_points<T>(150, seed);
    if (seed % 2 == 1) points = (points * 8).array().round().matrix();
    std::vector<index_t> order;
    for (index_t i = 0; i < 150; ++i) order.push_back(i);
    shuffle(order, random_stream{seed, 1});
    auto shuffled = points;
    for (index_t i = 0; i < 150; ++i) shuffled.col(i) = points.col(order[std::size_t(i)]);
    const hdbscan_options options{.min_cluster_size = 4, .min_points = 3};
    const auto found = hdbscan(points, knn{150}, options);
    const auto again = hdbscan(shuffled, knn{150}, options);
    std::vector<clusters::label> there;
    for (index_t i = 0; i < 150; ++i)
      there.push_back(found.labels()[std::size_t(order[std::size_t(i)])]);
    CHECK(test::same_partition(again.labels(), there));
    for (const double s : found.stabilities) CHECK(s > 0);
  }
}
