// SPDX-License-Identifier: MIT
export module cilantro.core:points;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :indexed_iterator;

namespace cilantro {

/// Counts and indexes points. Signed, so that differences and loops downwards are safe.
export using index_t = std::ptrdiff_t;

/// A dimension that is known at run time only.
export inline constexpr int dynamic = -1;

/// The number types that the library computes with.
export template <class S>
concept Scalar = std::same_as<S, float> || std::same_as<S, double>;

template <int D>
inline constexpr int storage_order = D == 1 ? Eigen::RowMajor : Eigen::ColMajor;

/// A `Dim × N` matrix that owns points, or one vector a point, one column each. (Eigen wants a
/// matrix of one row to be row-major; its coordinates are adjacent either way.)
export template <Scalar S, int D>
using point_matrix = Eigen::Matrix<S, D, dynamic, storage_order<D>>;

/// One point or one direction.
export template <Scalar S, int D>
using point_vector = Eigen::Matrix<S, D, 1>;

/// A read-only `Dim × N` matrix of points, one per column, that owns nothing.
///
/// The coordinates of a point are adjacent in memory; consecutive points are `stride()` scalars
/// apart, so that the xyz of padded xyzw, or of interleaved point–normal records, is seen in place.
/// Also a random-access range of its columns, so that the standard views compose with it.
/// Valid while the storage it looks at is alive and not resized. Copying costs four words.
export template <Scalar S, int D>
class points_view {
 public:
  using scalar = S;
  using point_type = Eigen::Map<const point_vector<S, D>>;
  using stride_type = std::conditional_t<D == 1, Eigen::InnerStride<>, Eigen::OuterStride<>>;
  using matrix_type = Eigen::Map<const point_matrix<S, D>, Eigen::Unaligned, stride_type>;
  using iterator = indexed_iterator<points_view>;
  static constexpr int static_dimension = D;

  constexpr points_view() = default;

  /// `count` points at `data`, `stride` scalars from the start of one to the start of the next.
  /// Throws `invalid_input` for a negative count, a stride below D, or no data behind a count.
  constexpr points_view(const S* data, index_t count, index_t stride = D)
    requires(D != dynamic)
      : points_view{data, count, D, stride, checked{}} {}

  /// As above, with a dimension known at run time.
  constexpr points_view(const S* data, index_t count, index_t dimension, index_t stride)
    requires(D == dynamic)
      : points_view{data, count, dimension, stride, checked{}} {}

  /// Every fixed dimension can be looked at as one known at run time.
  template <int E>
    requires(D == dynamic && E != dynamic)
  constexpr points_view(points_view<S, E> other)
      : points_view{other.data(), other.size(), other.dimension(), other.stride()} {}

  [[nodiscard]] constexpr const S* data() const { return data_; }
  [[nodiscard]] constexpr index_t size() const { return size_; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] constexpr index_t dimension() const { return dimension_; }
  [[nodiscard]] constexpr index_t stride() const { return stride_; }

  /// All points as one `Dim × N` Eigen matrix, for linear algebra.
  [[nodiscard]] matrix_type matrix() const {
    return {data_, dimension_, size_, stride_type{stride_}};
  }

  /// Point `i`. Precondition: 0 <= i < size().
  [[nodiscard]] point_type operator[](index_t i) const {
    return point_type{data_ + i * stride_, dimension_};
  }

  /// `count` points from `first` on. Precondition: they are all there.
  [[nodiscard]] constexpr points_view slice(index_t first, index_t count) const {
    points_view part = *this;
    part.data_ += first * stride_;
    part.size_ = count;
    return part;
  }

  [[nodiscard]] iterator begin() const { return {*this, 0}; }
  [[nodiscard]] iterator end() const { return {*this, size_}; }

 private:
  struct checked {};
  constexpr points_view(const S* data, index_t count, index_t dimension, index_t stride, checked)
      : data_{data}, size_{count}, dimension_{dimension}, stride_{stride} {
    expects(count >= 0, "points_view: the number of points must not be negative");
    expects(dimension >= 0 && stride >= dimension,
            "points_view: the stride must be at least the dimension");
    expects(data != nullptr || count == 0 || dimension == 0,
            "points_view: the data must not be null");
  }

