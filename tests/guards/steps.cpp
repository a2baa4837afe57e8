// SPDX-License-Identifier: MIT
//
// One step on small, fixed input, for check_steps.py to count what it takes: steps NAME
// Prints how often it asked the C library for memory.
#include <atomic>
#include <cmath>
#include <cstddef>
#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <vector>

import cilantro;
import cilantro.visualization;
using namespace cilantro;

namespace {

std::atomic<long> allocations = 0;

/// A wavy surface, and the same from elsewhere.
point_matrix<float, 3> surface(index_t n, std::uint64_t seed) {
  point_matrix<float, 3> points(3, n);
  random_stream random{seed};
  for (auto p : points.colwise()) {
    const double x = random.uniform(0, 2), y = random.uniform(0, 2);
    p << float(x), float(y), float(0.1 * std::sin(5 * x) * std::cos(4 * y));
  }
  return points;
}

/// Points on the unit sphere, all of them corners of their hull.
point_matrix<double, 3> sphere(index_t n) {
  point_matrix<double, 3> points(3, n);
  random_stream random{3};
  for (auto p : points.colwise()) {
    p << random.normal(), random.normal(), random.normal();
    p.normalize();
  }
  return points;
}

}  // namespace

// In place of those of the C library, as it allows.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  ++allocations;
  return __libc_realloc(old, size);
}

/// What is between its beginning and its end counts.
[[gnu::noinline]] double measured_step(const std::function<double()>& step) {
  return step();
}
}

int main(int count, char** arguments) {
  const auto all = surface(20'000, 1);
  const auto points = as_points(all);
  const kd_tree tree{points};
  const auto normals = estimate_normals(points, knn{10}).normals;
  const point_matrix<float, 3> moved = (surface(10'000, 2).array() + 0.01f).matrix();
  const execution one{.threads = 1};
  const auto corners = sphere(1000);
  const point_matrix<double, 3> normals_of_few = corners.leftCols(20);
  const auto polytope = intersect_half_spaces(normals_of_few, std::vector<double>(20, 1));

  const auto seen = scene{}.set("points", all, cloud_look{.size = splat_length{0.02}});
  const view from = fit(seen, {.width = 320, .height = 200});

  const std::map<std::string, std::function<double()>> steps{
      {"tree", [&] { return double(kd_tree{points, {.threads = 1}}.size()); }},
      {"knn", [&] { return double(tree.find_all(points, knn{10}, one).distances()[0]); }},
      {"radius", [&] { return double(tree.find_all(points, radius{0.05}, one).distances()[0]); }},
      {"normals",
       [&] { return double(estimate_normals(points, knn{10}, {.threads = 1}).normals(0, 0)); }},
      {"voxels", [&] { return double(voxel_downsample(points, 0.05, {.threads = 1}).cols()); }},
      {"icp",
       [&] {
         return double(
             align(oriented_points_view<float, 3>{as_points(moved)},
                   oriented_points_view<float, 3>{points, as_points(normals)},
                   {.max_distance = 0.1, .max_iterations = 5, .tolerance = 0, .threads = 1})
                 .transform(0, 3));
       }},
      {"kmeans",
       [&] {
         return kmeans(points, point_matrix<float, 3>{all.leftCols(50)},
                       {.max_iterations = 10, .threads = 1})
             .inertia;
       }},
      {"ransac",
       [&] {
         return double(
             ransac(hyperplane_family{points},
                    {.max_residual = 0.02, .confidence = 1, .max_iterations = 64, .threads = 1})
                 ->inliers.size());
       }},
      {"components",
       [&] {
         return double(
             connected_components(points, knn{10}, always_similar{}, {.threads = 1}).size());
       }},
      {"hull", [&] { return convex_hull(corners, {.threads = 1}).volume(); }},
      {"halfspaces",
       [&] { return intersect_half_spaces(corners, std::vector<double>(1000, 1)).volume(); }},
      {"bend",
       [&] {
         return double(align_non_rigid(oriented_points_view<float, 3>{as_points(moved)},
                                       oriented_points_view<float, 3>{points, as_points(normals)},
                                       {.spacing = 0.2,
                                        .max_distance = 0.1,
                                        .max_iterations = 2,
                                        .final_iterations = 2,
                                        .tolerance = 1e-9,
                                        .threads = 1})
                           .rmse);
       }},
      {"picture",
       [&] { return double(render(seen, from, {.threads = 1}).pixels()[320 * 100 + 160][0]); }},
      {"contains", [&] { return double(polytope.contains_each(points, 0, one)[0]); }},
  };
  const auto step = steps.find(count == 2 ? arguments[1] : "");
  if (step == steps.end()) {
    for (const auto& [name, run] : steps) std::cout << name << '\n';
    return count == 1 ? 0 : 1;
  }
  const long before = allocations;
  const double result = measured_step(step->second);
  const long after = allocations;
  std::cout << after - before << '\n';
  return std::isfinite(result) ? 0 : 1;
}
