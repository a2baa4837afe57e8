// SPDX-License-Identifier: MIT
//
// Every public function with what cannot be: sizes and dimensions that do not fit each other,
// indices that nobody has, numbers that are none. Sizes are those of run time, which no compiler
// sees, and the address sanitizer looks on.
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

using run_time_isometry = run_time_transform<double, Eigen::Isometry>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct wrong_call {
  std::string name;
  std::function<void()> call;
};

void check_refused(const std::vector<wrong_call>& calls) {
  for (const auto& [name, call] : calls) {
    INFO(name);
    CHECK_THROWS_AS(call(), invalid_input);
  }
}

/// Points of some dimension that is known at run time only.
Eigen::MatrixXd points_of(index_t dimension, index_t count) {
  random_stream random{static_cast<std::uint64_t>(10 * dimension + count)};
  return Eigen::MatrixXd::NullaryExpr(dimension, count, [&] { return random.uniform(); });
}

const Eigen::MatrixXd eight = points_of(3, 8), seven = points_of(3, 7), flat = points_of(2, 8);
const Eigen::Matrix3Xd points = eight;
const Eigen::Matrix3Xd normals = points.colwise().normalized();
const Eigen::Matrix3Xd few_normals = normals.leftCols(7);
const std::vector<std::int32_t> far_index{8}, negative_index{-1};
const std::vector<std::int32_t> eight_labels(8, 0), seven_labels(7, 0);

point_cloud<double, 3> broken_cloud() {
  point_cloud<double, 3> cloud{.points = points};
  cloud.normals = few_normals;
  return cloud;
}
point_cloud<double, 3> labelled_cloud() {
  point_cloud<double, 3> cloud{.points = points};
  cloud.set_attribute("label", eight_labels);
  return cloud;
}

}  // namespace

static_assert(std::is_constructible_v<robust_kernel, huber>);
static_assert(!std::is_constructible_v<robust_kernel, gaussian_kernel>);

TEST_CASE("wrong arguments are refused: points, transforms, decompositions, randomness") {
  const run_time_isometry in_3d = identity_transform<run_time_isometry>(3);
  Eigen::MatrixXd out(3, 7);
  check_refused({
      {"transform_points, dimension", [&] { (void)transform_points(in_3d, flat); }},
      {"transform_normals, dimension", [&] { (void)transform_normals(in_3d, flat); }},
      {"make_transform",
       [&] { (void)make_transform<run_time_isometry>(eight, Eigen::Vector3d(0, 0, 0)); }},
      {"identity_transform", [&] { (void)identity_transform<run_time_isometry>(-1); }},
      {"nearest_rotation", [&] { (void)nearest_rotation(eight); }},
      {"determinant", [&] { (void)determinant(eight); }},
      {"solve", [&] { (void)solve(Eigen::MatrixXd::Identity(3, 3), flat); }},
      {"solve_symmetric", [&] { (void)solve_symmetric(Eigen::MatrixXd::Identity(3, 3), flat); }},
      {"solve_least_squares", [&] { (void)solve_least_squares(eight, flat.topRows(1)); }},
      {"largest_eigenpairs, square", [&] { (void)largest_eigenpairs(eight, 1); }},
      {"largest_eigenpairs, count",
       [&] { (void)largest_eigenpairs(Eigen::MatrixXd::Identity(3, 3), 4); }},
      {"largest_eigenpairs, negative",
       [&] { (void)largest_eigenpairs(Eigen::MatrixXd::Identity(3, 3), -1); }},
      {"angle_between", [&] { (void)angle_between(eight.col(0), flat.col(0)); }},
      {"image", [&] { (void)image<float>(-1, 2); }},
      {"image_view, stride", [&] { (void)image_view<float>{nullptr, 3, 2}; }},
      {"random_indices", [&] { (void)random_indices(8, -1); }},
      {"uniform_indices", [&] { (void)uniform_indices(8, -1); }},
      {"positive", [&] { (void)positive{nan}; }},
      {"depth_scale", [&] { (void)depth_scale{0}; }},
      {"transform, out", [&] { transform_points(in_3d, eight, out); }},
  });
}

