// SPDX-License-Identifier: MIT
export module cilantro.spatial:convex_polytope;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.geometry;
import :polytope_data;

namespace cilantro {

/// What kind of set a polytope is.
export enum class polytope_status {
  empty,  ///< No point.
  flat,   ///< Of a lower dimension than the space: a point, a segment, a polygon in space, a line…
  bounded,   ///< With an inside, and with an end in every direction.
  unbounded  ///< With an inside, and without an end in some direction.
};

/// One face of the greatest dimension of a polytope. Valid while the polytope is.
export template <int D>
struct polytope_facet {
  point_vector<double, D> normal;  ///< Of unit length, outwards.
  double offset;                   ///< normal · x <= offset in the polytope, with = in the facet.
  /// Vertices of the polytope; in a bounded polygon's case counterclockwise as seen from outside,
  /// from the least index on, and otherwise ascending. Indices from `vertices().size()` on are
  /// rays.
  std::span<const std::int32_t> vertices;
  /// Facets that share a face of the next lower dimension; in a bounded polygon's case that at the
  /// edge from vertex i to vertex i + 1.
  std::span<const std::int32_t> neighbors;
};

std::optional<ball> interior_ball_of(const polytope_data& polytope);
double largest_excess(const polytope_data& polytope, const Eigen::VectorXd& point);
Eigen::VectorXd closest_point_of(const polytope_data& polytope, const Eigen::VectorXd& point);
index_t farthest_vertex_of(const polytope_data& polytope, const Eigen::VectorXd& direction);
std::shared_ptr<const polytope_data> intersection_of(const polytope_data& a,
                                                     const polytope_data& b);
std::shared_ptr<const polytope_data> transformed(const polytope_data& polytope,
                                                 const Eigen::MatrixXd& linear,
                                                 const Eigen::VectorXd& translation);
std::shared_ptr<const polytope_data> sum_of(const polytope_data& a, const polytope_data& b);
std::shared_ptr<const polytope_data> difference_of(const polytope_data& a, const polytope_data& b);
Eigen::MatrixXd bounds_of(const polytope_data& polytope);
template <Scalar S>
void find_inside(const polytope_data& polytope, points_view<S, dynamic> points,
                 const Eigen::VectorXd& origin, double margin, const execution& how,
                 std::span<std::uint8_t> inside);

/// A convex set with flat sides: the hull of some points, and at the same time the intersection of
/// some half-spaces. Any set of that kind is a value of this type: also the empty one, points,
/// segments and polygons in space, sets without an end, and all of space.
///
/// Coordinates are doubles in world coordinates, and in the unit of the points. A polytope never
/// changes, both representations are made with it, and copies share them: copying costs a pointer,
/// and const calls are safe from any thread. Is a `Region`.
export template <int D = dynamic>
class convex_polytope {
 public:
  using vector = point_vector<double, D>;
  static constexpr int static_dimension = D;

  /// The empty set; of dimension 0 if D is `dynamic`.
  convex_polytope() : data_{make_empty(D == dynamic ? 0 : D)} {}
  /// A box as a polytope. Throws as `box::check` does.
  explicit convex_polytope(const box& from) : data_{from_box(from)} {}
  /// The same polytope with a dimension that is known at compile time, or at run time only. Throws
  /// `invalid_input` for one of another dimension.
  template <int E>
    requires(E != D && (E == dynamic || D == dynamic))
  convex_polytope(const convex_polytope<E>& other)  // NOLINT: a conversion on purpose
      : data_{other.shared()} {
    if (D != dynamic && dimension() == 0) data_ = make_empty(D);
    expects(D == dynamic || dimension() == D, "convex_polytope: the other has another dimension");
  }
  // No moves: what is moved from would be no polytope, and copies cost a pointer.
  convex_polytope(const convex_polytope&) = default;
  convex_polytope& operator=(const convex_polytope&) = default;
  ~convex_polytope() = default;
  /// Internal.
  explicit convex_polytope(std::shared_ptr<const polytope_data> data) : data_{std::move(data)} {}

  /// Coordinates of a point.
  [[nodiscard]] index_t dimension() const { return data_->dimension; }
  /// The dimension of the set itself: 0 for a point, 1 for a segment or a line…, −1 if empty.
  [[nodiscard]] index_t affine_dimension() const { return data_->affine_dimension; }
  [[nodiscard]] bool empty() const { return affine_dimension() < 0; }
  [[nodiscard]] bool is_bounded() const { return data_->bounded; }
  [[nodiscard]] polytope_status status() const {
    if (empty()) return polytope_status::empty;
    if (affine_dimension() < dimension()) return polytope_status::flat;
    return is_bounded() ? polytope_status::bounded : polytope_status::unbounded;
  }
  /// The distance within which everything here is verified to hold: no vertex, and none of the
  /// points that it is the hull of, is outside any of the half-spaces by more. Of a region's piece,
  /// vertices that are far away from the sets that it was cut from are outside by no more than
  /// 3 · 10⁻¹⁰ of their coordinates.
  [[nodiscard]] double tolerance() const { return data_->tolerance; }

