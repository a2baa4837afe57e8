// SPDX-License-Identifier: MIT
//
// Which types are accepted as points, and how they are viewed.
export module cilantro.core:points;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points_view;

namespace cilantro {

/// How a type is viewed as points. Specialise it for your own point set; one function is required:
///
///     template <> struct cilantro::points_traits<my_scan> {
///       static points_view<float, 3> view(const my_scan& s) { return {s.xyz, s.count, 4}; }
///     };
///
/// The view must look at the argument's own storage, not at a copy. Four more functions are
/// optional: `normals(s)`, a view of one normal per point, of unit length, or zero if unknown, or
/// an empty view; `colors(s)`, a `points_view<float, 3>` of one colour per point, or an empty view;
/// `origin(s)`, a vector in double that is added to all points to get world coordinates; and
/// `mutable_view(s)`, a `mutable_points_view`, which lets functions write to the points.
export template <class T>
struct points_traits;

template <class T>
concept EigenMatrix = std::derived_from<T, Eigen::MatrixBase<T>>;

/// Whether the coordinates of a point lie next to each other in memory. In row-major matrices, and
/// those with an inner stride, they do not; a matrix of one row has one coordinate per point.
template <class T>
concept CoordinatesAreAdjacent = !EigenMatrix<T> || T::RowsAtCompileTime == 1 ||
                                 (!bool(T::IsRowMajor) && T::InnerStrideAtCompileTime == 1);

template <class T>
concept CoordinatesAreFloatOrDouble = !EigenMatrix<T> || Scalar<typename T::Scalar>;

template <class T>
inline constexpr bool is_points_view = false;
template <Scalar S, int D>
inline constexpr bool is_points_view<points_view<S, D>> = true;
template <class T>
concept SomePointsView = is_points_view<T>;

/// What an algorithm accepts as points: Eigen matrices, maps and blocks with one point per column;
/// contiguous ranges of `std::array` or of fixed-size Eigen vectors; `points_view`; any type with
/// `points_traits`. Row-major matrices are not points: their coordinates are not adjacent.
export template <class T>
concept PointsSource = CoordinatesAreAdjacent<std::remove_cvref_t<T>> &&
                       CoordinatesAreFloatOrDouble<std::remove_cvref_t<T>> &&
                       requires(const std::remove_cvref_t<T>& source) {
                         { points_traits<std::remove_cvref_t<T>>::view(source) } -> SomePointsView;
                       };

/// The type of the view of a `PointsSource`, its scalar, and its dimension.
export template <PointsSource T>
using points_view_of = decltype(points_traits<std::remove_cvref_t<T>>::view(
    std::declval<const std::remove_cvref_t<T>&>()));
export template <PointsSource T>
using scalar_of = typename points_view_of<T>::scalar;
export template <PointsSource T>
inline constexpr int dimension_of = points_view_of<T>::static_dimension;

/// Whether a `T` only looks at storage that outlives it, so that views of a temporary `T` stay
/// valid. True for `points_view`, for Eigen maps and blocks, and for what `std::ranges` calls
/// borrowed; specialise it for your own view.
export template <class T>
inline constexpr bool enable_borrowed_points = std::ranges::borrowed_range<T>;

/// Points that a view may still look at after the call: not a temporary that owns its storage.
export template <class T>
concept BorrowedPoints = PointsSource<T> && (std::is_lvalue_reference_v<T> ||
                                             enable_borrowed_points<std::remove_cvref_t<T>>);

/// The view of `source`, valid as long as the storage behind it. Temporaries that own their points
/// do not compile; algorithms that need the points only during the call take any `PointsSource`
/// instead.
export template <BorrowedPoints T>
[[nodiscard]] auto as_points(T&& source) {
  return points_traits<std::remove_cvref_t<T>>::view(source);
}

/// The view of `source` for the duration of a call; `source` may be a temporary.
export template <PointsSource T>
[[nodiscard]] auto points_in(const T& source [[clang::lifetimebound]]) {
  return points_traits<T>::view(source);
}

/// Points that a function can write to: an Eigen matrix, block or map, a `std::vector` or span of
/// fixed-size points, or a type whose `points_traits` have `mutable_view`, if not `const`.
/// Temporaries only if they look at storage that outlives them.
export template <class T>
concept MutablePoints = BorrowedPoints<T> && requires(std::remove_reference_t<T>& target) {
  {
    points_traits<std::remove_cvref_t<T>>::mutable_view(target)
  } -> std::same_as<mutable_points_view<scalar_of<T>, dimension_of<T>>>;
};

/// The view of `target` for writing.
export template <MutablePoints T>
[[nodiscard]] auto mutable_points_in(T&& target) {
  return points_traits<std::remove_cvref_t<T>>::mutable_view(target);
}

/// The library is compiled for 2, 3 and any dimension; this is which of them serves D.
export template <int D>
inline constexpr int closed_dimension = D == 2 || D == 3 ? D : dynamic;

/// The view of `source` in that dimension, for the duration of a call.
export template <PointsSource T>
[[nodiscard]] auto closed_points(const T& source)
    -> points_view<scalar_of<T>, closed_dimension<dimension_of<T>>> {
  return points_in(source);
}

template <Scalar S, int D>
struct points_traits<points_view<S, D>> {
  static points_view<S, D> view(points_view<S, D> v) { return v; }
};
template <Scalar S, int D>
struct points_traits<mutable_points_view<S, D>> {
  static points_view<S, D> view(mutable_points_view<S, D> v) { return v; }
  static mutable_points_view<S, D> mutable_view(mutable_points_view<S, D> v) { return v; }
};

/// An Eigen matrix, map or block with storage of its own, which an expression does not have.
template <class T>
concept ColumnMajorMatrix = EigenMatrix<T> && CoordinatesAreAdjacent<T> &&
                            CoordinatesAreFloatOrDouble<T> && requires(const T& m) {
                              { m.data() } -> std::same_as<const typename T::Scalar*>;
                              m.outerStride();
                            };

template <ColumnMajorMatrix T>
struct points_traits<T> {
  static points_view<typename T::Scalar, T::RowsAtCompileTime> view(const T& m) {
    return seen_as<points_view<typename T::Scalar, D>>(m);
  }
  static auto mutable_view(T& m)
    requires requires {
      { m.data() } -> std::same_as<typename T::Scalar*>;
    }
  {
    return seen_as<mutable_points_view<typename T::Scalar, D>>(m);
  }