TEST_CASE("wrong arguments are refused: searches and graphs") {
  const kd_tree tree{eight};
  const brute_force_searcher brute{eight};
  const auto none = [](const neighborhood_block<double>&) {};
  std::vector<neighbor<double>> found;
  check_refused({
      {"kd_tree::find", [&] { (void)tree.find(flat.col(0), knn{1}); }},
      {"brute_force_searcher::find", [&] { (void)brute.find(flat.col(0), knn{1}, found); }},
      {"find_neighborhoods, dimension", [&] { (void)find_neighborhoods(tree, flat, knn{1}); }},
      {"find_neighborhoods, brute", [&] { (void)find_neighborhoods(brute, flat, knn{1}); }},
      {"find_neighborhoods, k", [&] { (void)find_neighborhoods(tree, eight, knn{0}); }},
      {"find_neighborhoods, radius", [&] { (void)find_neighborhoods(tree, eight, radius{nan}); }},
      {"find_neighborhoods, negative", [&] { (void)find_neighborhoods(tree, eight, radius{-1}); }},
      {"find_neighborhoods, both",
       [&] { (void)find_neighborhoods(tree, eight, knn_in_radius{0, 1}); }},
      {"visit_neighborhoods", [&] { visit_neighborhoods(tree, points_in(flat), knn{1}, none); }},
      {"neighbor_graph", [&] { (void)neighbor_graph(tree, flat, knn{1}); }},
      {"adjacency_matrix of queries",
       [&] { (void)adjacency_matrix(find_neighborhoods(tree, eight.leftCols(2), knn{8})); }},
      {"distance_matrix of queries",
       [&] { (void)distance_matrix(find_neighborhoods(tree, eight.leftCols(2), knn{8})); }},
      {"close_points, nothing", [&] { (void)close_points{eight, nan}; }},
      {"close_points, sizes", [&] { (void)close_points{eight, flat, 0.1}; }},
      {"similar_normals, degrees", [&] { (void)similar_normals{normals, 30}; }},
      {"similar_normals, nan", [&] { (void)similar_normals{normals, nan}; }},
      {"kd_tree, leaf size", [&] { (void)kd_tree{eight, {.max_leaf_size = 0}}; }},
  });
}

