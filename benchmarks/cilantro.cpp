// SPDX-License-Identifier: MIT
#include <cmath>
#include <numeric>
#include <vector>

#include "common.hpp"

import cilantro;
using namespace cilantro;

namespace {

points_view<float, 3> points() {
  return {frame().data(), std::ssize(frame()) / 3};
}

void tree_build(benchmark::State& state) {
  for (auto _ : state) {
    const kd_tree tree{points()};
    benchmark::DoNotOptimize(tree.size());
  }
  report_result(state, double(points().size()));
}
CILANTRO_BENCHMARK(tree_build);

points_view<double, 3> points_in_double() {
  static const Eigen::Matrix3Xd made = points().matrix().cast<double>();
  return as_points(made);
}

template <class Spec, class P>
void search(benchmark::State& state, Spec spec, const P& points) {
  const kd_tree tree{points};
  double sum = 0;
  for (auto _ : state) {
    const auto found = tree.find_all(points, spec);
    benchmark::DoNotOptimize(found.distances().data());
    state.PauseTiming();
    sum = std::accumulate(found.distances().begin(), found.distances().end(), 0.0);
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void knn_of_all(benchmark::State& state) {
  search(state, knn{neighbor_count}, points());
}
CILANTRO_BENCHMARK(knn_of_all);
void knn_of_all_in_double(benchmark::State& state) {
  search(state, knn{neighbor_count}, points_in_double());
}
CILANTRO_BENCHMARK(knn_of_all_in_double);
void knn_30_of_all(benchmark::State& state) {
  search(state, knn{many_neighbors}, points());
}
CILANTRO_BENCHMARK(knn_30_of_all);
void radius_of_all(benchmark::State& state) {
  search(state, radius{voxel_edge}, points());
}
CILANTRO_BENCHMARK(radius_of_all);

/// In any order and not kept: only the sum of the distances of each point.
void radius_any_order(benchmark::State& state) {
  const kd_tree tree{points()};
  std::vector<float> sums(static_cast<std::size_t>(points().size()));
  for (auto _ : state) {
    visit_neighborhoods(tree, points(), radius{voxel_edge},
                        [&](const auto& block) {
                          for (index_t i = 0; i < block.size(); ++i) {
                            float sum = 0;
                            for (const float distance : block[i].distances()) sum += distance;
                            sums[static_cast<std::size_t>(block.query(i))] = sum;
                          }
                        },
                        {.ascending = false});
  }
  report_result(state, std::accumulate(sums.begin(), sums.end(), 0.0));
}
CILANTRO_BENCHMARK(radius_any_order);

template <class P, class Spec>
void normals_of(benchmark::State& state, const P& points, Spec spec) {
  double sum = 0;
  for (auto _ : state) {
    const auto found = estimate_normals(points, spec, {.viewpoint = {{0, 0, 0}}});
    benchmark::DoNotOptimize(found.normals.data());
    state.PauseTiming();
    sum = 0;
    for (const auto z : found.normals.row(2))
      if (!std::isnan(z)) sum += std::abs(double(z));
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void normals(benchmark::State& state) {
  normals_of(state, points(), knn{neighbor_count});
}
CILANTRO_BENCHMARK(normals);
void normals_in_double(benchmark::State& state) {
  normals_of(state, points_in_double(), knn{neighbor_count});
}
CILANTRO_BENCHMARK(normals_in_double);
void normals_by_radius(benchmark::State& state) {
  normals_of(state, points(), radius{voxel_edge});
}
CILANTRO_BENCHMARK(normals_by_radius);

points_view<float, 3> view_of(const std::vector<float>& all) {
  return {all.data(), std::ssize(all) / 3};
}

void voxels_of(benchmark::State& state, points_view<float, 3> points, float edge) {
  double count = 0;
  for (auto _ : state) {
    const auto reduced = voxel_downsample(points, double(edge));
    benchmark::DoNotOptimize(reduced.data());
    count = double(reduced.cols());
  }
  report_result(state, count);
}
void voxels(benchmark::State& state) {
  voxels_of(state, points(), voxel_edge);
}
CILANTRO_BENCHMARK(voxels);
void voxels_5_mm(benchmark::State& state) {
  voxels_of(state, points(), small_voxel_edge);
}
CILANTRO_BENCHMARK(voxels_5_mm);
void large_voxels(benchmark::State& state) {
  voxels_of(state, view_of(large_points()), large_voxel_edge);
}
CILANTRO_BENCHMARK(large_voxels);

void large_transform(benchmark::State& state) {
  const point_cloud<float, 3> large{.points = view_of(large_points()).matrix()};
  Eigen::Isometry3f turn = Eigen::Isometry3f::Identity();
  turn.linear() = Eigen::AngleAxisf{0.3f, Eigen::Vector3f::UnitZ()}.toRotationMatrix();
  double last = 0;
  for (auto _ : state) {
    const auto moved = transform(large, turn);
    benchmark::DoNotOptimize(moved.points.data());
    last = double(moved.points(0, moved.size() - 1));
  }
  report_result(state, last);
}
CILANTRO_BENCHMARK(large_transform);

/// Six choices of points of a cloud with ten attributes: each by itself, or all in one pass.
template <class Choose>
void choices_of(benchmark::State& state, const Choose& choose) {
  point_cloud<float, 3> cloud{.points = view_of(large_points()).matrix()};
  for (int a = 0; a < 10; ++a)
    cloud.set_attribute("attribute " + std::to_string(a), std::vector<float>(cloud.size(), 1.0f));
  index_t left = 0;
  for (auto _ : state) {
    const auto chosen = choose(cloud);
    benchmark::DoNotOptimize(chosen.points.data());
    left = chosen.size();
  }
  report_result(state, double(left));
}
const auto middle = [](const Eigen::Vector3d& p) { return std::abs(p.x()) < 2; };
const auto not_the_tenth = [](index_t i) { return i % 10 != 0; };
const auto not_the_first = exclude(std::vector{0, 1, 2});
void choices_one_by_one(benchmark::State& state) {
  choices_of(state, [](const auto& cloud) {
    return cloud | remove_invalid() | crop(middle) | select(not_the_tenth) | not_the_first |
           take(700'000) | stride(2);
  });
}
CILANTRO_BENCHMARK(choices_one_by_one);
void choices_in_one_pass(benchmark::State& state) {
  choices_of(state, [](const auto& cloud) {
    return cloud | (remove_invalid() | crop(middle) | select(not_the_tenth) | not_the_first |
                    take(700'000) | stride(2));
  });
}
CILANTRO_BENCHMARK(choices_in_one_pass);

void ply_read(benchmark::State& state) {
  double sum = 0;
  for (auto _ : state) {
    const auto cloud = read_ply<float>(data_path("large.ply"));
    benchmark::DoNotOptimize(cloud.points.data());
    state.PauseTiming();
    sum = cloud.points.cast<double>().sum();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(ply_read);

void ply_write(benchmark::State& state) {
  const auto cloud = read_ply<float>(data_path("large.ply"));
  for (auto _ : state) write_ply(cloud, data_path("written_by_cilantro.ply"));
  report_result(state, double(cloud.size()));
}
CILANTRO_BENCHMARK(ply_write);

void las_read(benchmark::State& state) {
  double sum = 0;
  for (auto _ : state) {
    const auto cloud = read_las<float>(data_path("large.las"));
    benchmark::DoNotOptimize(cloud.points.data());
    state.PauseTiming();
    sum = cloud.points.cast<double>().sum();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(las_read);

void las_write(benchmark::State& state) {
  const auto cloud = read_las<float>(data_path("large.las"));
  for (auto _ : state) write_las(cloud, data_path("written_by_cilantro.las"));
  report_result(state, double(cloud.size()));
}
CILANTRO_BENCHMARK(las_write);

void outliers(benchmark::State& state) {
  double count = 0;
  for (auto _ : state) {
    const auto found = statistical_outliers(
        points(), {.neighbors = outlier_neighbors, .deviations = outlier_deviations});
    benchmark::DoNotOptimize(found.kept.data());
    count = double(found.kept.size());
  }
  report_result(state, count);
}
CILANTRO_BENCHMARK(outliers);

/// From the tree to the last label; the result is how many points are in a part.
void segment(benchmark::State& state) {
  const auto large = view_of(large_points()), normals = view_of(large_normals());
  double labeled = 0;
  for (auto _ : state) {
    const auto parts =
        connected_components(large, knn{segment_neighbors},
                             similar_normals{normals, segment_angle, {.ignore_sign = true}},
                             {.min_cluster_size = segment_min_size});
    benchmark::DoNotOptimize(parts.labels().data());
    labeled = double(large.size() - parts.unlabeled());
  }
  report_result(state, labeled);
}
CILANTRO_BENCHMARK(segment);

/// The same with the neighbours given.
void segment_graph(benchmark::State& state) {
  const auto large = view_of(large_points()), normals = view_of(large_normals());
  const auto graph = find_neighborhoods(kd_tree{large}, large, knn{segment_neighbors});
  double labeled = 0;
  for (auto _ : state) {
    const auto parts =
        connected_components(graph, similar_normals{normals, segment_angle, {.ignore_sign = true}},
                             {.min_cluster_size = segment_min_size});
    benchmark::DoNotOptimize(parts.labels().data());
    labeled = double(large.size() - parts.unlabeled());
  }
  report_result(state, labeled);
}
CILANTRO_BENCHMARK(segment_graph);

void euclidean_parts(benchmark::State& state) {
  double labeled = 0;
  for (auto _ : state) {
    const auto parts = connected_components(points(), radius{density_radius}, always_similar{},
                                            {.min_cluster_size = segment_min_size});
    benchmark::DoNotOptimize(parts.labels().data());
    labeled = double(points().size() - parts.unlabeled());
  }
  report_result(state, labeled);
}
CILANTRO_BENCHMARK(euclidean_parts);

void density(benchmark::State& state) {
  double labeled = 0;
  for (auto _ : state) {
    const auto found = dbscan(points(), {.radius = density_radius, .min_points = density_points});
    benchmark::DoNotOptimize(found.labels().data());
    labeled = double(points().size() - found.unlabeled());
  }
  report_result(state, labeled);
}
CILANTRO_BENCHMARK(density);

/// Twenty iterations from points spread over the cloud by their index.
void kmeans_100(benchmark::State& state) {
  Eigen::Matrix3Xf start(3, kmeans_clusters);
  for (index_t c = 0; c < kmeans_clusters; ++c)
    start.col(c) = points()[c * (points().size() / kmeans_clusters)];
  double inertia = 0;
  for (auto _ : state) inertia = kmeans(points(), start, {.max_iterations = kmeans_steps}).inertia;
  report_result(state, inertia);
}
CILANTRO_BENCHMARK(kmeans_100);

/// The modes that every hundredth point climbs to, among all.
void mean_shift_seeds(benchmark::State& state) {
  Eigen::Matrix3Xf seeds(3, points().size() / 100);
  for (index_t s = 0; s < seeds.cols(); ++s) seeds.col(s) = points()[100 * s];
  double modes = 0;
  for (auto _ : state)
    modes = double(mean_shift(points(), seeds, density_radius, flat_kernel{}).size());
  report_result(state, modes);
}
CILANTRO_BENCHMARK(mean_shift_seeds);

void plane_200(benchmark::State& state) {
  double inliers = 0;
  for (auto _ : state) {
    const auto found = ransac(hyperplane_family{points()}, {.max_residual = plane_distance,
                                                            .score = ransac_score::inliers,
                                                            .confidence = 1,
                                                            .max_iterations = plane_samples});
    inliers = double(found->inliers.size());
  }
  report_result(state, inliers);
}
CILANTRO_BENCHMARK(plane_200);

/// From trees to the last iteration.
void icp_point_to_plane(benchmark::State& state, const registration_pair& pair) {
  Eigen::Isometry3f found;
  for (auto _ : state)
    found =
        align(
            oriented_points_view<float, 3>{view_of(pair.source)},
            oriented_points_view<float, 3>{view_of(pair.target), view_of(pair.target_normals)},
            {.max_distance = pair.max_distance, .max_iterations = pair.iterations, .tolerance = 0})
            .transform;
  report_pose(state, pair, [&](int i, int k) { return double(found.matrix()(i, k)); });
}

/// With the gradients of the colours.
void icp_colored(benchmark::State& state, const registration_pair& pair) {
  using matrix = Eigen::Map<const Eigen::Matrix3Xf>;
  const auto matrix_of = [](const std::vector<float>& all) {
    return matrix{all.data(), 3, std::ssize(all) / 3};
  };
  const point_cloud<float, 3> source{.points = matrix_of(pair.source),
                                     .colors = matrix_of(pair.source_colors)},
      target{.points = matrix_of(pair.target),
             .normals = matrix_of(pair.target_normals),
             .colors = matrix_of(pair.target_colors)};
  Eigen::Isometry3f found;
  for (auto _ : state)
    found = align(source, target,
                  {.metric = colored{},
                   .max_distance = pair.max_distance,
                   .max_iterations = pair.iterations,
                   .tolerance = 0})
                .transform;
  report_pose(state, pair, [&](int i, int k) { return double(found.matrix()(i, k)); });
}

void depth_to_points(benchmark::State& state) {
  const pinhole_camera<float> camera{image_width,  image_height,    focal_length,
                                     focal_length, image_width / 2, image_height / 2};
  const image_view depth{depth_image().data(), image_width, image_height};
  double sum = 0;
  for (auto _ : state) {
    const auto cloud = cloud_from_depth(depth, camera);
    benchmark::DoNotOptimize(cloud.points.data());
    state.PauseTiming();
    sum = cloud.points.cast<double>().row(2).sum();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(depth_to_points);

/// The sum of all coordinates of a file, which is read again and again.
void read(benchmark::State& state, const char* name) {
  double sum = 0;
  for (auto _ : state) {
    const auto cloud = read_cloud<float>(data_path(name));
    benchmark::DoNotOptimize(cloud.points.data());
    state.PauseTiming();
    sum = cloud.points.cast<double>().sum();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void pcd_read(benchmark::State& state) {
  read(state, "large.pcd");
}
CILANTRO_BENCHMARK(pcd_read);
void pcd_unpack(benchmark::State& state) {
  read(state, "large_compressed.pcd");
}
CILANTRO_BENCHMARK(pcd_unpack);
void xyz_read(benchmark::State& state) {
  read(state, "large.xyz");
}
CILANTRO_BENCHMARK(xyz_read);

void pcd_write(benchmark::State& state) {
  const auto cloud = read_ply<float>(data_path("large.ply"));
  for (auto _ : state) write_pcd(cloud, data_path("written_by_cilantro.pcd"));
  report_result(state, double(cloud.size()));
}
CILANTRO_BENCHMARK(pcd_write);

}  // namespace

int main(int argc, char** argv) {
  benchmark::AddCustomContext("vector_target", std::string{name_of(current_vector_target())});
  return run_benchmarks(argc, argv, icp_point_to_plane, icp_colored);
}
