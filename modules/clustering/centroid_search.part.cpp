// SPDX-License-Identifier: MIT
//
// The centres nearest to points, as k-means looks for them. Internal.
module;
#include "clustering/kernels/nearest_centers.hpp"
module cilantro.clustering:centroid_search;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.search;
import :clusters;

namespace cilantro {

template <Scalar S, int D>
struct centers_kernels {
  detail::nearest_centers<S>* nearest;
  detail::doubtful_points<S>* doubtful;
};
template <Scalar S, int D>
centers_kernels<S, D> kernels() {
  return detail::for_target(static_cast<int>(current_vector_target()), []<detail::kernel_target V> {
    return centers_kernels<S, D>{detail::nearest_centers_in<V, S, D>(),
                                 detail::doubtful_points_in<V, S, D>()};
  });
}

/// The two centres nearest to a point: by a vector kernel, or by a tree where that is faster than
/// looking at all of them.
template <Scalar S, int D, class M>
class centroid_search {
 public:
  explicit centroid_search(points_view<S, D> centroids) : centroids_{centroids} {
    if (has_kernel) {
      constexpr index_t unit = detail::center_row_unit;
      rows_.setConstant(D, (centroids.size() + unit - 1) / unit * unit,
                        std::numeric_limits<S>::infinity());
      rows_.leftCols(centroids.size()) = centroids.matrix();
    }
    if (!is_for_kernel() && centroids.size() > 12 && centroids.dimension() <= 12)
      tree_.emplace(centroids, M{}, kd_tree_options{.max_leaf_size = 4, .threads = 1});
  }

  /// Their distances, and the index of the nearest; the second is infinite if there is one only.
  struct result {
    clusters::label nearest;
    S first, second;
  };
  [[nodiscard]] result find(const S* point) const {
    if (tree_) {
      const auto two =
          tree_->nearest_two(Eigen::Map<const point_vector<S, D>>{point, centroids_.dimension()});
      return {static_cast<clusters::label>(two[0].index), two[0].distance, two[1].distance};
    }
    constexpr S far = std::numeric_limits<S>::infinity();
    result best{0, far, far};
    for (index_t c = 0; c < centroids_.size(); ++c) {
      const S sum = sum_to(point, c);
      if (sum < best.first) {
        best = {static_cast<clusters::label>(c), sum, best.first};
      } else {
        best.second = std::min(best.second, sum);
      }
    }
    return {best.nearest, M::distance(best.first), M::distance(best.second)};
  }
  /// The same for those of `points` with the given indices.
  void find(points_view<S, D> points, std::span<const std::int32_t> indices,
            std::vector<result>& out) const {
    out.resize(indices.size());
    if constexpr (has_kernel) {
      if (is_for_kernel()) {
        std::array<clusters::label, default_block_size> nearest;
        std::array<S, default_block_size> first, second;
        kernels<S, D>().nearest(points.data(), points.stride(), indices.data(), std::ssize(indices),
                                in_rows(), nearest.data(), first.data(), second.data());
        for (std::size_t i = 0; i < indices.size(); ++i) out[i] = {nearest[i], first[i], second[i]};
        return;
      }
    }
    for (std::size_t i = 0; i < indices.size(); ++i)
      out[i] = find(points.data() + indices[i] * points.stride());
  }
  [[nodiscard]] S distance(const S* point, index_t c) const {
    return M::distance(sum_to(point, c));
  }
  /// Brings two bounds of such points, whose centres are `own`, up to date; the places in the list
  /// of those that may have another centre now.
  [[nodiscard]] std::span<const std::int32_t> doubtful(points_view<S, D> points,
                                                       std::span<const std::int32_t> indices,
                                                       const detail::moved_centers<S>& centers,
                                                       const clusters::label* own, S* upper,
                                                       S* lower,
                                                       std::span<std::int32_t> room) const {
    if constexpr (has_kernel)
      return room.first(kernels<S, D>().doubtful(points.data(), points.stride(), indices.data(),
                                                 std::ssize(indices), in_rows(), centers, own,
                                                 upper, lower, room.data()));
    const S more = 1 + centers.slack, less = 1 - centers.slack;
    std::size_t found = 0;
    for (std::size_t i = 0; i < indices.size(); ++i) {
      lower[i] -= centers.farthest;
      upper[i] += centers.moves[own[i]];
      const S limit = std::max(lower[i], centers.halves[own[i]]) * less;
      if (upper[i] * more < limit) continue;
      upper[i] = distance(points.data() + indices[i] * points.stride(), own[i]);
      if (!(upper[i] * more < limit)) room[found++] = static_cast<std::int32_t>(i);
    }
    return room.first(found);
  }

 private:
  static constexpr bool has_kernel = std::same_as<M, euclidean> && D != dynamic;
  [[nodiscard]] bool is_for_kernel() const {
    return has_kernel && centroids_.size() <= detail::most_centers;
  }
  [[nodiscard]] S sum_to(const S* point, index_t c) const {
    return metric_sum(M{}, point, centroids_.data() + c * centroids_.stride(),
                      D == dynamic ? centroids_.dimension() : index_t{D});
  }

  [[nodiscard]] detail::center_rows<S> in_rows() const {
    return {rows_.data(), rows_.cols(), centroids_.size()};
  }

  points_view<S, D> centroids_;
  Eigen::Matrix<S, dynamic, dynamic, Eigen::RowMajor> rows_;  ///< The same for kernels.
  std::optional<kd_tree<S, D, M>> tree_;
};

}  // namespace cilantro
