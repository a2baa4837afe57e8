// SPDX-License-Identifier: MIT
export module cilantro.geometry:voxel_grid;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :groups;

namespace cilantro {

/// The edge lengths of a cell, in the units of the points: one for all axes, or one per axis.
export class voxel_size {
 public:
  voxel_size(double edge) : edges_{edge} {}                    // NOLINT: conversions on purpose
  voxel_size(coordinates edges) : edges_{std::move(edges)} {}  // NOLINT
  template <class V>
    requires std::derived_from<V, Eigen::MatrixBase<V>>
  voxel_size(const V& edges) : edges_{edges} {}  // NOLINT

  /// One edge per axis. Throws `invalid_input` unless each is positive and finite, and there is one
  /// for all axes or one per axis.
  template <int D>
  [[nodiscard]] point_vector<double, D> edges(index_t dimension) const {
    point_vector<double, D> all(dimension);
    if (edges_.size() == 1)
      all.setConstant(edges_[0]);
    else
      all = edges_.as<double, D>(dimension,
                                 "voxel_size: there must be one edge, or one per dimension");
    expects(is_finite(all) && (dimension == 0 || all.minCoeff() > 0),
            "voxel_size: the edges must be positive");
    return all;
  }
  /// The longest edge.
  [[nodiscard]] double largest() const {
    double longest = 0;
    for (index_t d = 0; d < edges_.size(); ++d) longest = std::max(longest, edges_[d]);
    return longest;
  }

 private:
  coordinates edges_;
};

/// Where the cells of a grid lie: cell c reaches from `origin` + c · `edges` to `origin` + (c + 1)
/// · `edges`.
template <int D>
struct cell_layout {
  point_vector<double, D> edges, origin;
};

template <Scalar S, int D>
point_groups closed_voxel_groups(points_view<S, D> points, const cell_layout<D>& layout,
                                 index_t min_points, const execution& how);

/// Cell coordinates are smaller than this in magnitude, so that their 64-bit differences do not
/// overflow.
inline constexpr double cell_limit = 0x1p62;

/// The cell that contains `point`: ⌊(pᵈ − originᵈ) / edgeᵈ⌋, limited to ±2⁶², where no grid has
/// cells. Precondition: `point` is finite.
template <Scalar S, int D>
[[nodiscard]] Eigen::Matrix<std::int64_t, D, 1> voxel_of(
    const Eigen::Ref<const point_vector<S, D>>& point, const cell_layout<D>& layout) {
  Eigen::Matrix<std::int64_t, D, 1> cell(point.size());
  for (index_t d = 0; d < point.size(); ++d) {
    const double steps = (double(point[d]) - layout.origin[d]) / layout.edges[d];
    cell[d] =
        static_cast<std::int64_t>(std::floor(std::min(std::max(steps, -cell_limit), cell_limit)));
  }
  return cell;
}

/// Options of `voxel_grid`.
export struct voxel_options {
  index_t min_points_per_cell = 1;  ///< Cells with fewer points are left out.
  /// A common corner of cells, in the coordinates of the points; zero if not given.
  std::optional<coordinates> origin = {};
  int threads = 0;
  task_monitor monitor = {};
};

template <int D>
cell_layout<D> layout_of(const voxel_size& size, const voxel_options& options, index_t dimension) {
  cell_layout<D> layout{size.edges<D>(dimension), point_vector<double, D>::Zero(dimension)};
  if (options.origin)
    layout.origin = options.origin->as<double, D>(
        dimension, "voxel_grid: the origin must have the dimension of the points");
  expects(is_finite(layout.origin), "voxel_grid: the origin must be finite");
  return layout;
}

/// Points sorted into the cells of a grid of boxes. Only occupied cells are stored, in the order of
/// their integer coordinates, the first axis being the most significant; neither the number of
/// threads nor the order of the points affects how cells are numbered.
///
/// Views its points, which must outlive it. Non-finite points are in no cell.
export template <Scalar S, int D>
class voxel_grid {
 public:
  using cell_type = Eigen::Matrix<std::int64_t, D, 1>;

