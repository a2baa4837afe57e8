// SPDX-License-Identifier: MIT
//
// What must not change: the order of the points, the unit they are in, and points that come twice.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import clustering_support;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

std::vector<index_t> shuffled_indices(index_t n) {
  std::vector<index_t> order;
  for (index_t i = 0; i < n; ++i) order.push_back(i);
  shuffle(order, random_stream{17});
  return order;
}

/// Point i is point `order[i]` of `points`.
template <class M>
M in_order(const M& points, const std::vector<index_t>& order) {
  M moved = points;
  for (std::size_t i = 0; i < order.size(); ++i) moved.col(index_t(i)) = points.col(order[i]);
  return moved;
}

/// Labels of points in `order` as labels of the points.
std::vector<clusters::label> back_in_order(const clusters& found,
                                           const std::vector<index_t>& order) {
  std::vector<clusters::label> labels(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) labels[std::size_t(order[i])] = found.labels()[i];
  return labels;
}

std::vector<index_t> back_in_order(const std::vector<std::int32_t>& indices,
                                   const std::vector<index_t>& order) {
  std::vector<index_t> original;
  for (const auto i : indices) original.push_back(order[std::size_t(i)]);
  std::ranges::sort(original);
  return original;
}

template <class T>
auto some_points() {
  return test::blobs<T>(test::corners<T>(4, 2), 60, 0.7, 3);
}

}  // namespace

TEST_CASE_TEMPLATE("points in another order are the same points", T, test::f2, test::f3, test::d3,
                   test::dx) {
  using S = typename T::scalar;
  const auto points = some_points<T>();
  const auto order = shuffled_indices(points.cols());
  const auto moved = in_order(points, order);
  const double reach = 0.45 * double(T::dimension);
  const S rounding = sizeof(S) == 4 ? S(1e-4) : S(1e-10);

  const dbscan_options density{.radius = reach / 2, .min_points = 5};
  CHECK(test::same_partition(dbscan(points, density).labels(),
                             back_in_order(dbscan(moved, density), order)));
  CHECK(test::same_partition(connected_components(points, radius{reach / 4}).labels(),
                             back_in_order(connected_components(moved, radius{reach / 4}), order)));
  const auto as_indices = [](const std::vector<std::int32_t>& kept) {
    return std::vector<index_t>(kept.begin(), kept.end());
  };
  CHECK(as_indices(statistical_outliers(points, {.neighbors = 8, .deviations = 1}).kept) ==
        back_in_order(statistical_outliers(moved, {.neighbors = 8, .deviations = 1}).kept, order));
  CHECK(
      as_indices(radius_outliers(points, {.radius = reach / 3, .min_neighbors = 6}).kept) ==
      back_in_order(radius_outliers(moved, {.radius = reach / 3, .min_neighbors = 6}).kept, order));

  const auto normals = estimate_normals(points, knn{12}).normals;
  const auto others = estimate_normals(moved, knn{12}).normals;
  CHECK((in_order(normals, order) - others).cwiseAbs().maxCoeff() < 100 * rounding);
  CHECK((voxel_downsample(points, reach) - voxel_downsample(moved, reach)).cwiseAbs().maxCoeff() <
        rounding);
  const auto basis = *principal_components(points), other_basis = *principal_components(moved);
  CHECK((basis.axes - other_basis.axes).cwiseAbs().maxCoeff() < 10 * rounding);
  CHECK((basis.mean - other_basis.mean).cwiseAbs().maxCoeff() < rounding);

  const auto target = test::bumpy_surface<T>(400, 1);
  const auto source =
      transform(test::bumpy_surface<T>(300, 2), test::random_rigid<T>(1, 0.05, 0.05));
  auto other_target = target, other_source = source;
  const auto target_order = shuffled_indices(400), source_order = shuffled_indices(300);
  other_target.points = in_order(point_matrix<S, T::static_dimension>{target.points}, target_order);
  other_target.normals =
      in_order(point_matrix<S, T::static_dimension>{target.normals}, target_order);
  other_source.points = in_order(point_matrix<S, T::static_dimension>{source.points}, source_order);
  other_source.normals =
      in_order(point_matrix<S, T::static_dimension>{source.normals}, source_order);
  const auto found = align(source, target, {.max_iterations = 5, .tolerance = 0});
  const auto again = align(other_source, other_target, {.max_iterations = 5, .tolerance = 0});
  CHECK(test::difference(found.transform, again.transform) < double(100 * rounding));
  CHECK(found.pairs == again.pairs);
}

TEST_CASE_TEMPLATE("a unit that is a power of two changes no bit but the exponents", T, test::f2,
                   test::f3, test::d3, test::dx) {
  using S = typename T::scalar;
  const auto points = some_points<T>();
  const double reach = 0.45 * double(T::dimension);
  const auto normals = estimate_normals(points, knn{12});
  const auto cells = voxel_downsample(points, reach);
  const auto basis = *principal_components(points);
  for (const double unit : {0x1p-30, 0x1p30}) {
    const auto scaled = (points * S(unit)).eval();
    CHECK(dbscan(scaled, {.radius = unit * reach / 2, .min_points = 5}) ==
          dbscan(points, {.radius = reach / 2, .min_points = 5}));
    CHECK(statistical_outliers(scaled).kept == statistical_outliers(points).kept);
    const auto found = estimate_normals(scaled, knn{12});
    CHECK(found.normals == normals.normals);
    CHECK(found.curvature == normals.curvature);
    CHECK(voxel_downsample(scaled, unit * reach) == (cells * S(unit)).eval());
    CHECK(principal_components(scaled)->axes == basis.axes);
    CHECK(hdbscan(scaled, knn{20}).labels().size() == hdbscan(points, knn{20}).labels().size());
    CHECK(clusters{hdbscan(scaled, knn{20})} == clusters{hdbscan(points, knn{20})});
  }
}

TEST_CASE_TEMPLATE("each point twice is the same set, twice as dense", T, test::f2, test::d3) {
  const auto points = some_points<T>();
  const index_t n = points.cols();
  auto doubled = test::random_points<T>(2 * n);
  doubled.leftCols(n) = points;
  doubled.rightCols(n) = points;
  const auto once = dbscan(points, {.radius = 0.5, .min_points = 5});
  const auto twice = dbscan(doubled, {.radius = 0.5, .min_points = 10});
  CHECK(twice.size() == once.size());
  const auto labels = twice.labels();
  CHECK(std::ranges::equal(labels.first(std::size_t(n)), labels.last(std::size_t(n))));
  CHECK(test::same_partition(once.labels(), labels.first(std::size_t(n))));
  CHECK(voxel_downsample(doubled, 0.7).isApprox(voxel_downsample(points, 0.7)));
  CHECK(principal_components(doubled)->mean.isApprox(principal_components(points)->mean));
  const kd_tree tree{doubled};
  for (index_t i = 0; i < n; i += 7) {
    const auto near = tree.find(doubled.col(i), knn{2});
    CHECK((near[0].index == i && near[1].index == i + n));
    CHECK(near[1].distance == 0);
  }
}