 private:
  static constexpr int D = T::RowsAtCompileTime;
  template <class View, class M>
  static View seen_as(M& m) {
    if constexpr (D == dynamic)
      return {m.data(), m.cols(), m.rows(), m.outerStride()};
    else if constexpr (D == 1)
      return {m.data(), m.cols(), m.innerStride()};
    else
      return {m.data(), m.cols(), m.outerStride()};
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
 private:
  using point = std::ranges::range_value_t<const R>;
  using scalar = typename fixed_point<point>::scalar;
  static constexpr int dimension = fixed_point<point>::dimension;
  static_assert(sizeof(point) % sizeof(scalar) == 0);

 public:
  static points_view<scalar, dimension> view(const R& range) {
    return seen_as<points_view<scalar, dimension>>(range);
  }
  static auto mutable_view(R& range)
    requires(!std::is_const_v<std::remove_reference_t<std::ranges::range_reference_t<R>>>)
  {
    return seen_as<mutable_points_view<scalar, dimension>>(range);
  }

 private:
  template <class View, class Range>
  static View seen_as(Range& range) {
    using data_type = decltype(std::declval<const View&>().data());
    return {reinterpret_cast<data_type>(std::ranges::data(range)),
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

/// `i` as a 32-bit index. Throws `invalid_input`, naming `who`, unless 0 <= i < size.
export template <std::integral I>
[[nodiscard]] std::int32_t checked_index(I i, index_t size, const char* who) {
  if (std::cmp_less(i, 0) || std::cmp_greater_equal(i, size))
    throw invalid_input{std::string{who} + ": the index " + std::to_string(i) +
                        " is out of range: there are " + std::to_string(size) + " points"};
  return static_cast<std::int32_t>(i);
}

/// Whether every coordinate of `point` is finite. Throughout the library, points that are not
/// finite are never matched or averaged; some results report how many there were.
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
