// SPDX-License-Identifier: MIT
//
// You have a nanoflann index already: how does it serve where a kd_tree does? By one struct that
// makes it a NeighborSearcher, the static index and the one to which points are added and from
// which they are removed.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <limits>
#include <nanoflann.hpp>
#include <ranges>
#include <tuple>
#include <vector>

import cilantro;
using namespace cilantro;

/// An index by L2_Simple_Adaptor or L2_Adaptor, and the points that nanoflann calls a dataset. Both
/// must outlive it, and must not change while somebody searches. Indices are those of the dataset,
/// whose removed points count in `size()`.
template <template <class, class, std::int32_t, class> class Index, class Distance, class Points,
          std::int32_t D, class I>
struct nanoflann_searcher {
  using scalar = typename Distance::DistanceType;
  static constexpr int static_dimension = D;

  const Index<Distance, Points, D, I>& index;
  const Points& points;
  index_t dim = D;  ///< To be given if it is -1 in the type of the index.

  [[nodiscard]] index_t size() const { return index_t(points.kdtree_get_point_count()); }
  [[nodiscard]] index_t dimension() const { return dim; }

  void find(const Eigen::Ref<const point_vector<scalar, D>>& query, neighborhood_spec spec,
            std::vector<neighbor<scalar>>& out) const {
    out.clear();
    if (spec.max_count() == 0 || !is_finite(query)) return;
    const auto reach = static_cast<scalar>(spec.max_distance());
    result_set found{out, spec.max_count(), spec.max_count() >= size(), reach * reach};
    index.findNeighbors(found, query.data(), {});
    if (found.takes_all) {
      std::ranges::sort(out, nearer);
      out.erase(std::ranges::unique(out).begin(), out.end());
    }
    for (auto& n : out) n.distance = std::sqrt(n.distance);
  }

 private:
  static bool nearer(const neighbor<scalar>& a, const neighbor<scalar>& b) {
    return std::tie(a.distance, a.index) < std::tie(b.distance, b.index);
  }

  /// What nanoflann asks of a result set, by squared distances.
  struct result_set {
    using DistanceType = scalar;
    using IndexType = index_t;

    std::vector<neighbor<scalar>>& out;  // ascending, unless it takes all within the limit
    index_t count;
    bool takes_all;
    scalar limit;

    [[nodiscard]] bool full() const { return !takes_all && std::ssize(out) == count; }
    // nanoflann shows only what is nearer than this, by bounds that are rounded. It is told a
    // little more, so that `addPoint` decides at the radius and among points that are equally far.
    [[nodiscard]] scalar worstDist() const {
      using limits = std::numeric_limits<scalar>;
      return (full() ? out.back().distance : limit) * (1 + 1024 * limits::epsilon()) +
             limits::min();
    }
    bool addPoint(scalar distance, index_t i) {
      const neighbor<scalar> next{i, distance};
      const auto at = takes_all ? out.end() : std::ranges::lower_bound(out, next, nearer);
      // A point that was removed and added again is shown twice.
      if (!(distance <= limit) || (at != out.end() && *at == next)) return true;
      const bool was_full = full();
      out.insert(at, next);
      if (was_full) out.pop_back();
      return true;
    }
    void sort() const {}  // since nanoflann 1.6
  };
};

/// What users of nanoflann have: points as it reads them. It cannot sort NaN into a tree; a number
/// so large that every distance from it overflows makes such a point nobody's neighbour.
struct dataset {
  const Eigen::Matrix3Xf& points;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return std::size_t(points.cols()); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t d) const {
    const float value = points(index_t(d), index_t(i));
    return std::isfinite(value) ? value : std::numeric_limits<float>::max();
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using metric = nanoflann::L2_Simple_Adaptor<float, dataset>;
using fixed_index = nanoflann::KDTreeSingleIndexAdaptor<metric, dataset, 3>;
using changing_index = nanoflann::KDTreeSingleIndexDynamicAdaptor<metric, dataset, 3>;

/// Whether `searcher` keeps the contract and finds what looking at all `points` finds.
template <NeighborSearcher T>
bool is_right(const T& searcher, const Eigen::Matrix3Xf& points) {
  const auto violations = check_neighbor_searcher(searcher, points);
  for (const auto& violation : violations) std::cout << violation << '\n';
  const brute_force_searcher truth{points};
  const auto specs = {neighborhood_spec{knn{10}}, neighborhood_spec{radius{1}},
                      neighborhood_spec{knn_in_radius{10, 1}}};
  return violations.empty() && std::ranges::all_of(specs, [&](const neighborhood_spec& spec) {
           return std::ranges::equal(find_neighborhoods(searcher, points, spec).indices(),
                                     find_neighborhoods(truth, points, spec).indices());
         });
}

int main() {
  // Half of the points are on a grid, where many are equally far and some the same.
  random_stream random{1};
  Eigen::Matrix3Xf points(3, 3000);
  for (auto& value : points.reshaped()) value = static_cast<float>(10 * random.uniform());
  points.leftCols(1500) = points.leftCols(1500).array().round().eval();
  points(1, 7) = std::numeric_limits<float>::quiet_NaN();

  const dataset all{points};
  const fixed_index fixed{3, all};
  const nanoflann_searcher mine{fixed, all};
  const bool fixed_is_right = is_right(mine, points);
  const auto normals = estimate_normals(points, find_neighborhoods(mine, points, knn{10}));
  const bool same_normals = normals.normals == estimate_normals(points, knn{10}).normals;

  // Points come and go: the first half is there, some of it leaves, and the rest arrives.
  Eigen::Matrix3Xf now = points.leftCols(1500);
  const dataset current{now};
  changing_index changing{3, current};
  const nanoflann_searcher also_mine{changing, current};
  for (std::size_t i = 0; i < 600; ++i) changing.removePoint(i);
  now = points;
  changing.addPoints(1500, 2999);
  now.leftCols(200).array() += 0.5f;  // Removed points may move, and come back.
  changing.addPoints(0, 199);
  // Without a coordinate, a point is nobody's neighbour to those who look at all points.
  Eigen::Matrix3Xf remaining = now;
  remaining.middleCols(200, 400).setConstant(std::numeric_limits<float>::quiet_NaN());
  const bool changing_is_right = is_right(also_mine, remaining);

  std::cout << "the fixed index is " << (fixed_is_right ? "right" : "wrong")
            << ", the changing one " << (changing_is_right ? "right" : "wrong")
            << "; the normals are " << (same_normals ? "the same\n" : "different\n");
  return fixed_is_right && changing_is_right && same_normals ? 0 : 1;
}
