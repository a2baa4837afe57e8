// SPDX-License-Identifier: MIT
//
// A cloud, and a type of the user's with normals, wherever points are asked for.
#include <algorithm>
#include <concepts>
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

/// A scan as a driver gives it: a record a point.
struct driver_scan {
  struct record {
    double x, y, z, intensity, nx, ny, nz;
  };
  std::vector<record> records;
};

template <>
struct cilantro::points_traits<driver_scan> {
  static points_view<double, 3> view(const driver_scan& s) {
    return {&s.records.data()->x, std::ssize(s.records), 7};
  }
  static points_view<double, 3> normals(const driver_scan& s) {
    return {&s.records.data()->nx, std::ssize(s.records), 7};
  }
};

using namespace cilantro;

namespace {

driver_scan scan_of(const point_cloud<double, 3>& cloud) {
  driver_scan scan;
  for (index_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = cloud.points.col(i), n = cloud.normals.col(i);
    scan.records.push_back({p.x(), p.y(), p.z(), 1, n.x(), n.y(), n.z()});
  }
  return scan;
}

using cloud_type = point_cloud<float, 3>;
static_assert(PointsSource<cloud_type> && OrientedPoints<cloud_type>);
static_assert(BorrowedPoints<const cloud_type&> && !BorrowedPoints<cloud_type>);
static_assert(OrientedPoints<driver_scan> && !OrientedPoints<Eigen::Matrix3Xf>);
static_assert(BorrowedPoints<oriented_points_view<float, 3>>);

// Where normals or colours are meant, a cloud would be taken for its points.
template <class C>
concept TakesClouds =
    requires(const C& cloud, Eigen::Matrix3Xf& normals, const point_groups& groups) {
      similar_normals{cloud, 0.1};
    } || requires(const C& cloud) { similar_colors{cloud, 0.1}; } ||
    requires(const C& cloud, Eigen::Matrix3Xf& normals) { orient_to_reference(normals, cloud); } ||
    requires(const C& cloud, const point_groups& groups) { medoids_of_normals(cloud, groups); } ||
    requires(const C& cloud, const point_groups& groups) { group_directions(cloud, groups); } ||
    requires(const C& cloud) { transform_normals(Eigen::Isometry3f{}, cloud); } ||
    requires(const C& cloud) { oriented_points_view{cloud, cloud}; } ||
    requires(const C& cloud) { cylinder_family{cloud, cloud}; };
static_assert(!TakesClouds<cloud_type>);
static_assert(TakesClouds<Eigen::Matrix3Xf>);
static_assert(!RegistrationMetric<
              combined_metric<combined_metric<point_to_plane, point_to_point>, point_to_point>, 3>);

}  // namespace

TEST_CASE_TEMPLATE("a cloud is its points to what asks for points", T, test::f3, test::d2) {
  using S = typename T::scalar;
  const point_cloud<S, T::static_dimension> cloud{.points = test::random_points<T>(200, 3)};
  const auto& points = cloud.points;
  CHECK(std::ranges::equal(find_neighborhoods(kd_tree{cloud}, cloud, knn{4}).indices(),
                           find_neighborhoods(kd_tree{points}, points, knn{4}).indices()));
  CHECK(std::ranges::equal(neighbor_graph(cloud, knn{4}).indices(),
                           neighbor_graph(points, knn{4}).indices()));
  CHECK(voxel_grid{cloud, 0.3}.size() == voxel_grid{points, 0.3}.size());
  CHECK(statistical_outliers(cloud).kept == statistical_outliers(points).kept);
  CHECK(principal_components(cloud)->axes == principal_components(points)->axes);
  CHECK(kmeans(cloud, 3) == kmeans(points, 3));
  CHECK(connected_components(cloud, knn{2}) == connected_components(points, knn{2}));
  CHECK(ransac(hyperplane_family{cloud}, {.max_residual = 0.1})->inliers ==
        ransac(hyperplane_family{points}, {.max_residual = 0.1})->inliers);
}

TEST_CASE("what has a meaning of its own for clouds keeps it, with and without options") {
  const point_cloud<double, 3> cloud = test::bumpy_surface<test::d3>(300);
  const auto by = [](const auto& points, const auto& indices) {
    return mean_and_covariance(points, indices);
  };
  static_assert(PointCloud<decltype(estimate_normals(cloud, knn{5}, by))>);
  static_assert(PointCloud<decltype(estimate_normals(cloud, knn{5}, {.threads = 1}))>);
  static_assert(PointCloud<decltype(voxel_downsample(cloud, 0.1, {.threads = 1}))>);
  static_assert(PointCloud<decltype(farthest_point_sample(cloud, 5, {.threads = 1}))>);
  for (const auto pick :
       {voxel_representative::mean, voxel_representative::first,
        voxel_representative::nearest_to_center, voxel_representative::medoid_of_normals}) {
    const auto reduced = voxel_downsample(cloud, 0.4, {.pick = pick});
    const oriented_points_view points{cloud};
    CHECK(reduced.points == voxel_downsample(points, 0.4, {.pick = pick}));
    CHECK(reduced.size() < cloud.size());
  }
  CHECK_THROWS_WITH_AS(
      (void)voxel_downsample(cloud.points, 0.4, {.pick = voxel_representative::medoid_of_normals}),
      "representatives: there are no normals to compare; estimate them first", invalid_input);
}