TEST_CASE("wrong arguments are refused: moments, normals, samples, grids, cameras") {
  const auto near = find_neighborhoods(kd_tree{points}, few_normals, knn{3});
  const voxel_grid grid{points, 0.5};
  const auto moments = mean_and_covariance(flat);
  const pinhole_camera<double> camera{4, 2, 5, 5, 2, 1};
  const pinhole_camera<double> no_camera{4, 2, 0, 5, 2, 1};
  Eigen::Matrix3Xd turned = normals;
  Eigen::Matrix3Xd turned_few = few_normals;
  const image<std::uint16_t> depth(4, 2, 1000), other(3, 2, 1000);
  check_refused({
      {"mean_and_covariance, far", [&] { (void)mean_and_covariance(points, far_index); }},
      {"mean_and_covariance, negative", [&] { (void)mean_and_covariance(points, negative_index); }},
      {"mahalanobis_distances", [&] { (void)mahalanobis_distances(eight, moments.value()); }},
      {"principal_components, far", [&] { (void)principal_components(points, far_index); }},
      {"chi_square_quantile", [&] { (void)chi_square_quantile(2, 3); }},
      {"chi_square_quantile, freedom", [&] { (void)chi_square_quantile(0.5, 0); }},
      {"chi_square_probability", [&] { (void)chi_square_probability(nan, 3); }},
      {"estimate_normals, neighbourhoods", [&] { (void)estimate_normals(points, near); }},
      {"estimate_normals, viewpoint",
       [&] { (void)estimate_normals(points, knn{3}, {.viewpoint = coordinates{1, 2}}); }},
      {"orient_to_viewpoint, dimension", [&] { orient_to_viewpoint(turned, points, {1, 2}); }},
      {"orient_to_viewpoint, sizes", [&] { orient_to_viewpoint(turned_few, points, {1, 2, 3}); }},
      {"orient_to_reference", [&] { orient_to_reference(turned_few, normals); }},
      {"orient_consistently", [&] { (void)orient_consistently(turned_few, points, knn{3}); }},
      {"orient_consistently, graph", [&] { (void)orient_consistently(turned, points, near); }},
      {"statistical_outliers, k", [&] { (void)statistical_outliers(points, {.neighbors = 0}); }},
      {"statistical_outliers, ratio",
       [&] { (void)statistical_outliers(points, {.deviations = nan}); }},
      {"radius_outliers, radius", [&] { (void)radius_outliers(points, {.radius = nan}); }},
      {"radius_outliers, count",
       [&] { (void)radius_outliers(points, {.radius = 1, .min_neighbors = -1}); }},
      {"farthest_point_sample", [&] { (void)farthest_point_sample(points, -1); }},
      {"farthest_point_sample, first",
       [&] { (void)farthest_point_sample(points, 2, {.first = 8}); }},
      {"voxel_grid, nan", [&] { (void)voxel_grid{points, nan}; }},
      {"voxel_grid, negative", [&] { (void)voxel_grid{points, -1.0}; }},
      {"voxel_grid, edges", [&] { (void)voxel_grid{eight, coordinates{1.0, 2.0}}; }},
      {"voxel_downsample", [&] { (void)voxel_downsample(eight, coordinates{1.0, 2.0}); }},
      {"group_means", [&] { (void)group_means(seven, grid.groups()); }},
      {"group_directions", [&] { (void)group_directions(few_normals, grid.groups()); }},
      {"nearest_to_centers", [&] { (void)nearest_to_centers(points.leftCols(7), grid); }},
      {"medoids_of_normals", [&] { (void)medoids_of_normals(few_normals, grid.groups()); }},
      {"unproject", [&] { (void)unproject(other, camera); }},
      {"unproject, focal length", [&] { (void)unproject(depth, no_camera); }},
      {"organized_normals", [&] { (void)organized_normals(points.leftCols(7).eval(), camera); }},
      {"project", [&] { (void)project(points, no_camera); }},
      {"project, size", [&] { (void)project(points, camera, {.point_size = nan}); }},
      {"project_depth", [&] { (void)project_depth(points, no_camera); }},
      {"cloud_from_depth", [&] { (void)cloud_from_depth(other, camera); }},
      {"cloud_from_rgbd", [&] { (void)cloud_from_rgbd(depth, image<rgb>(3, 2), camera); }},
      {"truncated_depth", [&] { (void)truncated_depth{2, 1}; }},
      {"truncated_depth, nan", [&] { (void)truncated_depth{nan, 1}; }},
  });
}

