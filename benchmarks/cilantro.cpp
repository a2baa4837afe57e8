// SPDX-License-Identifier: MIT
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

template <class Spec>
void search(benchmark::State& state, Spec spec) {
  const kd_tree tree{points()};
  double sum = 0;
  for (auto _ : state) {
    const auto found = tree.find_all(points(), spec);
    benchmark::DoNotOptimize(found.distances().data());
    state.PauseTiming();
    sum = std::accumulate(found.distances().begin(), found.distances().end(), 0.0);
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void knn_of_all(benchmark::State& state) {
  search(state, knn{neighbor_count});
}
CILANTRO_BENCHMARK(knn_of_all);
void radius_of_all(benchmark::State& state) {
  search(state, radius{voxel_edge});
}
CILANTRO_BENCHMARK(radius_of_all);

void normals(benchmark::State& state) {
  double sum = 0;
  for (auto _ : state) {
    const auto found = estimate_normals(points(), knn{neighbor_count}, {.viewpoint = {{0, 0, 0}}});
    benchmark::DoNotOptimize(found.normals.data());
    state.PauseTiming();
    sum = found.normals.row(2).cast<double>().cwiseAbs().sum();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(normals);

void voxels(benchmark::State& state) {
  double count = 0;
  for (auto _ : state) {
    const auto reduced = voxel_downsample(points(), double(voxel_edge));
    benchmark::DoNotOptimize(reduced.data());
    count = double(reduced.cols());
  }
  report_result(state, count);
}
CILANTRO_BENCHMARK(voxels);

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

}  // namespace

BENCHMARK_MAIN();
