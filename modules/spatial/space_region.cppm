// SPDX-License-Identifier: MIT
export module cilantro.spatial:space_region;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.geometry;
import :convex_polytope;
import :polytope_data;

namespace cilantro {

using polytope_pieces = std::vector<std::shared_ptr<const polytope_data>>;

/// The pieces with an inside, as they are.
polytope_pieces solid_pieces(polytope_pieces pieces);
/// Sets of pieces whose insides do not meet, and again such.
polytope_pieces union_of(const polytope_pieces& a, const polytope_pieces& b);
polytope_pieces intersection_of(const polytope_pieces& a, const polytope_pieces& b);
polytope_pieces difference_of(const polytope_pieces& a, const polytope_pieces& b);
polytope_pieces everything_in(index_t dimension);
polytope_pieces merged(polytope_pieces pieces);
template <Scalar S>
void find_inside(const polytope_pieces& pieces, points_view<S, dynamic> points,
                 const Eigen::VectorXd& origin, const execution& how,
                 std::span<std::uint8_t> inside);

/// A part of space with flat sides, convex or not, in one piece or several, with holes, with or
/// without end: a union of convex polytopes, kept as pieces whose insides do not meet, so that its
/// volume is the sum of theirs.
///
/// Regions are closed and have an inside: the boundary belongs to a region and to its complement,
/// and what is flat or thinner than the tolerance of the polytopes has no part in them. Where
/// planes of the sets are parallel but for 10⁻¹² to 10⁻⁶, an operation may throw
/// `std::runtime_error`, and in rare cases a result may be wrong. Values; const calls are safe from
/// any thread. Is a `Region`.
export template <int D = dynamic>
class space_region {
 public:
  using vector = point_vector<double, D>;
  static constexpr int static_dimension = D;

  /// The empty region; if D is `dynamic` of dimension 0, until it is joined with another.
  space_region() : dimension_{D == dynamic ? 0 : D} {}
  space_region(const convex_polytope<D>& polytope)  // NOLINT: a conversion on purpose
      : space_region{polytope.dimension(), {polytope.shared()}} {}
  template <int E>
    requires(E != D && (E == dynamic || D == dynamic))
  space_region(const convex_polytope<E>& polytope)  // NOLINT
      : space_region{convex_polytope<D>{polytope}} {}
  space_region(const box& from) : space_region{convex_polytope<D>{from}} {}  // NOLINT
  /// The same region with a dimension that is known at compile time, or at run time only. Throws
  /// `invalid_input` for one of another dimension.
  template <int E>
    requires(E != D && (E == dynamic || D == dynamic))
  space_region(const space_region<E>& other)  // NOLINT
      : space_region{other.dimension(), other.shared()} {
    if (D != dynamic && dimension_ == 0) dimension_ = D;
    expects(D == dynamic || dimension_ == D, "space_region: the other has another dimension");
  }
  /// Internal.
  space_region(index_t dimension, polytope_pieces pieces)
      : dimension_{dimension}, pieces_{solid_pieces(std::move(pieces))} {}

  /// Coordinates of a point.
  [[nodiscard]] index_t dimension() const { return dimension_; }
  [[nodiscard]] bool empty() const { return pieces_.empty(); }
  [[nodiscard]] bool is_bounded() const {
    return std::ranges::all_of(pieces_, [](const auto& p) { return p->bounded; });
  }
  /// The number of convex pieces, and piece i: polytopes whose insides do not meet. How a region is
  /// cut into pieces is not specified. Throws `invalid_input` for an index that is out of range.
  [[nodiscard]] index_t piece_count() const { return std::ssize(pieces_); }
  [[nodiscard]] convex_polytope<D> piece(index_t i) const {
    expects(0 <= i && i < piece_count(), "piece: there is no piece with this index");
    return convex_polytope<D>{pieces_[i]};
  }