  /// The corners, `D × N`: of a hull in the order of `indices`, and otherwise in the order of their
  /// coordinates. Where the set contains a line it has no corners; then one point of each of its
  /// smallest faces.
  [[nodiscard]] points_view<double, D> vertices() const [[clang::lifetimebound]] {
    return view_of(data_->vertices);
  }
  /// Unit vectors in which the set has no end; with the vertices they span it. A line has two.
  [[nodiscard]] points_view<double, D> rays() const [[clang::lifetimebound]] {
    return view_of(data_->rays);
  }
  /// Of a hull: for each vertex its index in the points, the least of equal points, ascending. Of
  /// other polytopes: nothing.
  [[nodiscard]] std::span<const std::int32_t> indices() const [[clang::lifetimebound]] {
    return data_->indices;
  }
  /// How many of the points that this is the hull of were not finite; they are left out.
  [[nodiscard]] index_t non_finite() const { return data_->non_finite; }

  /// Half-spaces normal · x <= offset that have the set as their intersection, none redundant: one
  /// per facet in their order, then two opposite ones for each direction in which a flat set does
  /// not extend. Of the empty set: two that contradict each other.
  [[nodiscard]] points_view<double, D> normals() const [[clang::lifetimebound]] {
    return view_of(data_->normals);
  }
  [[nodiscard]] std::span<const double> offsets() const [[clang::lifetimebound]] {
    return {data_->offsets.data(), static_cast<std::size_t>(data_->offsets.size())};
  }

  /// The facets, by their vertices in ascending order: a range of `polytope_facet`. Its `[i]`
  /// throws `invalid_input` for an index that is out of range.
  class facet_range {
   public:
    facet_range() = default;
    explicit facet_range(const polytope_data* data) : data_{data} {}
    [[nodiscard]] index_t size() const { return data_ ? data_->facets.size() : 0; }
    [[nodiscard]] bool empty() const { return size() == 0; }
    [[nodiscard]] polytope_facet<D> operator[](index_t i) const {
      expects(0 <= i && i < size(), "facets: there is no facet with this index");
      return {data_->normals.col(i), data_->offsets[i], data_->facets[i], data_->neighbors[i]};
    }
    [[nodiscard]] auto begin() const { return indexed_iterator<facet_range>{*this, 0}; }
    [[nodiscard]] auto end() const { return indexed_iterator<facet_range>{*this, size()}; }

   private:
    const polytope_data* data_ = nullptr;
  };
  [[nodiscard]] facet_range facets() const [[clang::lifetimebound]] {
    return facet_range{data_.get()};
  }
  /// The boundary of a bounded set as simplices, one per column, by the `affine_dimension()`
  /// vertices that each has: of a solid in space triangles, counterclockwise as seen from outside;
  /// of a polygon its edges.
  [[nodiscard]] Eigen::Map<const Eigen::MatrixXi> simplices() const [[clang::lifetimebound]] {
    const index_t corners = std::max(affine_dimension(), index_t{0});
    return {data_->simplices.data(), corners,
            corners > 0 ? std::ssize(data_->simplices) / corners : 0};
  }

  /// The volume, in 2D the area; 0 for flat sets, and infinity for unbounded ones.
  [[nodiscard]] double volume() const {
    return affine_dimension() == dimension() ? data_->measure : 0;
  }
  /// The measure of the set in its own dimension: of a polygon in space its area, of a segment its
  /// length, of a point 1.
  [[nodiscard]] double measure() const { return data_->measure; }
  /// The measure of the boundary in its own dimension: the surface of a solid, the perimeter of a
  /// polygon.
  [[nodiscard]] double area() const { return data_->area; }
  /// The centre of mass; nothing for empty and unbounded sets.
  [[nodiscard]] std::optional<vector> centroid() const {
    if (empty() || !is_bounded()) return {};
    return vector{data_->centroid};
  }
  /// A largest ball inside; nothing if there is no inside, and if balls of any size fit. O(facets).
  [[nodiscard]] std::optional<ball> interior_ball() const { return interior_ball_of(*data_); }
  /// The corners of the smallest box along the axes; infinite where the set has no end. Throws
  /// `invalid_input` for the empty set.
  [[nodiscard]] box bounding_box() const {
    const auto bounds = bounds_of(*data_);
    return {.lower = bounds.col(0), .upper = bounds.col(1)};
  }