TEST_CASE("wrong arguments are refused: clouds and files") {
  const test::temporary_folder folder;
  const auto broken = broken_cloud();
  const auto cloud = labelled_cloud();
  const point_cloud<double, 3> bare{.points = points};
  point_cloud<double, 3> changed = bare;
  check_refused({
      {"select, far", [&] { (void)select(cloud, far_index); }},
      {"select, negative", [&] { (void)select(cloud, negative_index); }},
      {"select, mask", [&] { (void)select(cloud, std::vector<bool>(7)); }},
      {"exclude, mask", [&] { (void)exclude(cloud, std::vector<bool>(9)); }},
      {"append", [&] { (void)append(cloud, bare); }},
      {"set_attribute", [&] { changed.set_attribute("label", seven_labels); }},
      {"random_sample", [&] { (void)random_sample(cloud, -1); }},
      {"uniform_sample", [&] { (void)uniform_sample(cloud, -1); }},
      {"farthest_point_sample", [&] { (void)farthest_point_sample(cloud, -1); }},
      {"orient_to_viewpoint, none", [&] { (void)orient_to_viewpoint(bare, {0, 0, 0}); }},
      {"orient_consistently, none", [&] { (void)orient_consistently(bare, knn{3}); }},
      {"align_to, nothing to align", [&] { (void)align_to(cloud, cloud, {.max_iterations = -1}); }},
      {"write_ply", [&] { write_ply(broken, folder / "a.ply"); }},
      {"write_pcd", [&] { write_pcd(broken, folder / "a.pcd"); }},
      {"write_text", [&] { write_text(broken, folder / "a.xyz"); }},
      {"write_pts", [&] { write_pts(broken, folder / "a.pts"); }},
      {"select, broken", [&] { (void)select(broken, eight_labels); }},
      {"remove_invalid, broken", [&] { (void)remove_invalid(broken); }},
      {"transform, broken", [&] { (void)transform(broken, Eigen::Isometry3d::Identity()); }},
      {"append, broken", [&] { (void)append(broken, broken); }},
      {"cast, broken", [&] { (void)cast<float>(broken); }},
      {"voxel_downsample, broken", [&] { (void)voxel_downsample(broken, 0.1); }},
      {"orient_to_viewpoint, broken", [&] { (void)orient_to_viewpoint(broken, {0, 0, 0}); }},
      {"orient_consistently, broken", [&] { (void)orient_consistently(broken, knn{3}); }},
      {"remove_statistical_outliers, broken",
       [&] { (void)remove_statistical_outliers(broken, {.neighbors = 3}); }},
      {"random_sample, broken", [&] { (void)random_sample(broken, 3); }},
      {"write_png", [&] { write_png(image<rgb>{}, folder / "a.png"); }},
  });
  CHECK(folder.count() == 0);
}

