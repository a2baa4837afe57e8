// SPDX-License-Identifier: MIT
export module cilantro.core:coordinates;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points;

namespace cilantro {

/// One point of any dimension, kept in double: for options and steps that are set before the scalar
/// and dimension of the points are known, such as a viewpoint or the edges of a cell.
export class coordinates {
 public:
  coordinates(std::initializer_list<double> values) : values_{values} {}
  template <class V>
    requires(std::derived_from<V, Eigen::MatrixBase<V>> && bool(V::IsVectorAtCompileTime))
  coordinates(const V& vector) {  // NOLINT: a conversion on purpose
    for (index_t d = 0; d < vector.size(); ++d) values_.push_back(double(vector[d]));
  }
  template <Scalar S, std::size_t D>
  coordinates(const std::array<S, D>& point)  // NOLINT
      : values_(point.begin(), point.end()) {}

  [[nodiscard]] index_t size() const { return std::ssize(values_); }
  [[nodiscard]] double operator[](index_t d) const { return values_[d]; }

  /// The point as a vector of `dimension` coordinates. Throws `invalid_input{what}` if it has
  /// another number of coordinates.
  template <Scalar S, int D>
  [[nodiscard]] point_vector<S, D> as(index_t dimension, const char* what) const {
    expects(size() == dimension, what);
    point_vector<S, D> point(dimension);
    for (index_t d = 0; d < dimension; ++d) point[d] = static_cast<S>((*this)[d]);
    return point;
  }

 private:
  std::vector<double> values_;
};

}  // namespace cilantro
