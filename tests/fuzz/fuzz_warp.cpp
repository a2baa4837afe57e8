// SPDX-License-Identifier: MIT
//
// Any points and connections have a graph whose anchors weigh 1 together, fields on it move and
// bend, and a step of any pairs keeps motions finite; or the call throws what it documents. Nothing
// else may happen.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <utility>
#include <vector>

import fuzzed_numbers;
import cilantro;
using namespace cilantro;

namespace {

void expect(bool condition) {
  if (!condition) std::abort();
}

template <int D>
deformation_graph<double, D> graph_of(const point_matrix<double, D>& points,
                                      fuzzed_numbers& numbers) {
  // Most of them make sense.
  const bool is_any = numbers.below(16) == 15;
  const deformation_graph_options options{
      .spacing = is_any ? numbers.next() : 0.125 * (1 + numbers.below(64)),
      .anchors = is_any ? numbers.below(12) : 1 + numbers.below(8),
      .links = knn{numbers.below(5) + (is_any ? 0 : 1)},
      .threads = 1};
  if (numbers.below(3) == 0) return {points, options};
  if (numbers.below(2) == 0) {
    const point_matrix<double, D> nodes = numbers.columns(points.rows(), 6);
    auto given = options;
    given.spacing = 0;
    return {points, nodes_at{nodes}, given};
  }
  std::vector<index_t> offsets{0};
  buffer<std::int32_t> indices;
  buffer<double> distances;
  for (index_t i = 0; i < points.cols(); ++i) {
    for (int k = numbers.below(4); k > 0; --k) {
      indices.push_back(numbers.below(static_cast<int>(points.cols()) + 1));
      distances.push_back(std::abs(numbers.next()));
    }
    offsets.push_back(std::ssize(indices));
  }
  return {points, neighborhoods<double>{offsets, indices, distances}, options};
}

template <int D, class Motion>
void bend(const point_matrix<double, D>& points, fuzzed_numbers& numbers) {
  const auto graph = graph_of<D>(points, numbers);
  const auto& data = graph.data();
  for (index_t g = 0; g < data.group_count(); ++g)
    for (index_t place = data.groups[g]; place < data.groups[g + 1]; ++place) {
      double sum = 0;
      for (std::size_t k = 0; k < data.anchors_of(g).size(); ++k) {
        expect(data.weights_at(place)[k] >= 0);
        sum += data.weights_at(place)[k];
      }
      expect(std::abs(sum - 1) < 1e-9);
    }

  const point_matrix<double, D> target = numbers.columns(points.rows(), 16);
  correspondences<double> pairs;
  for (std::int32_t s = 0; s < points.cols() && target.cols() > 0; ++s)
    if (numbers.below(2) == 0)
      pairs.push_back({s, numbers.below(static_cast<int>(target.cols())), 0});
  const warp_estimator estimator{points,
                                 target,
                                 graph,
                                 point_to_point{},
                                 {.stiffness = std::abs(numbers.next()), .threads = 1},
                                 Motion{}};
  auto field = estimator.identity();
  for (int step = 0; step < 2; ++step) field = estimator.estimate(field, pairs).transform;
  for (index_t k = 0; k < graph.nodes().size(); ++k)
    expect(is_finite(field.motions().shifts.col(k)));
  const auto moved = moved_points(field, points, {.threads = 1});
  expect(moved.cols() == points.cols());
  if (points.cols() > 0 && is_finite(points.col(0))) (void)field.inverse_at(moved.col(0));
  if (graph.nodes().size() > 0) (void)compose(field, field);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzzed_numbers numbers{data, size};
  try {
    switch (numbers.below(3)) {
      case 0:
        bend<2, rigid_motion>(numbers.columns(2, 20), numbers);
        break;
      case 1:
        bend<3, rigid_motion>(numbers.columns(3, 20), numbers);
        break;
      default:
        bend<3, affine_motion>(numbers.columns(3, 20), numbers);
    }
  } catch (const invalid_input&) {
  }
  return 0;
}