TEST_CASE("wrong arguments are refused: clusters and embeddings") {
  const auto graph = find_neighborhoods(kd_tree{points}, points, knn{3});
  const auto queries = find_neighborhoods(kd_tree{points}, few_normals, knn{3});
  const Eigen::Matrix3Xf colors = Eigen::Matrix3Xf::Zero(3, 9);
  const Eigen::MatrixXd affinity = Eigen::MatrixXd::Ones(4, 4),
                        oblong = Eigen::MatrixXd::Ones(4, 3);
  check_refused({
      {"connected_components, searcher",
       [&] { (void)connected_components(kd_tree{eight}, flat, knn{2}); }},
      {"connected_components, normals",
       [&] { (void)connected_components(points, knn{2}, similar_normals{few_normals, 0.1}); }},
      {"connected_components, colours",
       [&] { (void)connected_components(graph, similar_colors{colors, 0.1}); }},
      {"connected_components, several",
       [&] {
         (void)connected_components(
             points, knn{2},
             all_similar{close_points{points, 1}, similar_normals{few_normals, 0.1}});
       }},
      {"pair_matrix", [&] { (void)pair_matrix(graph, similar_normals{few_normals, 0.1}); }},
      {"connected_components, graph", [&] { (void)connected_components(queries); }},
      {"connected_components, size",
       [&] {
         (void)connected_components(points, knn{2}, always_similar{}, {.min_cluster_size = -1});
       }},
      {"dbscan, radius", [&] { (void)dbscan(points, {.radius = nan, .min_points = 3}); }},
      {"dbscan, count", [&] { (void)dbscan(points, {.radius = 1, .min_points = 0}); }},
      {"dbscan, searcher",
       [&] { (void)dbscan(kd_tree{eight}, flat, {.radius = 1, .min_points = 3}); }},
      {"hdbscan, queries", [&] { (void)hdbscan(queries); }},
      {"hdbscan, size", [&] { (void)hdbscan(points, knn{3}, {.min_cluster_size = 0}); }},
      {"kmeans, 0", [&] { (void)kmeans(points, 0); }},
      {"kmeans, too many", [&] { (void)kmeans(points, 9); }},
      {"kmeans, dimension", [&] { (void)kmeans(eight, flat); }},
      {"kmeans, tolerance", [&] { (void)kmeans(points, 2, {.tolerance = nan}); }},
      {"kmedians, 0", [&] { (void)kmedians(points, 0); }},
      {"kmedians, dimension", [&] { (void)kmedians(eight, flat); }},
      {"mean_shift, bandwidth", [&] { (void)mean_shift(points, nan); }},
      {"mean_shift, seeds", [&] { (void)mean_shift(eight, flat, 0.5); }},
      {"mean_shift, kernel",
       [&] { (void)mean_shift(points, 0.5, custom_kernel{[](double) { return -1.0; }, 1.0}); }},
      {"mean_shift, kernel of nothing",
       [&] { (void)mean_shift(points, 0.5, custom_kernel{[](double) { return nan; }, 1.0}); }},
      {"adjusted_rand_index", [&] { (void)adjusted_rand_index(eight_labels, seven_labels); }},
      {"normalized_mutual_information",
       [&] { (void)normalized_mutual_information(eight_labels, seven_labels); }},
      {"silhouettes", [&] { (void)silhouettes(points, seven_labels); }},
      {"silhouette", [&] { (void)silhouette(points, seven_labels); }},
      {"spectral_clustering, oblong", [&] { (void)spectral_clustering(oblong, {.clusters = 2}); }},
      {"spectral_clustering, count", [&] { (void)spectral_clustering(affinity, {.clusters = 5}); }},
      {"isomap, queries", [&] { (void)isomap(queries); }},
      {"isomap, dimension", [&] { (void)isomap(points, knn{3}, {.dimension = 0}); }},
      {"multidimensional_scaling, oblong", [&] { (void)multidimensional_scaling(oblong); }},
      {"shortest_paths, queries", [&] { (void)shortest_paths(queries); }},
  });
}