TEST_CASE("neighbourhoods that are known give a cloud normals, seen from the world") {
  point_cloud<double, 3> cloud = test::bumpy_surface<test::d3>(300);
  cloud.origin = Eigen::Vector3d{500'000, 4'600'000, 0};
  const coordinates eye{500'000, 4'600'000, 100};
  const auto near = find_neighborhoods(kd_tree{cloud}, cloud, knn{10});
  const point_cloud<double, 3> found = estimate_normals(cloud, near, {.viewpoint = eye});
  CHECK(found.normals == estimate_normals(cloud, knn{10}, {.viewpoint = eye}).normals);
  const auto is_seen = [](const point_cloud<double, 3>& c) {
    const Eigen::Matrix3Xd to_eye = (-c.points).colwise() + Eigen::Vector3d{0, 0, 100};
    return (c.normals.array() * to_eye.array()).colwise().sum().minCoeff() >= 0;
  };
  CHECK(is_seen(found));
  const auto by = [](const auto& points, const auto& indices) {
    return mean_and_covariance(points, indices);
  };
  CHECK(is_seen(estimate_normals(cloud, near, by, {.viewpoint = eye})));
}

TEST_CASE("coordinates with and without an origin are not mixed") {
  point_cloud<double, 3> far = test::bumpy_surface<test::d3>(300);
  const point_cloud<double, 3> near = far;
  far.origin = Eigen::Vector3d{1000, 0, 0};
  const pinhole_camera<double> camera{4, 3, 5, 5, 2, 1};
  Eigen::Matrix3Xd normals = near.normals;
  const auto move = Eigen::Isometry3d::Identity();
  CHECK_THROWS_AS((void)transform_points(move, far), invalid_input);
  CHECK_THROWS_AS((void)project(far, camera), invalid_input);
  CHECK_THROWS_AS((void)project_depth(far, camera), invalid_input);
  CHECK_THROWS_AS((void)(voxel_grid{far, 1.0}), invalid_input);
  CHECK_THROWS_AS(orient_to_viewpoint(normals, far, {0, 0, 9}), invalid_input);
  CHECK_THROWS_AS(orient_consistently(normals, far, knn{5}, {.viewpoint = coordinates{0, 0, 9}}),
                  invalid_input);
  CHECK_THROWS_AS((void)(oriented_points_view{far}), invalid_input);
  CHECK_THROWS_AS((void)(nearest_neighbor_searcher{far, near}), invalid_input);
  CHECK_THROWS_AS((void)(point_to_point_estimator{near, far}), invalid_input);
  CHECK_THROWS_AS((void)(least_squares_estimator{near, far}), invalid_input);
  CHECK_THROWS_AS((void)rigid_family(near, far), invalid_input);
  // Of one origin, they fit each other.
  CHECK(icp(nearest_neighbor_searcher{far, far}, least_squares_estimator{far, far}, move).rmse ==
        0);
}

TEST_CASE("a family that needs normals takes them of the cloud") {
  const point_cloud<double, 3> cloud = test::bumpy_surface<test::d3>(300);
  const cylinder_family of_cloud{cloud}, of_both{cloud.points, cloud.normals};
  const index_list pair{3, 70};
  CHECK(of_cloud.fit(pair)->radius == of_both.fit(pair)->radius);
  const point_cloud<double, 3> bare{.points = cloud.points};
  CHECK_THROWS_AS((void)cylinder_family{bare}, invalid_input);
}

TEST_CASE("a type of the user's with normals registers as a cloud with normals does") {
  const auto target = test::bumpy_surface<test::d3>(800, 1);
  const auto source =
      transform(test::bumpy_surface<test::d3>(600, 3), test::random_rigid<test::d3>(1, 0.1, 0.1));
  const driver_scan onto = scan_of(target), moving = scan_of(source);
  const align_options options{.metric = symmetric{}, .max_distance = 0.8};
  const auto found = align(moving, onto, options);
  CHECK(found.transform.matrix() == align(source, target, options).transform.matrix());
  CHECK(found.transform.matrix() !=
        align(source.points, target.points, options).transform.matrix());
}
