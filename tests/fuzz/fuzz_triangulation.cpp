// SPDX-License-Identifier: MIT
//
// Any points in a plane or in space have a triangulation, and those in a plane an outline, in which
// each simplex is told of its neighbours; or the call throws what it documents. Nothing else may
// happen.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <vector>

import fuzzed_numbers;
import cilantro;
using namespace cilantro;

namespace {

void expect(bool condition) {
  if (!condition) std::abort();
}

/// How many points the columns of a table of indices have.
index_t points_of(const auto& table, index_t count) {
  std::vector<bool> used(count);
  index_t found = 0;
  for (const auto i : table.reshaped()) {
    expect(0 <= i && i < count);
    found += !used[i];
    used[i] = true;
  }
  return found;
}

template <class Points>
void triangulate(const Points& points) {
  const auto mesh = delaunay_triangulation(points);
  expect(points_of(mesh.simplices, points.cols()) + mesh.left_out + mesh.non_finite ==
         points.cols());
  expect(mesh.neighbors.cols() == mesh.simplices.cols());
  for (index_t s = 0; s < mesh.simplices.cols(); ++s)
    for (const auto other : mesh.neighbors.col(s)) {
      expect(-1 <= other && other < mesh.simplices.cols() && other != s);
      if (other >= 0) expect((mesh.neighbors.col(other).array() == s).any());
    }
}

template <class Points>
void outline(const Points& points, double alpha, double tolerance) {
  const auto covered = concave_hull(points, {.alpha = alpha, .tolerance = tolerance});
  expect(points_of(covered.triangles, points.cols()) + covered.left_out + covered.non_finite ==
         points.cols());
  expect(covered.area >= 0 && covered.perimeter >= 0);
  expect(covered.rings.empty() == (covered.triangles.cols() == 0));
  for (const auto& ring : covered.rings) expect(ring.size() >= 3);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzzed_numbers numbers{data, size};
  const index_t d = 2 + numbers.below(2);
  const int how = numbers.below(4);
  const double alpha = numbers.next(), tolerance = d == 3 ? numbers.next() : 0;
  const auto points = numbers.columns(d, 60);
  try {
    if (how == 0) triangulate(points);
    if (how == 1) triangulate(Eigen::MatrixXf{points.cast<float>()});
    if (how == 2) outline(points, alpha, tolerance);
    if (how == 3) outline(Eigen::MatrixXf{points.cast<float>()}, alpha, tolerance);
  } catch (const invalid_input&) {
  } catch (const std::runtime_error&) {
  }
  return 0;
}
