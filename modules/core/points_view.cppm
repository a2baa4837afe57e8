// SPDX-License-Identifier: MIT
//
// Views of points in memory that they do not own, for reading and for writing.
export module cilantro.core:points_view;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :indexed_iterator;

namespace cilantro {

/// Counts and indexes points. Signed, so that differences and loops downwards are safe.
export using index_t = std::ptrdiff_t;

/// A list of indices of points: 32 bits each, since no set has more than 2³¹ − 1 points.
export using index_list = std::vector<std::int32_t>;

/// Stands for a dimension in template arguments where it is known only at run time, as
/// `Eigen::Dynamic` does.
export inline constexpr int dynamic = -1;

/// The number types that the library computes with.
export template <class S>
concept Scalar = std::same_as<S, float> || std::same_as<S, double>;

template <int D>
inline constexpr int storage_order = D == 1 ? Eigen::RowMajor : Eigen::ColMajor;

/// A `Dim × N` matrix that owns points, or vectors that belong to points, one per column. (Eigen
/// requires a matrix of one row to be row-major; its coordinates are adjacent either way.)
export template <Scalar S, int D>
using point_matrix = Eigen::Matrix<S, D, dynamic, storage_order<D>>;

/// One point or one direction.
export template <Scalar S, int D>
using point_vector = Eigen::Matrix<S, D, 1>;

/// A read-only `Dim × N` matrix of points, one per column, that owns nothing.
///
/// The coordinates of a point are adjacent in memory; consecutive points start `stride()` scalars
/// apart, so that it can view the xyz of padded xyzw, or of interleaved point–normal records,
/// without a copy. Also a random-access range of its points, so that the standard views compose
/// with it. Valid while the storage it looks at is alive and not resized. Copying costs four words.
export template <Scalar S, int D>
class points_view {
 public:
  using scalar = S;
  using point_type = Eigen::Map<const point_vector<S, D>>;
  using value_type = point_vector<S, D>;  ///< A copy of a point, as a container would store it.
  using stride_type = std::conditional_t<D == 1, Eigen::InnerStride<>, Eigen::OuterStride<>>;
  using matrix_type = Eigen::Map<const point_matrix<S, D>, Eigen::Unaligned, stride_type>;
  using iterator = indexed_iterator<points_view>;
  static constexpr int static_dimension = D;

  constexpr points_view() = default;

  /// `count` points at `data`, `stride` scalars from the start of one to the start of the next.
  /// Throws `invalid_input` for a negative count, a stride below D, or null data for a count above
  /// 0.
  constexpr points_view(const S* data, index_t count, index_t stride = D)
    requires(D != dynamic)
      : points_view{data, count, D, stride, checked{}} {}

  /// As above, with a dimension known at run time.
  constexpr points_view(const S* data, index_t count, index_t dimension, index_t stride)
    requires(D == dynamic)
      : points_view{data, count, dimension, stride, checked{}} {}

  /// A view of a fixed dimension converts to one whose dimension is known at run time.
  template <int E>
    requires(D == dynamic && E != dynamic)
  constexpr points_view(points_view<S, E> other)
      : points_view{other.data(), other.size(), other.dimension(), other.stride()} {}

  [[nodiscard]] constexpr const S* data() const { return data_; }
  [[nodiscard]] constexpr index_t size() const { return size_; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] constexpr index_t dimension() const { return dimension_; }
  /// The scalars from the start of a point to the start of the next.
  [[nodiscard]] constexpr index_t stride() const { return stride_; }

  /// All points as one `Dim × N` Eigen matrix, for linear algebra.
  [[nodiscard]] matrix_type matrix() const {
    return {data_, dimension_, size_, stride_type{stride_}};
  }

  /// Point `i`. Precondition: 0 <= i < size().
  [[nodiscard]] point_type operator[](index_t i) const {
    return point_type{data_ + i * stride_, dimension_};
  }

  /// `count` points from `first` on. Precondition: 0 <= first, 0 <= count, first + count <= size().
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

/// As `points_view`, of points that may be written to, such as normals that a function turns.
/// Writing to an element changes the memory that it looks at.
export template <Scalar S, int D>
class mutable_points_view {
 public:
  using scalar = S;
  using point_type = Eigen::Map<point_vector<S, D>>;
  using value_type = point_vector<S, D>;
  using matrix_type =
      Eigen::Map<point_matrix<S, D>, Eigen::Unaligned, typename points_view<S, D>::stride_type>;
  using iterator = indexed_iterator<mutable_points_view>;
  static constexpr int static_dimension = D;

  constexpr mutable_points_view() = default;
  /// As the constructors of `points_view`.
  constexpr mutable_points_view(S* data, index_t count, index_t stride = D)
    requires(D != dynamic)
      : data_{data}, shape_{data, count, stride} {}
  constexpr mutable_points_view(S* data, index_t count, index_t dimension, index_t stride)
    requires(D == dynamic)
      : data_{data}, shape_{data, count, dimension, stride} {}
  template <int E>
    requires(D == dynamic && E != dynamic)
  constexpr mutable_points_view(mutable_points_view<S, E> other)
      : mutable_points_view{other.data(), other.size(), other.dimension(), other.stride()} {}

  /// The same points, read-only.
  constexpr operator points_view<S, D>() const {
    return shape_;
  }  // NOLINT: a conversion on purpose

  [[nodiscard]] constexpr S* data() const { return data_; }
  [[nodiscard]] constexpr index_t size() const { return shape_.size(); }
  [[nodiscard]] constexpr bool empty() const { return shape_.empty(); }
  [[nodiscard]] constexpr index_t dimension() const { return shape_.dimension(); }
  /// The scalars from the start of a point to the start of the next.
  [[nodiscard]] constexpr index_t stride() const { return shape_.stride(); }

  /// All points as one `Dim × N` Eigen matrix.
  [[nodiscard]] matrix_type matrix() const {
    return {data_, dimension(), size(), typename points_view<S, D>::stride_type{stride()}};
  }
  /// Point `i`, to be written to. Precondition: 0 <= i < size().
  [[nodiscard]] point_type operator[](index_t i) const {
    return point_type{data_ + i * stride(), dimension()};
  }
  [[nodiscard]] iterator begin() const { return {*this, 0}; }
  [[nodiscard]] iterator end() const { return {*this, size()}; }

 private:
  S* data_ = nullptr;
  points_view<S, D> shape_;
};

}  // namespace cilantro

template <cilantro::Scalar S, int D>
inline constexpr bool std::ranges::enable_view<cilantro::points_view<S, D>> = true;
template <cilantro::Scalar S, int D>
inline constexpr bool std::ranges::enable_borrowed_range<cilantro::points_view<S, D>> = true;
template <cilantro::Scalar S, int D>
inline constexpr bool std::ranges::enable_view<cilantro::mutable_points_view<S, D>> = true;
template <cilantro::Scalar S, int D>
inline constexpr bool std::ranges::enable_borrowed_range<cilantro::mutable_points_view<S, D>> =
    true;