  /// The volume, in 2D the area; infinity for unbounded regions.
  [[nodiscard]] double volume() const {
    double sum = 0;
    for (const auto& p : pieces_) sum += p->measure;
    return sum;
  }
  /// The centre of mass; nothing for empty and unbounded regions.
  [[nodiscard]] std::optional<vector> centroid() const {
    if (empty() || !is_bounded()) return {};
    vector sum = vector::Zero(dimension_);
    for (const auto& p : pieces_) sum += p->measure * p->centroid;
    return vector{sum / volume()};
  }
  /// The smallest box along the axes. Throws `invalid_input` for the empty region.
  [[nodiscard]] box bounding_box() const {
    expects(!empty(), "bounding_box: the region is empty");
    Eigen::MatrixXd bounds = bounds_of(*pieces_.front());
    for (const auto& p : pieces_) {
      const Eigen::MatrixXd more = bounds_of(*p);
      bounds.col(0) = bounds.col(0).cwiseMin(more.col(0));
      bounds.col(1) = bounds.col(1).cwiseMax(more.col(1));
    }
    return {.lower = bounds.col(0), .upper = bounds.col(1)};
  }

  /// Whether the point is in the region, its boundary included, within the tolerance of the pieces.
  /// O(half-spaces of all pieces).
  template <class P>
  [[nodiscard]] bool contains(const P& point) const {
    check(static_cast<index_t>(point.size()));
    return std::ranges::any_of(
        pieces_, [&](const auto& p) { return convex_polytope<D>{p}.contains(point); });
  }
  /// Throws `invalid_input` unless points have `dimension` coordinates.
  void check(index_t dimension) const {
    expects(dimension == dimension_, "space_region: points must have the dimension of the region");
  }
  /// For each of many points, whether `contains(point)`, faster.
  template <PointsSource P>
  [[nodiscard]] std::vector<std::uint8_t> contains_each(const P& points,
                                                        const execution& how = {}) const {
    const auto view = points_in(points);
    std::vector<std::uint8_t> inside(view.size());
    mark_inside<scalar_of<P>>(view, origin_in(points), inside, how);
    return inside;
  }
  /// As above: writes 1 or 0 for each point, to which `origin` is added.
  template <Scalar S>
  void mark_inside(points_view<S, dynamic> points, const Eigen::VectorXd& origin,
                   std::span<std::uint8_t> inside, const execution& how = {}) const {
    check(points.dimension());
    expects(std::ssize(inside) == points.size() && origin.size() == dimension_,
            "mark_inside: there must be one answer per point, and an origin of their dimension");
    find_inside(pieces_, points, origin, how, inside);
  }
  /// The distance to the nearest point of the region; 0 inside, infinity for the empty region.
  template <class P>
  [[nodiscard]] double distance(const P& point) const {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& p : pieces_)
      least = std::min(least, std::max(0.0, convex_polytope<D>{p}.signed_distance(point)));
    return least;
  }

  /// The same region in fewer pieces, where some together are convex. Takes time that grows with
  /// the square of their number.
  [[nodiscard]] space_region simplified() const { return {dimension_, merged(pieces_)}; }

  /// What is in either, in both, in the first alone, and in none.
  [[nodiscard]] friend space_region operator|(const space_region& a, const space_region& b) {
    return {dimension_of_both(a, b), union_of(a.pieces_, b.pieces_)};
  }
  [[nodiscard]] friend space_region operator&(const space_region& a, const space_region& b) {
    return {dimension_of_both(a, b), intersection_of(a.pieces_, b.pieces_)};
  }
  [[nodiscard]] friend space_region operator-(const space_region& a, const space_region& b) {
    return {dimension_of_both(a, b), difference_of(a.pieces_, b.pieces_)};
  }
  [[nodiscard]] friend space_region operator~(const space_region& a) {
    expects(a.dimension_ > 0, "regions: one without a dimension has no complement");
    return {a.dimension_, difference_of(everything_in(a.dimension_), a.pieces_)};
  }
  space_region& operator|=(const space_region& other) { return *this = *this | other; }
  space_region& operator&=(const space_region& other) { return *this = *this & other; }
  space_region& operator-=(const space_region& other) { return *this = *this - other; }

