// SPDX-License-Identifier: MIT
//
// Prints a hash of the bits of what the main functions give, a line each, for scripts/arm64.sh to
// compare machines by: fingerprint [DEPTH_IMAGE]
// What goes in is made of sums, products and square roots only, which every machine rounds alike.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <iostream>
#include <ranges>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

import cilantro;
import cilantro.visualization;
using namespace cilantro;

namespace {

/// FNV-1a over the bytes of numbers, wherever they stand.
class hash {
 public:
  template <class T>
    requires std::is_arithmetic_v<T>
  hash& operator<<(T value) {
    unsigned char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    for (const unsigned char byte : bytes) state_ = (state_ ^ byte) * 0x100000001b3;
    return *this;
  }
  template <class M>
  hash& operator<<(const Eigen::MatrixBase<M>& matrix) {
    const auto values = matrix.eval();
    for (Eigen::Index j = 0; j < values.cols(); ++j)
      for (Eigen::Index i = 0; i < values.rows(); ++i) *this << values(i, j);
    return *this;
  }
  template <std::ranges::range R>
    requires std::is_arithmetic_v<std::ranges::range_value_t<R>>
  hash& operator<<(const R& values) {
    for (const auto value : values) *this << value;
    return *this;
  }
  [[nodiscard]] std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325;
};

void report(const std::string& what, const hash& found) {
  std::printf("%016llx %s\n", static_cast<unsigned long long>(found.value()), what.c_str());
}

template <class S, int D>
std::string space(const std::string& input) {
  return input + (sizeof(S) == 4 ? " float " : " double ") +
         (D == dynamic ? std::string{"any"} : std::to_string(D)) + ": ";
}

/// A ball on a floor before a wall, with noise, seen from (0, 0, 3); more coordinates are noise.
template <class S, int D>
point_matrix<S, D> still_life(index_t n, index_t dimension, std::uint64_t seed) {
  point_matrix<S, D> points(dimension, n);
  random_stream random{seed};
  for (index_t i = 0; i < n; ++i) {
    double p[] = {random.uniform(-1, 1), random.uniform(-1, 1), 0};
    const double squared = p[0] * p[0] + p[1] * p[1];
    if (squared < 0.5) p[2] = std::sqrt(1 - squared);
    if (i % 3 == 0) p[2] = p[1] + 1, p[1] = 1;
    for (index_t d = 0; d < dimension; ++d)
      points(d, i) = static_cast<S>((d < 3 ? p[d] : 0.0) + 0.01 * random.uniform(-1, 1));
  }
  return points;
}

template <class S, int D>
void search_and_geometry(const std::string& input, const point_matrix<S, D>& points, double edge) {
  const auto name = space<S, D>(input);
  report(name + "input", hash{} << points);

  const kd_tree tree{points};
  const auto near = tree.find_all(as_points(points), knn{12}),
             within = tree.find_all(as_points(points), radius{2 * edge});
  report(name + "k nearest", hash{} << near.indices() << near.distances());
  report(name + "within a radius", hash{} << within.indices() << within.distances());

  report(name + "voxel_downsample", hash{} << voxel_downsample(points, edge));
  const auto normals = estimate_normals(points, knn{std::max<index_t>(12, points.rows())});
  report(name + "estimate_normals", hash{} << normals.normals << normals.curvature);
  const auto wide = estimate_normals(points, radius{2 * edge});
  report(name + "estimate_normals by radius", hash{} << wide.normals << wide.curvature);
  // Prepared by threads of their own while one is used.
  point_cloud<S, D> map;
  const index_t size = points.cols() / 5;
  const auto frame = [&](index_t i) {
    return point_cloud<S, D>{.points = points.middleCols(i * size, size)};
  };
  std::views::iota(index_t{0}, index_t{5}) | std::views::transform(frame) |
      each(remove_invalid() | voxel_downsample(edge), {.ahead = 3}) | accumulate_into(map);
  report(name + "frames ahead", hash{} << map.points);
  report(name + "statistical_outliers", hash{} << statistical_outliers(points).kept);
  report(name + "radius_outliers", hash{} << radius_outliers(points, {.radius = edge}).kept);

  const auto moments = mean_and_covariance(points);
  report(name + "mean_and_covariance", hash{} << moments->mean << moments->covariance);
  const auto robust = mean_and_covariance(points, minimum_covariance_determinant{});
  report(name + "minimum_covariance_determinant", hash{} << robust->mean << robust->covariance);
  report(name + "mahalanobis_distances", hash{} << mahalanobis_distances(points, *moments));
  const auto components = *principal_components(points);
  report(name + "principal_components", hash{} << components.eigenvalues << components.axes);
}

template <class S, int D>
void clustering(const std::string& input, const point_matrix<S, D>& points, double edge) {
  const auto name = space<S, D>(input);
  const auto means = kmeans(points, 20);
  report(name + "kmeans", hash{} << means.labels() << means.centroids << means.inertia);
  const auto medians = kmedians(points, 20);
  report(name + "kmedians", hash{} << medians.labels() << medians.centroids);
  const point_matrix<S, D> seeds{points.leftCols(100)};
  const auto modes = mean_shift(points, seeds, 5 * edge);
  report(name + "mean_shift", hash{} << modes.labels() << modes.modes << modes.densities);
  report(name + "dbscan", hash{} << dbscan(points, {.radius = edge}).labels());
  report(name + "connected_components",
         hash{} << connected_components(points, radius{edge}, always_similar{}).labels());
  const auto plane = ransac(hyperplane_family{points}, {.max_residual = 0.02});
  report(name + "ransac of planes", hash{} << plane->model.normal << plane->model.offset
                                           << plane->inliers << plane->score << plane->rmse);
}

template <class S, int D>
void registration(const std::string& input, const point_matrix<S, D>& points, double edge) {
  const auto name = space<S, D>(input);
  rigid_transform<S, D> motion = rigid_transform<S, D>::Identity();
  // (3, 4, 5) and (5, 12, 13) make rotations without a cosine; this one is by a degree or so.
  const double sine = 2.0 / 101 / (1 + 1.0 / 10201), cosine = std::sqrt(1 - sine * sine);
  motion.linear()(0, 0) = motion.linear()(1, 1) = S(cosine);
  motion.linear()(1, 0) = S(sine);
  motion.linear()(0, 1) = -S(sine);
  motion.translation().setConstant(S(edge / 4));
  const point_matrix<S, D> moved = transform_points(motion, points);
  report(name + "transform_points", hash{} << moved);

  const metric_choice metrics[] = {
      point_to_plane{}, point_to_point{}, symmetric{}, generalized_icp{},
      combined_metric{weighted_term{point_to_point{}, 0.1}, weighted_term{point_to_plane{}, 1}}};
  const char* const names[] = {"point to plane", "point to point", "symmetric", "generalised",
                               "combined"};
  for (const auto& metric : metrics) {
    const auto found =
        align(moved, points, {.metric = metric, .max_distance = 3 * edge, .max_iterations = 10});
    report(name + "align " + names[metric.index()], hash{} << found.transform.matrix() << found.rmse
                                                           << found.residual << found.information
                                                           << found.eigenvalues);
  }
  const auto robust = align(
      moved, points, {.scales = {{2 * edge, 6 * edge}, {0, 2 * edge}}, .robust = huber{edge / 4}});
  report(name + "align by scales, robust", hash{} << robust.transform.matrix() << robust.rmse);
  const auto affine = align<affine_motion>(moved, points, {.max_distance = 3 * edge});
  report(name + "align affine", hash{} << affine.transform.matrix() << affine.rmse);

  // A field that is bent by what it is fitted to: each coordinate pushes the next.
  point_matrix<S, D> pushed = moved;
  for (index_t i = 0; i < pushed.cols(); ++i)
    for (index_t d = 0; d < D; ++d)
      pushed(d, i) += S(0.25) * moved((d + 1) % D, i) * moved((d + 1) % D, i);
  correspondences<S> pairs;
  for (std::int32_t i = 0; i < pushed.cols(); ++i) pairs.push_back({i, i, 0});
  const deformation_graph graph{moved, {.spacing = 4 * edge}};
  const warp_estimator estimator{moved, pushed, graph, point_to_point{}, {.robust = huber{edge}}};
  auto field = estimator.identity();
  for (int i = 0; i < 3; ++i) field = estimator.estimate(field, pairs).transform;
  report(name + "warp_estimator", hash{} << moved_points(field, moved));
}

Eigen::MatrixXd distances_of(const Eigen::MatrixXd& points) {
  Eigen::MatrixXd all(points.cols(), points.cols());
  for (index_t j = 0; j < all.cols(); ++j)
    for (index_t i = 0; i < all.rows(); ++i)
      all(i, j) = std::sqrt((points.col(i) - points.col(j)).squaredNorm());
  return all;
}

template <int D>
Eigen::Transform<double, D, Eigen::Affine> scaling_by_half() {
  Eigen::Transform<double, D, Eigen::Affine> scaling =
      Eigen::Transform<double, D, Eigen::Affine>::Identity();
  scaling.linear() *= 0.5;
  return scaling;
}

template <class S, int D>
void spatial(const std::string& input, const point_matrix<S, D>& points) {
  const std::string name = space<S, D>(input);
  const auto hull = convex_hull(points);
  report(name + "convex_hull", hash{} << hull.indices() << hull.normals().matrix() << hull.offsets()
                                      << hull.volume() << hull.area());
  report(name + "contains_each", hash{} << hull.contains_each(points, -0.1));
  const auto again = intersect_half_spaces(hull.normals(), hull.offsets());
  report(name + "intersect_half_spaces", hash{} << again.vertices().matrix() << again.volume());
  const auto inner = transform_polytope(hull, scaling_by_half<D>());
  const space_region shell = hull - inner;
  report(name + "space_region", hash{} << shell.volume() << shell.contains_each(points));
  const auto ball = minimum_enclosing_ball(points);
  report(name + "minimum_enclosing_ball", hash{} << ball->center << ball->radius);
  const auto around = minimum_volume_box(points);
  report(name + "minimum_volume_box", hash{} << around->center << around->half_extents);
  const auto mesh = delaunay_triangulation(points);
  report(name + "delaunay_triangulation", hash{} << mesh.simplices << mesh.neighbors);
}

void embedding() {
  const auto points = still_life<double, 3>(700, 3, 5);
  // Of few points all eigenpairs are computed, of many the leading ones.
  for (const index_t n : {150, 700}) {
    const std::string count = std::to_string(n) + " points: ";
    const point_matrix<double, 3> some = points.leftCols(n);
    const auto found = multidimensional_scaling(distances_of(some), {.dimension = 3});
    report(count + "multidimensional_scaling", hash{} << found.points << found.eigenvalues);
    const auto walked = isomap(some, knn{8}, {.dimension = 2});
    report(count + "isomap", hash{} << walked.points << walked.eigenvalues);
    const auto graph = pair_matrix(neighbor_graph(some, knn{8}), distance_weight{});
    const auto cut = spectral_clustering(graph, {.clusters = 4});
    report(count + "spectral_clustering", hash{} << cut.labels() << cut.eigenvalues);
  }
}

/// A bit of everything that is drawn.
void pictures() {
  const auto points = still_life<float, 3>(20'000, 3, 1);
  triangle_batch veil{.points = points.leftCols(60), .opacity = 0.4};
  veil.triangles.resize(3, 20);
  for (int i = 0; i < 60; ++i) veil.triangles(i % 3, i / 3) = i;
  image<float> heights(20, 15);
  for (int i = 0; i < 300; ++i) heights.pixels()[i] = points(2, i);
  scene all;
  all.set("points", points, cloud_look{.color = by_coordinate{2}})
      .set("veil", veil)
      .set("edges", wireframe(veil))
      .set("name", label{"still life"})
      .set("heights", heights, image_look{.pixel_size = {0.1, 0.1}});
  for (const bool blend : {false, true}) {
    const auto picture = render(all, fit(all, {.width = 320, .height = 200}), {.blend = blend});
    hash found;
    for (const auto& pixel : picture.pixels()) found << pixel;
    report(blend ? "picture, mixed" : "picture", found);
  }
}

/// A grid whose nodes ask something of those beside them.
void block_systems() {
  constexpr std::int32_t edge = 20;
  std::vector<std::pair<std::int32_t, std::int32_t>> links;
  for (std::int32_t i = 0; i < edge * edge; ++i)
    for (const auto j : {i + 1, i + edge, i + edge + 1})
      if (j < edge * edge) links.emplace_back(i, j);
  const block_pattern pattern{edge * edge, links};
  for (const index_t block : {3, 5, 6}) {
    random_stream random{7};
    std::vector<double> values(pattern.blocks() * block * block);
    for (auto& v : values) v = random.uniform(-0.1, 0.1);
    for (index_t i = 0; i < pattern.nodes(); ++i)
      for (index_t k = 0; k < block; ++k)
        values[(pattern.slot(i, i) * block + k) * block + k] = i == 90 ? -1 : 2;
    const auto factor = block_cholesky{pattern, block}.factorize(values);
    Eigen::VectorXd x = Eigen::VectorXd::Ones(factor.size());
    factor.solve(x);
    report("block_cholesky, blocks of " + std::to_string(block),
           hash{} << x << factor.undetermined());
  }
}

/// From files into files, by threads that take one tile after the other.
void tiles() {
  const auto folder = std::filesystem::temp_directory_path() /
                      ("cilantro-fingerprint-" + std::to_string(::getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  point_cloud<double, 3> cloud{.points = 10 * still_life<double, 3>(20'000, 3, 1)};
  write_ply(cloud, folder / "cloud.ply");
  const auto survey = open_tiles<float>(folder / "cloud.ply", {.edge = 4});
  const auto thin = survey | voxel_downsample(0.2) | remove_statistical_outliers() |
                    estimate_normals(knn{10}) | write_tiles(folder / "thin");
  const auto all = thin.read();
  report("tiles, thinned, without outliers, with normals", hash{} << all.points << all.normals);
  const auto clusters = thin | write_clusters(folder / "clusters", radius{0.3});
  report("tiles, components", hash{} << clusters.read().attribute_as<std::int32_t>("cluster"));
  std::filesystem::remove_all(folder);
}

template <class S, int D>
void everything(const std::string& input, const point_matrix<S, D>& points, double edge) {
  search_and_geometry<S, D>(input, points, edge);
  clustering<S, D>(input, points, edge);
  if constexpr (D == 2 || D == 3) {
    registration<S, D>(input, points, edge);
    spatial<S, D>(input, points);
  }
}

}  // namespace

int main(int count, char** arguments) try {
  everything<float, 2>("still life", still_life<float, 2>(4'000, 2, 1), 0.03);
  everything<double, 2>("still life", still_life<double, 2>(4'000, 2, 1), 0.03);
  everything<float, 3>("still life", still_life<float, 3>(10'000, 3, 1), 0.05);
  everything<double, 3>("still life", still_life<double, 3>(10'000, 3, 1), 0.05);
  everything<float, dynamic>("still life", still_life<float, dynamic>(4'000, 6, 1), 0.05);
  everything<double, dynamic>("still life", still_life<double, dynamic>(4'000, 6, 1), 0.05);
  everything<double, dynamic>("still life of 30", still_life<double, dynamic>(2'000, 30, 1), 0.07);
  embedding();
  block_systems();
  tiles();
  pictures();
  if (count > 1) {
    const pinhole_camera<double> camera{640, 480, 585, 585, 320, 240};
    const auto depth = read_depth_png(arguments[1]);
    const auto scan = cloud_from_depth(depth, camera) | remove_invalid();
    const point_matrix<double, 3> points = voxel_downsample(scan.points, 0.02);
    everything<double, 3>("scan", points, 0.03);
    everything<float, 3>("scan", points.cast<float>(), 0.03);
  }
} catch (const std::exception& error) {
  std::cerr << "fingerprint: " << error.what() << '\n';
  return 1;
}
