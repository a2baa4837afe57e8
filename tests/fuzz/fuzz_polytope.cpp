// SPDX-License-Identifier: MIT
//
// Any points have a hull that contains them, any half-spaces an intersection with corners inside,
// and both are combined; or the call throws what it documents. Nothing else may happen.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>

import fuzzed_numbers;
import cilantro;
using namespace cilantro;

namespace {

void expect(bool condition) {
  if (!condition) std::abort();
}

template <class Points>
convex_polytope<> hull_of(const Points& points, bool simplicial) {
  const auto hull = convex_hull(points, {.simplicial = simplicial});
  index_t finite = 0;
  for (const auto& p : points.colwise()) {
    if (!p.allFinite()) continue;
    ++finite;
    expect(hull.contains(p, hull.tolerance()));
  }
  expect(finite + hull.non_finite() == points.cols());
  expect(hull.empty() == (finite == 0));
  expect(hull.is_bounded());
  expect(hull.measure() >= 0);
  return hull;
}

convex_polytope<> intersection_of(const Eigen::MatrixXd& normals, const Eigen::VectorXd& offsets) {
  const auto common = intersect_half_spaces(normals, offsets);
  expect(common.empty() == common.vertices().empty());
  for (const auto& vertex : common.vertices()) expect(common.contains(vertex, common.tolerance()));
  expect(common.empty() || common.measure() >= 0);
  if (const auto ball = common.interior_ball()) expect(common.contains(ball->center));
  return common;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzzed_numbers numbers{data, size};
  const index_t d = 1 + numbers.below(5);
  const int how = numbers.below(8);
  // As many as are done in a moment: facets, and even more so pieces, grow with the dimension.
  const int most_points = d <= 3 ? 60 : 16, most_half_spaces = d <= 3 ? 24 : 8;
  try {
    const auto normals = numbers.columns(d, numbers.below(most_half_spaces + 1));
    Eigen::VectorXd offsets(normals.cols());
    for (auto& offset : offsets) offset = numbers.next();
    const auto points = numbers.columns(d, most_points);
    const auto hull = (how & 1) != 0 ? hull_of(Eigen::MatrixXf{points.cast<float>()}, how / 2 % 2)
                                     : hull_of(points, how / 2 % 2);
    const auto common = intersection_of(normals, offsets);
    expect((hull & common).measure() >= 0);
    if ((how & 4) != 0) expect((hull - common).volume() >= 0);
  } catch (const invalid_input&) {
  } catch (const std::runtime_error&) {
  }
  return 0;
}
