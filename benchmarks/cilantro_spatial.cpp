// SPDX-License-Identifier: MIT
#include <algorithm>
#include <numeric>
#include <vector>

#include "common.hpp"

import cilantro;
using namespace cilantro;

namespace {

void hull(benchmark::State& state, const std::vector<float>& xyz) {
  const points_view<float, 3> points{xyz.data(), std::ssize(xyz) / 3};
  double volume = 0;
  for (auto _ : state) volume = convex_hull(points).volume();
  report_result(state, volume);
}
void hull_of_frame(benchmark::State& state) {
  hull(state, frame());
}
CILANTRO_BENCHMARK(hull_of_frame);
void hull_of_cube(benchmark::State& state) {
  hull(state, cube_points());
}
CILANTRO_BENCHMARK(hull_of_cube);
void hull_of_sphere(benchmark::State& state) {
  hull(state, sphere_points());
}
CILANTRO_BENCHMARK(hull_of_sphere);

void delaunay(benchmark::State& state, const std::vector<float>& xyz, index_t count, int axes) {
  const Eigen::Map<const Eigen::Matrix3Xf> all(xyz.data(), 3, std::ssize(xyz) / 3);
  const point_matrix<double, dynamic> points = all.topLeftCorner(axes, count).cast<double>();
  index_t simplices = 0;
  for (auto _ : state) simplices = delaunay_triangulation(points).simplices.cols();
  report_result(state, double(simplices));
}
void delaunay_of_square(benchmark::State& state) {
  delaunay(state, cube_points(), 50'000, 2);
}
CILANTRO_BENCHMARK(delaunay_of_square);
void delaunay_of_cube(benchmark::State& state) {
  delaunay(state, cube_points(), 10'000, 3);
}
CILANTRO_BENCHMARK(delaunay_of_cube);

/// Half-spaces that touch the unit sphere.
point_matrix<double, 3> tangents(index_t count) {
  const auto& xyz = sphere_points();
  const Eigen::Map<const Eigen::Matrix3Xf> all(xyz.data(), 3, std::ssize(xyz) / 3);
  return all.leftCols(count).cast<double>();
}
void half_spaces(benchmark::State& state) {
  const auto normals = tangents(1000);
  const std::vector<double> offsets(1000, 1);
  double volume = 0;
  for (auto _ : state) volume = intersect_half_spaces(normals, offsets).volume();
  report_result(state, volume);
}
CILANTRO_BENCHMARK(half_spaces);
void interior_ball(benchmark::State& state) {
  const auto polytope = intersect_half_spaces(tangents(1000), std::vector<double>(1000, 1));
  double radius = 0;
  for (auto _ : state) radius = polytope.interior_ball()->radius;
  report_result(state, radius);
}
CILANTRO_BENCHMARK(interior_ball);

void points_in_polytope(benchmark::State& state) {
  const auto normals = tangents(20);
  const Eigen::VectorXd offsets =
      (normals.transpose() * Eigen::Vector3d{0.5, 0.5, 0.5}).array() + 0.45;
  const auto polytope = intersect_half_spaces(normals, offsets);
  std::vector<float> xyz;
  while (xyz.size() < 3'000'000) {
    const auto more = std::min<std::size_t>(3'000'000 - xyz.size(), cube_points().size());
    xyz.insert(xyz.end(), cube_points().begin(), cube_points().begin() + std::ptrdiff_t(more));
  }
  const points_view<float, 3> points{xyz.data(), std::ssize(xyz) / 3};
  index_t inside = 0;
  for (auto _ : state) {
    const auto mask = polytope.contains_each(points);
    inside = std::accumulate(mask.begin(), mask.end(), index_t{0});
  }
  report_result(state, double(inside));
}
CILANTRO_BENCHMARK(points_in_polytope);

void boxes_together(benchmark::State& state, int count, double spread) {
  double volume = 0;
  for (auto _ : state) {
    space_region<3> all;
    for (const auto& [low, high] : random_boxes(count, spread))
      all |= space_region<3>{box{low, high}};
    volume = all.volume();
  }
  report_result(state, volume);
}
void union_of_14_boxes(benchmark::State& state) {
  boxes_together(state, 14, 0.3);
}
CILANTRO_BENCHMARK(union_of_14_boxes);
void union_of_100_boxes(benchmark::State& state) {
  boxes_together(state, 100, 2);
}
CILANTRO_BENCHMARK(union_of_100_boxes);

}  // namespace
