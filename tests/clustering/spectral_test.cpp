// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import clustering_support;
import test_support;

using namespace cilantro;

namespace {

constexpr laplacian kinds[] = {laplacian::unnormalized, laplacian::symmetric,
                               laplacian::random_walk};

/// Two rings, one within the other, which no centre can tell apart.
Eigen::Matrix2Xd rings(index_t each) {
  Eigen::Matrix2Xd points(2, 2 * each);
  for (index_t i = 0; i < points.cols(); ++i) {
    const double angle = 2 * 3.14159265358979 * double(i % each) / double(each);
    points.col(i) = (i < each ? 1.0 : 2.0) * Eigen::Vector2d{std::cos(angle), std::sin(angle)};
  }
  return points;
}

Eigen::MatrixXd gaussian_affinity(const Eigen::Matrix2Xd& points, double sigma) {
  Eigen::MatrixXd w(points.cols(), points.cols());
  for (index_t i = 0; i < w.cols(); ++i)
    for (index_t j = 0; j < w.rows(); ++j)
      w(j, i) =
          i == j ? 0
                 : std::exp(-(points.col(i) - points.col(j)).squaredNorm() / (2 * sigma * sigma));
  return w;
}

}  // namespace

TEST_CASE("rings are told apart by each Laplacian, dense and sparse, small and large") {
  for (const index_t each : {60, 200}) {
    const auto points = rings(each);
    const double sigma = each < 100 ? 0.15 : 0.1;
    const Eigen::MatrixXd w = gaussian_affinity(points, sigma);
    for (const auto kind : kinds) {
      CAPTURE(int(kind));
      const auto found = spectral_clustering(w, {.clusters = 2, .matrix = kind});
      REQUIRE(found.converged);
      REQUIRE(found.size() == 2);
      CHECK(found.components == 1);
      for (index_t i = 0; i < points.cols(); ++i)
        CHECK(found.labels()[std::size_t(i)] ==
              (i < each ? found.labels()[0] : 1 - found.labels()[0]));
    }
  }
  const auto sparse = pair_matrix(neighbor_graph(rings(400), knn{8}), gaussian{0.1});
  CHECK(spectral_clustering(sparse, {.clusters = 2}).sizes() == std::vector<index_t>{400, 400});
}

TEST_CASE("the number of clusters is where the eigenvalues leave a gap") {
  const auto centers = test::corners<test::d2>(4, 10);
  const Eigen::Matrix2Xd points = test::blobs<test::d2>(centers, 40, 1.0);
  const auto w = gaussian_affinity(points, 1.5);
  for (const auto kind : kinds) {
    const auto found = spectral_clustering(w, {.matrix = kind});
    CHECK(found.size() == 4);
    CHECK(found.eigenvalues.size() == 11);
    for (index_t i = 0; i < points.cols(); ++i)
      CHECK(found.labels()[std::size_t(i)] == found.labels()[std::size_t(i / 40 * 40)]);
  }
}

TEST_CASE("eigenvalues are those of the Laplacians of a path and of a complete graph") {
  // A path of n nodes: 2 − 2 cos(π k / n).
  constexpr index_t n = 500;
  Eigen::MatrixXd path = Eigen::MatrixXd::Zero(n, n);
  for (index_t i = 0; i + 1 < n; ++i) path(i, i + 1) = path(i + 1, i) = 1;
  const auto line = spectral_clustering(path, {.clusters = 2, .matrix = laplacian::unnormalized});
  REQUIRE(line.converged);
  for (index_t k = 0; k < 3; ++k)
    CHECK(line.eigenvalues[k] ==
          doctest::Approx(2 - 2 * std::cos(3.14159265358979 * double(k) / n)).epsilon(1e-4));
  CHECK(line.sizes() == std::vector<index_t>{250, 250});
  CHECK(line.labels()[0] == line.labels()[249]);
  // A complete graph: all eigenvalues but the first are n, or 1 + 1 / (n − 1).
  const Eigen::MatrixXd complete =
      Eigen::MatrixXd::Ones(30, 30) - Eigen::MatrixXd::Identity(30, 30);
  CHECK(spectral_clustering(complete, {.clusters = 3, .matrix = laplacian::unnormalized})
            .eigenvalues[3] == doctest::Approx(30));
  CHECK(spectral_clustering(complete, {.clusters = 3}).eigenvalues[1] ==
        doctest::Approx(1 + 1.0 / 29));
}