  /// Internal.
  [[nodiscard]] const polytope_pieces& shared() const [[clang::lifetimebound]] { return pieces_; }

 private:
  static index_t dimension_of_both(const space_region& a, const space_region& b) {
    // One that was made without a dimension takes that of the other.
    if (a.dimension_ == 0) return b.dimension_;
    if (b.dimension_ == 0) return a.dimension_;
    expects(a.dimension_ == b.dimension_, "regions: both must have the same dimension");
    return a.dimension_;
  }

  index_t dimension_;
  polytope_pieces pieces_;
};
export template <int D>
space_region(convex_polytope<D>) -> space_region<D>;

template <class T>
inline constexpr int flat_sided_dimension = -2;
template <>
inline constexpr int flat_sided_dimension<box> = dynamic;
template <int D>
inline constexpr int flat_sided_dimension<convex_polytope<D>> = D;
template <int D>
inline constexpr int flat_sided_dimension<space_region<D>> = D;

/// What the operators of regions take: a `box`, a `convex_polytope` or a `space_region`.
export template <class T>
concept FlatSidedSet = flat_sided_dimension<T> != -2;

/// The dimension of two sets. That of one may be known at run time only, as that of a box is.
template <FlatSidedSet A, FlatSidedSet B>
[[nodiscard]] consteval int dimension_of_sets() {
  constexpr int a = flat_sided_dimension<A>, b = flat_sided_dimension<B>;
  static_assert(a == b || a == dynamic || b == dynamic,
                "regions: both sets must have the same dimension");
  return a == dynamic ? b : a;
}
template <FlatSidedSet A, FlatSidedSet B>
using region_of_both = space_region<dimension_of_sets<A, B>()>;
/// Regions have regions in common; convex sets a convex one.
template <FlatSidedSet A, FlatSidedSet B>
using common_part =
    std::conditional_t<std::same_as<A, space_region<flat_sided_dimension<A>>> ||
                           std::same_as<B, space_region<flat_sided_dimension<B>>>,
                       region_of_both<A, B>, convex_polytope<dimension_of_sets<A, B>()>>;

/// As the operators of `space_region`, for boxes, polytopes and regions in any mixture. The result
/// has the dimension of that which says one in its type; of boxes alone, `dynamic`. Throws
/// `invalid_input` if the dimensions differ, and as `box::check`.
export template <FlatSidedSet A, FlatSidedSet B>
[[nodiscard]] region_of_both<A, B> operator|(const A& a, const B& b) {
  return region_of_both<A, B>(a) | region_of_both<A, B>(b);
}
export template <FlatSidedSet A, FlatSidedSet B>
[[nodiscard]] region_of_both<A, B> operator-(const A& a, const B& b) {
  return region_of_both<A, B>(a) - region_of_both<A, B>(b);
}
/// What both have in common: of boxes and polytopes a polytope, which may be flat or empty, and
/// otherwise a region.
export template <FlatSidedSet A, FlatSidedSet B>
[[nodiscard]] common_part<A, B> operator&(const A& a, const B& b) {
  return common_part<A, B>(a) & common_part<A, B>(b);
}
export template <FlatSidedSet A>
[[nodiscard]] space_region<flat_sided_dimension<A>> operator~(const A& a) {
  return ~space_region<flat_sided_dimension<A>>(a);
}

/// The image of a region under an affine map with an inverse.
export template <int D, AffineMap T>
[[nodiscard]] space_region<D> transform_region(const space_region<D>& region, const T& transform) {
  polytope_pieces moved;
  for (index_t i = 0; i < region.piece_count(); ++i)
    moved.push_back(transform_polytope(region.piece(i), transform).shared());
  return {region.dimension(), std::move(moved)};
}

}  // namespace cilantro