  /// Whether the point is in the set, its boundary included, within `tolerance()`. With a margin,
  /// whether it is in the set whose facets are moved outwards by that distance; a negative margin
  /// moves them inwards. O(facets).
  template <class P>
  [[nodiscard]] bool contains(const P& point, double margin = 0) const {
    check(static_cast<index_t>(point.size()));
    if (empty() || !is_finite_point(point)) return false;
    const double more = margin + tolerance();
    for (index_t f = 0; f < data_->normals.cols(); ++f)
      if (!(height(f, point) <= data_->offsets[f] + more)) return false;
    return true;
  }
  /// Throws `invalid_input` unless points have `dimension` coordinates.
  void check(index_t dimension) const {
    expects(dimension == this->dimension(),
            "convex_polytope: points must have the dimension of the polytope");
  }
  /// For each of many points, whether `contains(point)`, faster. O(N · facets).
  template <PointsSource P>
  [[nodiscard]] std::vector<std::uint8_t> contains_each(const P& points, double margin = 0,
                                                        const execution& how = {}) const {
    const auto view = points_in(points);
    check(view.dimension());
    std::vector<std::uint8_t> inside(view.size());
    find_inside<scalar_of<P>>(*data_, view, origin_in(points), margin, how, inside);
    return inside;
  }
  /// As above: writes 1 or 0 for each point, to which `origin` is added.
  template <Scalar S>
  void mark_inside(points_view<S, dynamic> points, const Eigen::VectorXd& origin,
                   std::span<std::uint8_t> inside, const execution& how = {}) const {
    check(points.dimension());
    expects(std::ssize(inside) == points.size() && origin.size() == dimension(),
            "mark_inside: there must be one answer per point, and an origin of their dimension");
    find_inside(*data_, points, origin, 0, how, inside);
  }
  /// The distance to the boundary, negative inside; infinity for the empty set, and −infinity for
  /// all of space. In a flat set, the distance to it. Throws `invalid_input` unless the point is
  /// finite.
  template <class P>
  [[nodiscard]] double signed_distance(const P& point) const {
    expects(is_finite_point(point), "signed_distance: the point must be finite");
    check(static_cast<index_t>(point.size()));
    if (empty()) return std::numeric_limits<double>::infinity();
    double largest = -std::numeric_limits<double>::infinity();
    for (index_t f = 0; f < data_->normals.cols(); ++f)
      largest = std::max(largest, height(f, point) - data_->offsets[f]);
    if (largest <= 0) return largest;
    return (closest_point(point) - vector_from(point)).norm();
  }
  /// The point of the set that is nearest to `point`. Throws `invalid_input` for the empty set and
  /// unless the point is finite.
  template <class P>
  [[nodiscard]] vector closest_point(const P& point) const {
    expects(!empty(), "closest_point: the polytope is empty");
    expects(is_finite_point(point), "closest_point: the point must be finite");
    return closest_point_of(*data_, vector_from(point));
  }
  /// The index of the vertex that is farthest in a direction; −1 if a ray goes farther, and for the
  /// empty set.
  template <class P>
  [[nodiscard]] index_t farthest_vertex(const P& direction) const {
    return farthest_vertex_of(*data_, vector_from(direction));
  }

  /// The points that are in both.
  [[nodiscard]] friend convex_polytope operator&(const convex_polytope& a,
                                                 const convex_polytope& b) {
    return convex_polytope{intersection_of(*a.data_, *b.data_)};
  }
  /// All sums of a point of one and a point of the other (Minkowski). Throws `invalid_input` for
  /// unbounded sets, and for more than 10⁸ pairs of corners: time and memory grow with their
  /// number.
  [[nodiscard]] friend convex_polytope minkowski_sum(const convex_polytope& a,
                                                     const convex_polytope& b) {
    return convex_polytope{sum_of(*a.data_, *b.data_)};
  }
  /// All points p such that p + q is in `a` for each q of `b`: what is left of `a` for the origin
  /// of `b` to be in. For bounded `b`.
  [[nodiscard]] friend convex_polytope minkowski_difference(const convex_polytope& a,
                                                            const convex_polytope& b) {
    return convex_polytope{difference_of(*a.data_, *b.data_)};
  }

  /// Internal.
  [[nodiscard]] const polytope_data& data() const [[clang::lifetimebound]] { return *data_; }
  [[nodiscard]] const std::shared_ptr<const polytope_data>& shared() const
      [[clang::lifetimebound]] {
    return data_;
  }