TEST_CASE("wrong arguments are refused: models and registration") {
  using rigid = Eigen::Isometry3d;
  const auto move = rigid::Identity();
  const kd_tree tree{points};
  const correspondences<double> far_pairs{{8, 0, 0.0}}, negative_pairs{{0, -1, 0.0}};
  const nearest_neighbor_searcher nearest{points, points};
  const point_to_point_estimator estimator{points, points};
  auto pairs = far_pairs;
  check_refused({
      {"cylinder_family", [&] { (void)cylinder_family{points, few_normals}; }},
      {"ransac, nan", [&] { (void)ransac(hyperplane_family{points}, {.max_residual = nan}); }},
      {"ransac, negative", [&] { (void)ransac(hyperplane_family{points}, {.max_residual = -1}); }},
      {"ransac, iterations",
       [&] { (void)ransac(hyperplane_family{points}, {.max_residual = 1, .max_iterations = -1}); }},
      {"ransac, confidence",
       [&] { (void)ransac(hyperplane_family{points}, {.max_residual = 1, .confidence = 2}); }},
      {"sequential_ransac",
       [&] { (void)sequential_ransac(hyperplane_family{points}, -1, {.max_residual = 1}); }},
      {"rigid_family, far", [&] { (void)rigid_family(points, points, far_pairs); }},
      {"rigid_family, negative", [&] { (void)rigid_family(points, points, negative_pairs); }},
      {"rigid_family, dimension",
       [&] { (void)rigid_family(eight, flat, correspondences<double>{{0, 0, 0.0}}); }},
      {"align, dimension", [&] { (void)align(eight, flat); }},
      {"align, distance", [&] { (void)align(points, points, {.scales = {{0.0, nan}}}); }},
      {"align, scales and distance",
       [&] { (void)align(points, points, {.max_distance = 1, .scales = {{0.1, 0.5}}}); }},
      {"align, from fine to coarse",
       [&] { (void)align(points, points, {.scales = {{0.1, 0.5}, {0.2, 0.6}}}); }},
      {"align, voxel and distance swapped",
       [&] { (void)align(points, points, {.scales = {{0.5, 0.1}}}); }},
      {"align, rows as points",
       [&] {
         const Eigen::MatrixXf rows = Eigen::MatrixXf::Random(100, 3);
         (void)align(rows, rows, {.metric = point_to_point{}});
       }},
      {"align, a kernel that gives negative weights",
       [&] {
         (void)align(points, points,
                     {.metric = point_to_point{}, .robust = [](double) { return -1.0; }});
       }},
      {"align, voxel", [&] { (void)align(points, points, {.scales = {{nan, 1.0}}}); }},
      {"align, iterations", [&] { (void)align(points, points, {.max_iterations = -1}); }},
      {"align, fraction", [&] { (void)align(points, points, {.fraction = 2}); }},
      {"align, initial",
       [&] { (void)align(points, points, {.initial = rigid{Eigen::Translation3d{nan, 0, 0}}}); }},
      {"align, normals", [&] { (void)align(oriented_points_view{points, few_normals}, points); }},
      {"evaluate, dimension",
       [&] { (void)evaluate(eight, flat, identity_transform<run_time_isometry>(3)); }},
      {"nearest_neighbor_searcher, dimension",
       [&] { (void)nearest_neighbor_searcher{eight, flat}; }},
      {"nearest_neighbor_searcher, distance",
       [&] { (void)nearest_neighbor_searcher{points, points, {.max_distance = nan}}; }},
      {"known_pairs_searcher, far", [&] { (void)known_pairs_searcher{points, points, far_pairs}; }},
      {"known_pairs_searcher, negative",
       [&] { (void)known_pairs_searcher{points, points, negative_pairs}; }},
      {"projective_searcher",
       [&] {
         (void)projective_searcher{points, points, pinhole_camera<double>{4, 2, 0, 5, 2, 1}};
       }},
      {"point_to_point_estimator, dimension", [&] { (void)point_to_point_estimator{eight, flat}; }},
      {"point_to_point_estimator, pairs", [&] { (void)estimator.estimate(move, far_pairs); }},
      {"least_squares_estimator, normals", [&] { (void)least_squares_estimator{points, points}; }},
      {"least_squares_estimator, weight",
       [&] { (void)least_squares_estimator{points, points, weighted_term{point_to_point{}, -1}}; }},
      {"least_squares_estimator, weight of a part",
       [&] {
         (void)least_squares_estimator{
             points, points,
             combined_metric{point_to_point{}, weighted_term{point_to_point{}, nan}}};
       }},
      {"least_squares_estimator, pairs",
       [&] {
         (void)least_squares_estimator{
             points, points, weighted_term{point_to_point{}, 1, close_points{few_normals, 1}}};
       }},
      {"point_to_point_estimator, weights",
       [&] {
         (void)point_to_point_estimator{points, points, rigid_motion{},
                                        close_points{few_normals, points, 1}};
       }},
      {"feature_searcher, judge",
       [&] {
         (void)feature_searcher{
             point_features{points, points}, {}, close_points{points, few_normals, 1}};
       }},
      {"feature_searcher, judge of features",
       [&] {
         (void)feature_searcher{
             point_features{points, points}, {}, point_features{few_normals, points}};
       }},
      {"least_squares_estimator, dimension", [&] { (void)least_squares_estimator{eight, flat}; }},
      {"icp, iterations", [&] { (void)icp(nearest, estimator, move, {.max_iterations = -1}); }},
      {"icp, initial",
       [&] { (void)icp(nearest, estimator, rigid{Eigen::Translation3d{nan, 0, 0}}); }},
      {"select_correspondences", [&] { select_correspondences(pairs, {.fraction = nan}); }},
  });
}
