// SPDX-License-Identifier: MIT
//
// Checks where matrices whose size is known at run time meet matrices of fixed size. Eigen checks
// this only in debug builds, and otherwise reads or writes beyond the smaller of the two; here it
// is checked in every build.
export module cilantro.core:sizes;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points;

namespace cilantro {

/// Throws `invalid_input` unless `found`, the number of coordinates of a point, is `wanted`.
export inline void expect_coordinates(index_t found, index_t wanted) {
  if (found != wanted)
    throw invalid_input{"a point has " + std::to_string(found) + " coordinates, and " +
                        std::to_string(wanted) + " are expected"};
}

template <class V, int D>
concept VectorOf = EigenMatrix<V> && V::ColsAtCompileTime == 1 &&
                   (D == dynamic || V::RowsAtCompileTime == D || V::RowsAtCompileTime == dynamic);

/// A point or a direction as an argument: any Eigen vector of that scalar, viewed without a copy.
/// Throws `invalid_input` if the vector does not have D coordinates.
export template <Scalar S, int D>
class point_ref : public Eigen::Ref<const point_vector<S, D>> {
 public:
  template <class V>
    requires VectorOf<V, D> && std::same_as<typename V::Scalar, S>
  point_ref(const Eigen::MatrixBase<V>& point)  // NOLINT: a conversion on purpose
      : Eigen::Ref<const point_vector<S, D>>{checked(point.derived())} {}

 private:
  template <class V>
  static const V& checked(const V& point) {
    if constexpr (D != dynamic) expect_coordinates(point.size(), D);
    return point;
  }
};

/// A point of any scalar, converted to double. Throws `invalid_input` unless it has `dimension`
/// coordinates.
export template <int D, class V>
  requires VectorOf<V, D> || (D == dynamic && EigenMatrix<V>)
[[nodiscard]] point_vector<double, D> in_double(const Eigen::MatrixBase<V>& point,
                                                index_t dimension) {
  expect_coordinates(point.size(), dimension);
  return point.template cast<double>();
}

/// A type that can be assigned to a matrix of type M, as far as the types tell.
template <class V, class M>
concept MatrixFitFor = std::derived_from<V, Eigen::DenseBase<V>> &&
                       std::same_as<typename V::Scalar, typename M::Scalar> &&
                       (V::RowsAtCompileTime == dynamic || M::RowsAtCompileTime == dynamic ||
                        int(V::RowsAtCompileTime) == int(M::RowsAtCompileTime)) &&
                       (V::ColsAtCompileTime == dynamic || M::ColsAtCompileTime == dynamic ||
                        int(V::ColsAtCompileTime) == int(M::ColsAtCompileTime));

/// An Eigen matrix that checks sizes on assignment: throws `invalid_input` for a matrix whose
/// run-time size does not match its own fixed one, such as N × 3 for `3 × N`.
export template <class M>
class sized : public M {
 public:
  sized() = default;
  sized(const M& matrix) : M(matrix) {}                 // NOLINT: conversions on purpose
  sized(M&& matrix) noexcept : M(std::move(matrix)) {}  // NOLINT
  template <MatrixFitFor<M> V>
  sized(const Eigen::DenseBase<V>& matrix)  // NOLINT
      : M(checked(matrix.derived())) {}

  sized& operator=(const M& matrix) {
    M::operator=(matrix);
    return *this;
  }
  sized& operator=(M&& matrix) noexcept {
    M::operator=(std::move(matrix));
    return *this;
  }
  template <MatrixFitFor<M> V>
  sized& operator=(const Eigen::DenseBase<V>& matrix) {
    M::operator=(checked(matrix.derived()));
    return *this;
  }

 private:
  template <class V>
  static const V& checked(const V& matrix) {
    constexpr index_t rows = M::RowsAtCompileTime, columns = M::ColsAtCompileTime;
    if ((rows != dynamic && matrix.rows() != rows) ||
        (columns != dynamic && matrix.cols() != columns))
      refuse(matrix.rows(), matrix.cols(), rows, columns);
    return matrix;
  }
  [[noreturn]] static void refuse(index_t rows, index_t columns, index_t wanted_rows,
                                  index_t wanted_columns) {
    const auto size = [](index_t n) { return n == dynamic ? std::string{"N"} : std::to_string(n); };
    const std::string wanted = size(wanted_rows) + " x " + size(wanted_columns);
    throw invalid_input{"a matrix of " + std::to_string(rows) + " x " + std::to_string(columns) +
                        " cannot be put into one of " + wanted +
                        (columns == wanted_rows ? ": points are columns, so transpose it" : "")};
  }
};

template <class M>
  requires requires(const M& matrix) { points_traits<M>::view(matrix); }
struct points_traits<sized<M>> {
  static auto view(const sized<M>& matrix) { return points_traits<M>::view(matrix); }
  static auto mutable_view(sized<M>& matrix) { return points_traits<M>::mutable_view(matrix); }
};

}  // namespace cilantro