  /// Throws `invalid_input` for edges that are not positive, an origin that is not finite, a
  /// negative `min_points_per_cell`, and a point whose cell coordinate would not fit 62 bits. O(N)
  /// if the coordinates of all cells together vary in at most 64 bits, a few times slower
  /// otherwise. Memory: 4 bytes per point and 8 per cell, and up to 36 bytes per point while it is
  /// built.
  voxel_grid(points_view<S, D> points, const voxel_size& size, const voxel_options& options = {})
      : points_{points},
        layout_{layout_of<D>(size, options, points.dimension())},
        groups_{closed_voxel_groups<S, closed_dimension<D>>(points, {layout_.edges, layout_.origin},
                                                            options.min_points_per_cell,
                                                            {options.threads, options.monitor})} {}
  template <BorrowedPoints P>
  voxel_grid(P&& points, const voxel_size& size, const voxel_options& options = {})
      : voxel_grid{as_points(points), size, options} {
    expect_local(points, "voxel_grid");
  }

  /// The number of occupied cells.
  [[nodiscard]] index_t size() const { return groups_.size(); }
  /// The grid is a range of the points of each cell.
  [[nodiscard]] auto begin() const [[clang::lifetimebound]] {
    return indexed_iterator{indexed_rows{this}, 0};
  }
  [[nodiscard]] auto end() const [[clang::lifetimebound]] { return begin() + size(); }
  /// The indices of the points in cell number `c`, ascending. Precondition: 0 <= c < size().
  [[nodiscard]] std::span<const std::int32_t> operator[](index_t c) const [[clang::lifetimebound]] {
    return groups_[c];
  }
  [[nodiscard]] const point_groups& groups() const [[clang::lifetimebound]] { return groups_; }
  /// The integer coordinates of cell number `c`.
  [[nodiscard]] cell_type cell(index_t c) const {
    return voxel_of<S, D>(points_[groups_[c].front()], layout_);
  }

  /// The edges of a cell, and the common corner of cells from which they are counted.
  [[nodiscard]] const point_vector<double, D>& edges() const [[clang::lifetimebound]] {
    return layout_.edges;
  }
  [[nodiscard]] const point_vector<double, D>& origin() const [[clang::lifetimebound]] {
    return layout_.origin;
  }
  /// The corner of cell number `c` with the smallest coordinates, which belongs to the cell; and
  /// the centre of the cell.
  [[nodiscard]] point_vector<double, D> corner(index_t c) const {
    return layout_.origin + layout_.edges.cwiseProduct(cell(c).template cast<double>());
  }
  [[nodiscard]] point_vector<double, D> center(index_t c) const {
    return corner(c) + layout_.edges / 2;
  }

  /// The number of the cell with these integer coordinates; nothing if it is not occupied. Throws
  /// `invalid_input` for another number of coordinates. O(log size()).
  [[nodiscard]] std::optional<index_t> find_cell(const cell_type& wanted) const {
    expect_coordinates(wanted.size(), points_.dimension());
    const auto before = [](const cell_type& a, const cell_type& b) {
      return std::lexicographical_compare(a.data(), a.data() + a.size(), b.data(),
                                          b.data() + b.size());
    };
    const auto all = std::views::iota(index_t{0}, size());
    const auto place =
        std::ranges::lower_bound(all, wanted, before, [&](index_t c) { return cell(c); });
    if (place == all.end() || cell(*place) != wanted) return std::nullopt;
    return *place;
  }
  template <class V>
    requires(!std::same_as<V, cell_type> && std::same_as<typename V::Scalar, std::int64_t>)
  [[nodiscard]] std::optional<index_t> find_cell(const Eigen::MatrixBase<V>& wanted) const {
    return find_cell(cell_type{sized<cell_type>{wanted}});
  }
  /// The number of the cell that contains a place; nothing if that cell holds no point.
  [[nodiscard]] std::optional<index_t> find(const point_ref<S, D>& place) const {
    expect_coordinates(place.size(), points_.dimension());
    if (!is_finite(place)) return std::nullopt;
    return find_cell(voxel_of<S, D>(place, layout_));
  }
  /// The number of the cell that contains point `i`. Nothing if the point is not finite, or its
  /// cell was left out. Throws `invalid_input` for an index that is out of range.
  [[nodiscard]] std::optional<index_t> find(std::integral auto i) const {
    expects(std::cmp_greater_equal(i, 0) && std::cmp_less(i, points_.size()),
            "voxel_grid: the index of the point is out of range");
    return find(points_[static_cast<index_t>(i)]);
  }

 private:
  points_view<S, D> points_;
  cell_layout<D> layout_;
  point_groups groups_;
};
export template <PointsSource P>
voxel_grid(P&&, const voxel_size&, const voxel_options& = {})
    -> voxel_grid<scalar_of<P>, dimension_of<P>>;

}  // namespace cilantro