TEST_CASE("components are clusters, largest first; nodes without affinities are on their own") {
  Eigen::MatrixXd w = Eigen::MatrixXd::Zero(9, 9);
  const auto connect = [&](index_t i, index_t j) { w(i, j) = w(j, i) = 1; };
  connect(0, 3);
  connect(3, 6);
  connect(1, 2);
  connect(4, 5);
  connect(4, 8);
  connect(5, 8);
  for (const auto kind : kinds) {
    const auto three = spectral_clustering(w, {.clusters = 3, .matrix = kind});
    CHECK(three.components == 4);
    CHECK(three.sizes() == std::vector<index_t>{3, 3, 2});
    CHECK(three.labels()[7] == -1);
    CHECK(spectral_clustering(w, {.clusters = 4, .matrix = kind}).unlabeled() == 0);
    // One more: one of the components is cut.
    const auto five = spectral_clustering(w, {.clusters = 5, .matrix = kind});
    CHECK(five.size() == 5);
    CHECK(five.eigenvalues.head(4).isZero(0));
    CHECK(spectral_clustering(w, {.matrix = kind}).size() >= 1);
  }
  const auto none = spectral_clustering(Eigen::MatrixXd::Zero(5, 5), {.clusters = 2});
  CHECK(none.components == 5);
  CHECK(none.size() == 2);
  CHECK(none.unlabeled() == 3);
}

TEST_CASE("results do not depend on the number of threads, and can be stopped") {
  const auto w = gaussian_affinity(rings(160), 0.1);
  const auto first = spectral_clustering(w, {.clusters = 5, .threads = 1});
  for (const int threads : {2, 5}) {
    const auto again = spectral_clustering(w, {.clusters = 5, .threads = threads});
    CHECK(again == first);
    CHECK(again.eigenvalues == first.eigenvalues);
  }
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS(
      (void)spectral_clustering(w, {.clusters = 5, .monitor = {.stop = stop.get_token()}}),
      cancelled);
}

TEST_CASE("an eigensolver that gives up is a status, and no cluster is made up") {
  constexpr index_t n = 2000;
  sparse_matrix path(n, n);
  for (std::int32_t i = 0; i < n; ++i) {
    path.startVec(i);
    if (i > 0) path.insertBackByOuterInner(i, i - 1) = 1;
    if (i + 1 < n) path.insertBackByOuterInner(i, i + 1) = 1;
  }
  path.finalize();
  const auto found = spectral_clustering(path, {.clusters = 3, .max_solver_restarts = 2});
  CHECK(!found.converged);
  CHECK(found.empty());
  CHECK(found.unlabeled() == n);
}

TEST_CASE("matrices that are no affinities are refused") {
  Eigen::MatrixXd w = Eigen::MatrixXd::Ones(4, 4);
  const auto run = [&] { (void)spectral_clustering(w, {.clusters = 2}); };
  CHECK_NOTHROW(run());
  w(1, 2) = 0.5;
  CHECK_THROWS_AS(run(), invalid_input);
  w(2, 1) = 0.5;
  CHECK_NOTHROW(run());
  w(0, 0) = test::nan<double>;
  CHECK_THROWS_AS(run(), invalid_input);
  w(0, 0) = -1;
  CHECK_THROWS_AS(run(), invalid_input);
  w = Eigen::MatrixXd::Ones(4, 3);
  CHECK_THROWS_AS(run(), invalid_input);
  w = Eigen::MatrixXd::Ones(4, 4);
  CHECK_THROWS_AS((void)spectral_clustering(w, {.clusters = 0}), invalid_input);
  CHECK_THROWS_AS((void)spectral_clustering(w, {.clusters = 5}), invalid_input);
  CHECK(spectral_clustering(Eigen::MatrixXd(0, 0)).empty());
  CHECK(spectral_clustering(Eigen::MatrixXd::Ones(1, 1).eval()).size() == 1);
}
