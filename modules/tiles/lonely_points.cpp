// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import cilantro.search;
import :lonely_points;

namespace cilantro {
namespace {

/// The points of each cell that has some. Unlike `voxel_grid`, it sorts nothing.
template <int D>
class cell_lists {
 public:
  using cell_type = std::array<std::int32_t, D>;
  static constexpr std::int32_t none = -1;

  explicit cell_lists(index_t points) : next_(static_cast<std::size_t>(points), none) {}

  /// Adds a point, and returns the number of its cell.
  std::int32_t add(std::int32_t point, const cell_type& cell) {
    if (last_ == none || cells_[last_].place != cell) {
      if (2 * cells_.size() >= slots_.size()) grow();
      auto& slot = slots_[slot_of(cell)];
      if (slot == none) {
        slot = static_cast<std::int32_t>(cells_.size());
        cells_.push_back({cell, 0, none});
      }
      last_ = slot;
    }
    auto& found = cells_[last_];
    ++found.count;
    next_[point] = found.first;
    found.first = point;
    return last_;
  }
  [[nodiscard]] index_t count(std::int32_t number) const { return cells_[number].count; }
  /// Calls `visit(point)` for the points in the cells up to `far` away from one, along each axis,
  /// until it returns false; those at the same height first, since most points lie on the ground.
  template <class F>
  void visit_around(const cell_type& cell, std::int32_t far, F visit) const {
    auto beside = cell;
    visit_along(D - 1, beside, cell, far, visit);
  }

 private:
  struct list {
    cell_type place;
    std::int32_t count, first;
  };

  template <class F>
  bool visit_along(int d, cell_type& beside, const cell_type& cell, std::int32_t far,
                   F& visit) const {
    for (std::int32_t n = 0; n <= 2 * far; ++n) {
      beside[d] = cell[d] + (n % 2 != 0 ? (n + 1) / 2 : -n / 2);
      if (d > 0) {
        if (!visit_along(d - 1, beside, cell, far, visit)) return false;
      } else if (const auto found = slots_[slot_of(beside)]; found != none) {
        for (auto i = cells_[found].first; i != none; i = next_[i])
          if (!visit(i)) return false;
      }
    }
    return true;
  }
  [[nodiscard]] std::size_t slot_of(const cell_type& cell) const {
    std::uint64_t hash = 0;
    for (const auto c : cell) hash = (hash ^ static_cast<std::uint32_t>(c)) * 0x9e3779b97f4a7c15u;
    std::size_t at = hash >> shift_;
    while (slots_[at] != none && cells_[slots_[at]].place != cell)
      at = (at + 1) & (slots_.size() - 1);
    return at;
  }
  void grow() {
    constexpr std::size_t few = 1024;
    slots_.assign(std::max(few, 2 * slots_.size()), none);
    shift_ = 64 - std::countr_zero(slots_.size());
    for (std::size_t c = 0; c < cells_.size(); ++c)
      slots_[slot_of(cells_[c].place)] = static_cast<std::int32_t>(c);
  }

  std::vector<list> cells_;
  std::vector<std::int32_t> next_;   ///< Of each point, the one before it in its cell.
  std::vector<std::int32_t> slots_;  ///< Numbers of cells, by hash; a power of two.
  int shift_ = 0;
  std::int32_t last_ = none;  ///< Points that follow each other are mostly neighbours.
};

/// The cell of a point. Nothing if it is not finite, or too far away for the numbers of cells.
template <int D, class P>
std::optional<std::array<std::int32_t, D>> cell_of(const P& point, double per_edge) {
  constexpr double far = 0x1p30;
  std::array<std::int32_t, D> cell;
  for (int d = 0; d < D; ++d) {
    const double along = double(point[d]) * per_edge;
    if (!(std::abs(along) < far)) return std::nullopt;
    cell[d] = static_cast<std::int32_t>(along);
    cell[d] -= double(cell[d]) > along ? 1 : 0;
  }
  return cell;
}

/// As many distances as are needed, while one point after the other is looked at.
template <Scalar S>
class least_squares_kept {
 public:
  explicit least_squares_kept(index_t needed) : needed_{needed} {}

  [[nodiscard]] S most() const { return most_; }
  void add(S square) {
    if (std::ssize(kept_) == needed_) {
      std::ranges::pop_heap(kept_);
      kept_.pop_back();
    }
    kept_.push_back(square);
    std::ranges::push_heap(kept_);
    if (std::ssize(kept_) == needed_) most_ = kept_.front();
  }

