// SPDX-License-Identifier: MIT
export module cilantro.core:any_transform;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points;
import :transform;

namespace cilantro {

/// An affine transform of any dimension, kept in double: for options that are set before the scalar
/// and dimension of the points are known. Converts from every `AffineMap` and from a matrix of
/// homogeneous coordinates; is itself an `AffineMap`.
export class any_transform : public run_time_transform<double, Eigen::Affine> {
 public:
  /// A transform of dimension 0.
  any_transform() = default;
  template <AffineMap T>
    requires(!std::derived_from<T, any_transform>)
  any_transform(const T& transform)  // NOLINT: conversions on purpose
      : run_time_transform{transform.linear().template cast<double>(),
                           transform.translation().template cast<double>()} {}
  /// Throws `invalid_input` unless the matrix is square and its last row is (0, …, 0, 1).
  template <class M>
    requires cilantro::Scalar<typename M::Scalar>
  any_transform(const Eigen::MatrixBase<M>& homogeneous)  // NOLINT
      : run_time_transform{from(homogeneous.template cast<double>())} {}

  /// The transform as a T, for points of `dimension` coordinates. Throws `invalid_input{what}` if
  /// its dimension differs.
  template <AffineMap T>
  [[nodiscard]] T as(index_t dimension, const char* what) const {
    constexpr int D =
        std::remove_cvref_t<decltype(std::declval<const T&>().translation())>::SizeAtCompileTime;
    expects(translation().size() == dimension && (D == dynamic || D == dimension), what);
    return make_transform<T>(linear(), translation());
  }

 private:
  static run_time_transform from(const Eigen::MatrixXd& homogeneous) {
    const index_t d = homogeneous.rows() - 1;
    expects(d >= 0 && homogeneous.cols() == d + 1 &&
                homogeneous.row(d) == Eigen::RowVectorXd::Unit(d + 1, d),
            "the last row of a matrix of homogeneous coordinates must be 0, …, 0, 1");
    expects(homogeneous.allFinite(), "a matrix of homogeneous coordinates must be finite");
    return {homogeneous.topLeftCorner(d, d), homogeneous.col(d).head(d)};
  }
};

}  // namespace cilantro
