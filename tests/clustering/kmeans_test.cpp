// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "spaces.hpp"

import cilantro;
import clustering_support;
import test_support;

using namespace cilantro;

namespace {

/// Lloyd's iteration without any shortcut, from given centres.
template <class M>
std::vector<std::int32_t> lloyd(const M& points, M centroids, bool medians) {
  using S = typename M::Scalar;
  const index_t k = centroids.cols();
  std::vector<std::int32_t> labels(std::size_t(points.cols()), -1);
  for (int step = 0; step < 200; ++step) {
    bool changed = false;
    for (index_t i = 0; i < points.cols(); ++i) {
      index_t best = 0;
      const auto cost = [&](index_t c) {
        const auto difference = (points.col(i) - centroids.col(c)).eval();
        S sum = 0;
        for (const S x : difference) sum += medians ? std::abs(x) : x * x;
        return sum;
      };
      for (index_t c = 1; c < k; ++c)
        if (cost(c) < cost(best)) best = c;
      changed = changed || labels[std::size_t(i)] != best;
      labels[std::size_t(i)] = std::int32_t(best);
    }
    if (!changed) break;
    for (index_t c = 0; c < k; ++c) {
      std::vector<index_t> members;
      for (index_t i = 0; i < points.cols(); ++i)
        if (labels[std::size_t(i)] == c) members.push_back(i);
      REQUIRE(!members.empty());
      for (index_t d = 0; d < points.rows(); ++d) {
        std::vector<double> values;
        for (const index_t i : members) values.push_back(double(points(d, i)));
        std::ranges::sort(values);
        double mean = 0;
        for (const double v : values) mean += v / double(values.size());
        centroids(d, c) = S(medians ? values[(values.size() - 1) / 2] : mean);
      }
    }
  }
  return labels;
}

}  // namespace

TEST_CASE_TEMPLATE("bounds and trees leave the assignment exactly as it is", T, ALL_SPACES) {
  const auto points = test::random_points<T>(1500, 4);
  for (const index_t k : {1, 2, 7, 40}) {
    const decltype(points.eval()) start = points.leftCols(k);
    const auto found = kmeans(points, start, {.max_iterations = 200, .threads = 1});
    CHECK(found.converged);
    CHECK(test::same_partition(found.labels(), lloyd(points, start, false)));
    const auto medians = kmedians(points, start, {.max_iterations = 200});
    CHECK(test::same_partition(medians.labels(), lloyd(points, start, true)));
    for (const int threads : {2, 5}) {
      const auto again = kmeans(points, start, {.max_iterations = 200, .threads = threads});
      CHECK(again == found);
      CHECK(test::same_bits(again.centroids, found.centroids));
      CHECK(again.inertia == found.inertia);
    }
    // What is left out is what makes it fast.
    if (k == 7) CHECK(found.evaluations < index_t{found.iterations} * points.cols() / 2);
  }
}

TEST_CASE_TEMPLATE("no assignment of a few points is better than the best of many starts", T,
                   test::f2, test::d3) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(9, 8);
  const index_t k = 3;
  double best = std::numeric_limits<double>::infinity();
  for (int code = 0; code < 19683; ++code) {
    std::vector<int> label;
    for (int i = 0, rest = code; i < 9; ++i, rest /= 3) label.push_back(rest % 3);
    double inertia = 0;
    for (int c = 0; c < k; ++c) {
      Eigen::VectorXd mean = Eigen::VectorXd::Zero(points.rows());
      double count = 0;
      for (int i = 0; i < 9; ++i)
        if (label[std::size_t(i)] == c) {
          mean += points.col(i).template cast<double>();
          ++count;
        }
      for (int i = 0; i < 9; ++i)
        if (label[std::size_t(i)] == c)
          inertia += (points.col(i).template cast<double>() - mean / count).squaredNorm();
    }
    best = std::min(best, inertia);
  }
  const auto found = kmeans(points, k, {.restarts = 40});
  CHECK(found.inertia == doctest::Approx(best).epsilon(sizeof(S) == 4 ? 1e-5 : 1e-12));
  for (const auto start : {kmeans_start::plus_plus, kmeans_start::random_points})
    CHECK(kmeans(points, k, {.start = start, .restarts = 40}).inertia ==
          doctest::Approx(best).epsilon(1e-5));
}

TEST_CASE_TEMPLATE("well separated groups are found, and new points belong to the nearest", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  const auto centers = test::corners<T>(4, 10);
  auto points = test::blobs<T>(centers, 50, 1.0);
  points(0, 3) = test::nan<S>;
  const auto found = kmeans(points, 4, {.restarts = 5});
  REQUIRE(found.size() == 4);
  CHECK(found.unlabeled() == 1);
  for (index_t i = 0; i < points.cols(); ++i)
    if (i != 3) CHECK(found.labels()[std::size_t(i)] == found.labels()[std::size_t(i / 50 * 50)]);
  auto news = centers.eval();
  news(0, 1) = test::nan<S>;
  const auto assigned = found.assign(news);
  CHECK(assigned[0] == found.labels()[0]);
  CHECK(assigned[1] == -1);
  CHECK(assigned[2] == found.labels()[100]);
  for (index_t c = 0; c < 4; ++c) {
    const index_t from = found[c].front() / 50;
    CHECK((found.centroids.col(c) - centers.col(from)).norm() < S(0.7));
  }
}