 private:
  index_t needed_;
  std::vector<S> kept_;  ///< A heap.
  S most_ = std::numeric_limits<S>::infinity();
};

/// The square of the distance of the last of the `needed` points that are nearest to one.
template <Scalar S, int D>
S square_of_last(const Eigen::Matrix<S, dynamic, D>& columns, const point_vector<S, D>& point,
                 index_t needed) {
  constexpr index_t at_a_time = 256;
  least_squares_kept<S> nearest{needed};
  std::array<S, at_a_time> squares;
  for (index_t first = 0; first < columns.rows(); first += at_a_time) {
    const index_t n = std::min(at_a_time, columns.rows() - first);
    Eigen::Map<Eigen::Array<S, dynamic, 1>> all{squares.data(), n};
    all = (columns.col(0).segment(first, n).array() - point[0]).square();
    for (int d = 1; d < D; ++d)
      all += (columns.col(d).segment(first, n).array() - point[d]).square();
    // Most are far away from the few that are nearest.
    if (all.minCoeff() >= nearest.most()) continue;
    for (index_t i = 0; i < n; ++i)
      if (squares[i] < nearest.most()) nearest.add(squares[i]);
  }
  return nearest.most();
}

}  // namespace

template <Scalar S, int D>
index_list lonely_points(const point_matrix<S, D>& points, double distance, index_t needed,
                         const std::function<double(std::int32_t)>& known) {
  using cells_type = cell_lists<D>;
  // So small that all points of a cell are near each other.
  const double per_edge = std::sqrt(double(D)) / (0.999 * distance);
  cells_type cells{points.cols()};
  std::vector<std::int32_t> numbers(static_cast<std::size_t>(points.cols()));
  for (index_t i = 0; i < points.cols(); ++i) {
    const auto cell = cell_of<D>(points.col(i), per_edge);
    numbers[i] = cell ? cells.add(static_cast<std::int32_t>(i), *cell) : cells_type::none;
  }
  const auto has_enough = [&](index_t i, double within) {
    const auto far = static_cast<std::int32_t>(std::ceil(within * per_edge));
    // Many may be just beyond: then the point is looked at in another way.
    const index_t most_visits = 1000 + 50 * needed;
    index_t count = 0, visits = 0;
    cells.visit_around(*cell_of<D>(points.col(i), per_edge), far, [&](std::int32_t j) {
      if (double((points.col(j) - points.col(i)).norm()) <= within) ++count;
      return count < needed && ++visits < most_visits;
    });
    return count >= needed;
  };
  index_list lonely;
  for (index_t i = 0; i < points.cols(); ++i) {
    const bool has_cell = numbers[i] != cells_type::none;
    if (has_cell && cells.count(numbers[i]) >= needed) continue;
    const double within = known(static_cast<std::int32_t>(i));
    if (within < 0 || (has_cell && has_enough(i, std::min(within, 2 * distance)))) continue;
    lonely.push_back(static_cast<std::int32_t>(i));
  }
  return lonely;
}

template <Scalar S, int D>
std::vector<S> farthest_of_nearest(const point_matrix<S, D>& points, const index_list& of,
                                   index_t needed) {
  std::vector<S> farthest;
  farthest.reserve(of.size());
  constexpr std::ptrdiff_t not_worth_a_tree = 64;
  if (std::ssize(of) <= not_worth_a_tree) {
    const Eigen::Matrix<S, dynamic, D> columns = points.transpose();
    for (const auto i : of)
      farthest.push_back(std::sqrt(square_of_last<S, D>(columns, points.col(i), needed)));
    return farthest;
  }
  point_matrix<S, D> queries(D, std::ssize(of));
  for (index_t q = 0; q < queries.cols(); ++q) queries.col(q) = points.col(of[q]);
  const kd_tree<S, D> tree{points};
  const auto near = tree.find_all(queries, knn{needed});
  for (index_t q = 0; q < queries.cols(); ++q) farthest.push_back(near[q].distances().back());
  return farthest;
}

#define CILANTRO_INSTANTIATE(S, D)                                                                \
  template index_list lonely_points<S, D>(const point_matrix<S, D>&, double, index_t,             \
                                          const std::function<double(std::int32_t)>&);            \
  template std::vector<S> farthest_of_nearest<S, D>(const point_matrix<S, D>&, const index_list&, \
                                                    index_t);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