  const S* data_ = nullptr;
  index_t size_ = 0;
  index_t dimension_ = D == dynamic ? 0 : D;
  index_t stride_ = D == dynamic ? 0 : D;
};

/// How a type is seen as points. Specialise it for your own point set; one function is asked for:
///
///     template <> struct cilantro::points_traits<my_scan> {
///       static points_view<float, 3> view(const my_scan& s) { return {s.xyz, s.count, 4}; }
///     };
///
/// The view must look at the argument's own storage, not at a copy. Three more are used where they
/// are there: `normals(s)`, a view of one normal a point, of unit length or zero if unknown, or of
/// none at all; `colors(s)`, a `points_view<float, 3>` of one colour a point, or of none; and
/// `origin(s)`, a vector in double that is added to all points to have them in the world.
export template <class T>
struct points_traits;

template <class T>
concept EigenMatrix = std::derived_from<T, Eigen::MatrixBase<T>>;

/// Whether the coordinates of a point lie next to each other. Row-major matrices, and those with an
/// inner stride, keep them apart; a matrix of one row has one coordinate per point.
template <class T>
concept CoordinatesAreAdjacent = !EigenMatrix<T> || T::RowsAtCompileTime == 1 ||
                                 (!bool(T::IsRowMajor) && T::InnerStrideAtCompileTime == 1);

template <class T>
concept CoordinatesAreFloatOrDouble = !EigenMatrix<T> || Scalar<typename T::Scalar>;

/// Points, where an algorithm asks for points: Eigen matrices, maps and blocks with one point per
/// column; contiguous ranges of `std::array` or of fixed-size Eigen vectors; `points_view`; any
/// type with `points_traits`. Row-major matrices are not points: their coordinates are not
/// adjacent.
export template <class T>
concept PointsSource = CoordinatesAreAdjacent<std::remove_cvref_t<T>> &&
                       CoordinatesAreFloatOrDouble<std::remove_cvref_t<T>> &&
                       requires(const std::remove_cvref_t<T>& source) {
                         points_traits<std::remove_cvref_t<T>>::view(source).matrix();
                       };

/// The view type through which a `PointsSource` is seen, its scalar, and its dimension.
export template <PointsSource T>
using points_view_of = decltype(points_traits<std::remove_cvref_t<T>>::view(
    std::declval<const std::remove_cvref_t<T>&>()));
export template <PointsSource T>
using scalar_of = typename points_view_of<T>::scalar;
export template <PointsSource T>
inline constexpr int dimension_of = points_view_of<T>::static_dimension;

/// Whether a temporary `T` only looks at storage that outlives it. True for `points_view`, for
/// Eigen maps and blocks, and for what `std::ranges` calls borrowed; specialise it for your own
/// view.
export template <class T>
inline constexpr bool enable_borrowed_points = std::ranges::borrowed_range<T>;

/// Points that may be looked at after the call: not a temporary that takes its storage with it.
export template <class T>
concept BorrowedPoints = PointsSource<T> && (std::is_lvalue_reference_v<T> ||
                                             enable_borrowed_points<std::remove_cvref_t<T>>);

/// The view of `source`. It lives no longer than the storage behind it, so temporaries that own
/// their points are refused; algorithms that return before that take any `PointsSource` instead.
export template <BorrowedPoints T>
[[nodiscard]] auto as_points(T&& source) {
  return points_traits<std::remove_cvref_t<T>>::view(source);
}

/// The view of `source` for the length of a call, also of a temporary.
export template <PointsSource T>
[[nodiscard]] auto points_in(const T& source) {
  return points_traits<T>::view(source);
}

/// The dimension whose compiled code serves dimension D: 2, 3, or any at run time.
export template <int D>
inline constexpr int closed_dimension = D == 2 || D == 3 ? D : dynamic;

/// Points in that dimension, for the length of a call.
export template <PointsSource T>
[[nodiscard]] auto closed_points(const T& source)
    -> points_view<scalar_of<T>, closed_dimension<dimension_of<T>>> {
  return points_in(source);
}

template <Scalar S, int D>
struct points_traits<points_view<S, D>> {
  static auto view(points_view<S, D> v) { return v; }
};

/// An Eigen matrix, map or block, seen in its own storage; an expression has none.
template <class T>
concept ColumnMajorMatrix = EigenMatrix<T> && CoordinatesAreAdjacent<T> &&
                            CoordinatesAreFloatOrDouble<T> && requires(const T& m) {
                              { m.data() } -> std::same_as<const typename T::Scalar*>;
                              m.outerStride();
                            };

template <ColumnMajorMatrix T>
struct points_traits<T> {
  static constexpr int D = T::RowsAtCompileTime;
  static auto view(const T& m) {
    using view_type = points_view<typename T::Scalar, D>;
    if constexpr (D == dynamic)
      return view_type{m.data(), m.cols(), m.rows(), m.outerStride()};
    else if constexpr (D == 1)
      return view_type{m.data(), m.cols(), m.innerStride()};
    else
      return view_type{m.data(), m.cols(), m.outerStride()};
  }
};

template <class P, int M, class St>
inline constexpr bool enable_borrowed_points<Eigen::Map<P, M, St>> = true;
template <class P, int R, int C, bool I>
inline constexpr bool enable_borrowed_points<Eigen::Block<P, R, C, I>> = true;

/// The element of a contiguous range that is one point.
template <class P>
struct fixed_point;
template <Scalar S, std::size_t D>
struct fixed_point<std::array<S, D>> {
  using scalar = S;
  static constexpr int dimension = static_cast<int>(D);
};
template <Scalar S, int D, int O>
  requires(D > 0)
struct fixed_point<Eigen::Matrix<S, D, 1, O>> {
  using scalar = S;
  static constexpr int dimension = D;
};

template <class R>
concept ContiguousFixedPoints =
    !ColumnMajorMatrix<R> && std::ranges::contiguous_range<const R> &&
    std::ranges::sized_range<const R> &&
    requires { fixed_point<std::ranges::range_value_t<const R>>::dimension; };

template <ContiguousFixedPoints R>
struct points_traits<R> {
  static auto view(const R& range) {
    using point = std::ranges::range_value_t<const R>;
    using scalar = typename fixed_point<point>::scalar;
    static_assert(sizeof(point) % sizeof(scalar) == 0);
    return points_view<scalar, fixed_point<point>::dimension>{
        reinterpret_cast<const scalar*>(std::ranges::data(range)),
        static_cast<index_t>(std::ranges::size(range)),
        static_cast<index_t>(sizeof(point) / sizeof(scalar))};
  }
};

/// One truth value per point: of bool, or of the bytes in which masks are often kept.
export template <class R>
concept MaskRange = std::ranges::input_range<R> && std::integral<std::ranges::range_value_t<R>> &&
                    sizeof(std::ranges::range_value_t<R>) == 1;

/// Indices of points: integers, but not bytes, which mean a mask.
export template <class R>
concept IndexRange =
    std::ranges::input_range<R> && std::integral<std::ranges::range_value_t<R>> && !MaskRange<R>;

/// `i` as the library keeps it. Throws `invalid_input`, naming the function `who`, unless there is
/// such a point of `size`.
export template <std::integral I>
[[nodiscard]] std::int32_t checked_index(I i, index_t size, const char* who) {
  if (std::cmp_less(i, 0) || std::cmp_greater_equal(i, size))
    throw invalid_input{std::string{who} + ": the index " + std::to_string(i) +
                        " is out of range: there are " + std::to_string(size) + " points"};
  return static_cast<std::int32_t>(i);
}

/// Whether every coordinate of `point` is finite. Points that are not are never matched, never
/// averaged, and counted where a result has a place for the count.
export template <class Point>
[[nodiscard]] bool is_finite(const Point& point) {
  return point.allFinite();
}

/// How many of `points` have a coordinate that is NaN or infinite.
export template <PointsSource P>
[[nodiscard]] index_t count_non_finite(const P& points) {
  index_t count = 0;
  for (const auto& point : points_in(points)) count += !is_finite(point);
  return count;
}

}  // namespace cilantro

template <cilantro::Scalar S, int D>
inline constexpr bool std::ranges::enable_view<cilantro::points_view<S, D>> = true;
template <cilantro::Scalar S, int D>
inline constexpr bool std::ranges::enable_borrowed_range<cilantro::points_view<S, D>> = true;