TEST_CASE("a centre without points moves to the farthest point, never to the origin") {
  // Far from the origin; the third centre is nobody's nearest.
  Eigen::Matrix2Xd points(2, 6);
  points << 100, 101, 102, 200, 201, 240,  //
      100, 100, 100, 100, 100, 100;
  Eigen::Matrix2Xd start(2, 3);
  start << 101, 205, 1000,  //
      100, 100, 1000;
  const auto found = kmeans(points, start);
  REQUIRE(found.size() == 3);
  CHECK(found.sizes() == std::vector<index_t>{3, 2, 1});
  CHECK(found.centroids.row(0).minCoeff() >= 100);
  CHECK(found.centroids.col(2) == Eigen::Vector2d{240, 100});
  CHECK(found.inertia == doctest::Approx(2.5));
}

TEST_CASE("medians are not moved by one far point, as means are") {
  Eigen::RowVectorXd points(9);
  points << 0, 1, 2, 3, 4, 100, 101, 102, 5000;
  Eigen::RowVectorXd start(2);
  start << 2, 101;
  const auto medians = kmedians(points, start);
  CHECK(medians.centroids(0) == 2);
  CHECK(medians.centroids(1) == 101);
  CHECK(medians.inertia == doctest::Approx(6 + 1 + 1 + 4899));
  CHECK(kmeans(points, start).centroids(0) > 10);
}

TEST_CASE("fewer different points than clusters give fewer clusters, and the iteration ends") {
  Eigen::Matrix3Xf equal = Eigen::Matrix3Xf::Ones(3, 20);
  for (const auto start : {kmeans_start::plus_plus, kmeans_start::random_points}) {
    const auto found = kmeans(equal, 4, {.start = start});
    CHECK(found.size() == 1);
    CHECK(found.converged);
    CHECK(found.inertia == 0);
    CHECK(found.centroids.col(0) == Eigen::Vector3f::Ones());
  }
  equal.col(7).setZero();
  CHECK(kmeans(equal, 4).size() == 2);
}

TEST_CASE("what k-means is not for is refused") {
  const auto points = test::random_points<test::d2>(10);
  const Eigen::Matrix2Xd none(2, 0);
  CHECK_THROWS_AS((void)kmeans(points, 0), invalid_input);
  CHECK_THROWS_AS((void)kmeans(points, 11), invalid_input);
  CHECK_THROWS_AS((void)kmeans(none, 1), invalid_input);
  CHECK_THROWS_AS((void)kmeans(points, none), invalid_input);
  CHECK_THROWS_AS((void)kmeans(points, Eigen::Matrix2d::Constant(test::nan<double>).eval()),
                  invalid_input);
  CHECK_THROWS_AS((void)kmeans(points, 2, {.restarts = 0}), invalid_input);
  const Eigen::MatrixXd other = Eigen::MatrixXd::Zero(3, 2);
  CHECK_THROWS_AS((void)kmeans(Eigen::MatrixXd{points}, other), invalid_input);
}

TEST_CASE("a limit, a tolerance, a seed and a cloud are what they are for any algorithm") {
  const point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(5000, 2)};
  const auto stopped = kmeans(cloud, 20, {.max_iterations = 2});
  CHECK(!stopped.converged);
  CHECK(stopped.iterations == 2);
  CHECK(stopped.assign(cloud) ==
        std::vector<std::int32_t>(stopped.labels().begin(), stopped.labels().end()));
  const auto roughly = kmeans(cloud, 20, {.max_iterations = 1000, .tolerance = 0.01});
  const auto exactly = kmeans(cloud, 20, {.max_iterations = 1000});
  CHECK(roughly.converged);
  CHECK(exactly.converged);
  CHECK(roughly.iterations < exactly.iterations);
  CHECK(kmeans(cloud, 20, {.seed = 1}).inertia != kmeans(cloud, 20, {.seed = 2}).inertia);
  CHECK(kmeans(cloud, 20, {.restarts = 4}).inertia <= kmeans(cloud, 20).inertia);
}

TEST_CASE_TEMPLATE("every vector target, and points of run-time dimension, get the same clusters",
                   T, test::f2, test::f3, test::d2, test::d3) {
  using S = typename T::scalar;
  // In rows, where neighbours in memory lie close, and at random.
  auto points = test::random_points<T>(20000, 5);
  for (index_t i = 0; i < 10000; ++i) {
    points.col(i).setZero();
    points(0, i) = S(i % 100) / 100;
    points(1, i) = S(i / 100) / 100;
  }
  points(0, 77) = test::nan<S>;
  const point_matrix<S, T::static_dimension> start = points.middleCols(12000, 60);
  const kmeans_options options{.max_iterations = 30};
  const auto reference =
      kmeans(point_matrix<S, dynamic>{points}, point_matrix<S, dynamic>{start}, options);
  for (const auto target : test::available_targets()) {
    CAPTURE(name_of(target));
    const test::using_target use{target};
    const auto found = kmeans(points, start, options);
    CHECK(std::ranges::equal(found.labels(), reference.labels()));
    CHECK(found.centroids == reference.centroids);
    CHECK(found.iterations == reference.iterations);
  }
}
