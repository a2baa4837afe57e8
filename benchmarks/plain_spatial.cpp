// SPDX-License-Identifier: MIT
//
// Qhull as a careful user calls it: all points, facets and volume.
#include <cstdio>
#include <vector>

#include "common.hpp"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace {

void hull(benchmark::State& state, const std::vector<float>& xyz) {
  double volume = 0;
  for (auto _ : state) {
    std::vector<double> points(xyz.begin(), xyz.end());
    qhT qh;
    qh_zero(&qh, stderr);
    if (qh_new_qhull(&qh, 3, static_cast<int>(points.size() / 3), points.data(), False,
                     const_cast<char*>("qhull Pp"), nullptr, stderr) == 0) {
      qh_getarea(&qh, qh.facet_list);
      volume = qh.totvol;
    }
    int left = 0, total = 0;
    qh_freeqhull(&qh, !qh_ALL);
    qh_memfreeshort(&qh, &left, &total);
  }
  report_result(state, volume);
}
/// The triangulation as Qhull makes it, with the neighbours it has anyway.
void delaunay(benchmark::State& state, const std::vector<float>& xyz, std::size_t count, int axes) {
  double simplices = 0;
  for (auto _ : state) {
    std::vector<double> points;
    for (std::size_t i = 0; i < count; ++i)
      for (int d = 0; d < axes; ++d) points.push_back(xyz[3 * i + static_cast<std::size_t>(d)]);
    qhT qh;
    qh_zero(&qh, stderr);
    if (qh_new_qhull(&qh, axes, static_cast<int>(count), points.data(), False,
                     const_cast<char*>("qhull d Qbb Qc Qt Pp"), nullptr, stderr) == 0) {
      simplices = 0;
      facetT* facet;
      FORALLfacet_(qh.facet_list) if (!facet->upperdelaunay)++ simplices;
    }
    int left = 0, total = 0;
    qh_freeqhull(&qh, !qh_ALL);
    qh_memfreeshort(&qh, &left, &total);
  }
  report_result(state, simplices);
}
void delaunay_of_square(benchmark::State& state) {
  delaunay(state, cube_points(), 50'000, 2);
}
CILANTRO_BENCHMARK(delaunay_of_square);
void delaunay_of_cube(benchmark::State& state) {
  delaunay(state, cube_points(), 10'000, 3);
}
CILANTRO_BENCHMARK(delaunay_of_cube);

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

}  // namespace