 private:
  static std::shared_ptr<const polytope_data> from_box(const box& from) {
    const index_t d = from.lower.size();
    expects(D == dynamic || D == d, "convex_polytope: the box must have the polytope's dimension");
    from.check(d);
    Eigen::MatrixXd normals(d, 2 * d);
    Eigen::VectorXd offsets(2 * d);
    normals << -Eigen::MatrixXd::Identity(d, d), Eigen::MatrixXd::Identity(d, d);
    for (index_t k = 0; k < d; ++k) {
      offsets[k] = -from.lower[k];
      offsets[d + k] = from.upper[k];
    }
    return make_intersection(normals, offsets, 0);
  }
  static points_view<double, D> view_of(const Eigen::MatrixXd& columns) {
    return as_points(
        Eigen::Map<const point_matrix<double, D>>(columns.data(), columns.rows(), columns.cols()));
  }
  template <class P>
  [[nodiscard]] Eigen::VectorXd vector_from(const P& point) const {
    check(static_cast<index_t>(point.size()));
    Eigen::VectorXd v(point.size());
    for (index_t d = 0; d < v.size(); ++d) v[d] = static_cast<double>(point[d]);
    return v;
  }
  template <class P>
  [[nodiscard]] static bool is_finite_point(const P& point) {
    for (index_t d = 0; d < static_cast<index_t>(point.size()); ++d)
      if (!std::isfinite(static_cast<double>(point[d]))) return false;
    return true;
  }
  /// The point's place along the normal of half-space f, summed in the order of the axes as by the
  /// kernel for many points.
  template <class P>
  [[nodiscard]] double height(index_t f, const P& point) const {
    double sum = 0;
    for (index_t d = 0; d < data_->normals.rows(); ++d)
      sum += data_->normals(d, f) * static_cast<double>(point[d]);
    return sum;
  }

  std::shared_ptr<const polytope_data> data_;
};

/// The convex hull of points of any dimension; of a cloud in world coordinates. Points that are not
/// finite are left out. No points have the empty hull, and points that lie in a plane, on a line or
/// together a flat one. Facets are as large as they are: a cube has six, of four vertices each.
///
/// The result has the same bits for any number of threads and any `cull`. Throws `invalid_input`
/// for a negative tolerance and for coordinates beyond 10³⁰⁷, `cancelled`, and `std::runtime_error`
/// if a result cannot be verified. O(N log N) in two and three dimensions, O(V^⌊D/2⌋) beyond; by
/// Qhull (Barber, Dobkin and Huhdanpaa 1996), after points that are clearly inside are put aside.
export template <PointsSource P>
[[nodiscard]] convex_polytope<dimension_of<P>> convex_hull(const P& points,
                                                           const hull_options& options = {}) {
  return convex_polytope<dimension_of<P>>{
      make_hull<scalar_of<P>>(points_in(points), origin_in(points), options)};
}

/// How `intersect_half_spaces` works.
export struct half_space_options {
  /// A set that is no wider than twice this distance is flat, and one whose half-spaces contradict
  /// each other by no more is not empty. In the unit of the offsets; 0 stands for what rounding
  /// asks for.
  double tolerance = 0;
};

/// Numbers that are found by index: a `std::vector`, an `std::array`, a span, a vector of Eigen's.
template <class T>
concept IndexedNumbers = requires(const T& numbers, index_t i) {
  { numbers[i] } -> std::convertible_to<double>;
  { numbers.size() } -> std::convertible_to<std::size_t>;
};

/// The set of all points x with normals.col(i) · x <= offsets[i] for all i; normals point out of it
/// and need no unit length. Half-spaces that say nothing new are dropped. No inner point is needed:
/// sets that are empty, flat or without end are results as any other.
///
/// Throws `invalid_input` for other than one offset per normal, for NaN and infinite normals, and
/// for planes that are farther than 10³⁰⁰ from the origin. A normal of zeros and an infinite offset
/// say all or nothing. By a linear program and the hull of the dual points.
export template <PointsSource P, IndexedNumbers O = std::vector<double>>
[[nodiscard]] convex_polytope<dimension_of<P>> intersect_half_spaces(
    const P& normals, const O& offsets, const half_space_options& options = {}) {
  const auto view = points_in(normals);
  expects(view.size() == static_cast<index_t>(offsets.size()),
          "intersect_half_spaces: there must be one offset per normal");
  Eigen::VectorXd numbers(view.size());
  for (index_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<double>(offsets[i]);
  return convex_polytope<dimension_of<P>>{
      make_intersection(view.matrix().template cast<double>(), numbers, options.tolerance)};
}

/// The image of a polytope under an affine map, which may be singular: then it is flat.
export template <int D, AffineMap T>
[[nodiscard]] convex_polytope<D> transform_polytope(const convex_polytope<D>& polytope,
                                                    const T& transform) {
  return convex_polytope<D>{transformed(polytope.data(), transform.linear().template cast<double>(),
                                        transform.translation().template cast<double>())};
}

}  // namespace cilantro
