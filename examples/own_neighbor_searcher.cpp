// SPDX-License-Identifier: MIT
//
// A neighbour searcher of your own: a plain struct that does what the concept NeighborSearcher
// says. This one sorts the points along x and walks away from the query to both sides.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <ranges>
#include <tuple>
#include <vector>

import cilantro;
using namespace cilantro;

struct sweep_searcher {
  using scalar = float;
  static constexpr int static_dimension = 3;

  explicit sweep_searcher(points_view<float, 3> all) : points{all} {
    for (index_t i = 0; i < all.size(); ++i)
      if (is_finite(all[i])) order.push_back(i);
    std::ranges::sort(order, {}, [&](index_t i) { return all[i].x(); });
  }

  [[nodiscard]] index_t size() const { return points.size(); }
  [[nodiscard]] index_t dimension() const { return 3; }

  void find(const Eigen::Vector3f& query, neighborhood_spec spec,
            std::vector<neighbor<float>>& out) const {
    out.clear();
    if (spec.max_count() == 0 || !is_finite(query)) return;
    const auto nearer = [](const neighbor<float>& a, const neighbor<float>& b) {
      return std::tie(a.distance, a.index) < std::tie(b.distance, b.index);
    };
    // Whether a point so far away along x can still be a neighbour; `out` is a heap, the worst on
    // top.
    const auto reaches = [&](float dx) {
      return std::abs(dx) <= spec.max_distance() &&
             (std::ssize(out) < spec.max_count() || std::abs(dx) <= out.front().distance);
    };
    const auto visit = [&](index_t i) {
      const neighbor<float> next{i, (points[i] - query).norm()};
      if (!(next.distance <= spec.max_distance())) return;
      out.push_back(next);
      std::ranges::push_heap(out, nearer);
      if (std::ssize(out) <= spec.max_count()) return;
      std::ranges::pop_heap(out, nearer);
      out.pop_back();
    };
    const auto middle =
        std::ranges::lower_bound(order, query.x(), {}, [&](index_t i) { return points[i].x(); });
    for (auto right = middle; right != order.end(); ++right) {
      if (!reaches(points[*right].x() - query.x())) break;
      visit(*right);
    }
    for (auto left = middle; left != order.begin();) {
      if (!reaches(points[*--left].x() - query.x())) break;
      visit(*left);
    }
    std::ranges::sort_heap(out, nearer);
  }

  points_view<float, 3> points;
  std::vector<index_t> order;
};
static_assert(NeighborSearcher<sweep_searcher>);

int main() {
  random_stream random{1};
  Eigen::Matrix3Xf points(3, 500);
  for (auto& value : points.reshaped()) value = static_cast<float>(random.uniform());

  const sweep_searcher mine{as_points(points)};
  const auto violations = check_neighbor_searcher(mine, points);
  for (const auto& violation : violations) std::cout << violation << '\n';

  // From here on it serves wherever a kd_tree does.
  const auto normals = estimate_normals(points, find_neighborhoods(mine, points, knn{10}));
  const auto same = estimate_normals(points, knn{10});
  std::cout << violations.size() << " violations of the contract; the normals are "
            << (normals.normals == same.normals ? "the same\n" : "different\n");
  return violations.empty() && normals.normals == same.normals ? 0 : 1;
}
