// SPDX-License-Identifier: MIT
export module cilantro.registration:feature_space;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;

namespace cilantro {

/// A space in which points of two sets are compared by more, or by something else, than where they
/// are: normals, colours, descriptors.
///
/// Semantics: `target()` are the features of the target points, one a column, as `points_view`.
/// `source_size()` is the number of source points. `moved_by(transform)` returns a function
/// `f(i, out)` that writes to `out` the feature of source point i once it has been moved, as many
/// scalars as a target feature has. Distances are Euclidean, so that weights are factors of the
/// coordinates. Const, and called from several threads at once; a feature that is not finite is in
/// no pair. Models: `point_features`, `joint_features`; `check_feature_space` tests yours.
export template <class F, class T>
concept FeatureSpace =
    requires(const F& space, const T& transform, index_t i, typename T::Scalar* out) {
      { space.target().size() } -> std::convertible_to<index_t>;
      requires PointsSource<decltype(space.target())>;
      requires std::same_as<scalar_of<decltype(space.target())>, typename T::Scalar>;
      { space.source_size() } -> std::convertible_to<index_t>;
      { space.moved_by(transform)(i, out) } -> std::same_as<void>;
    };

/// The points themselves. Views them.
export template <Scalar S, int D>
class point_features {
 public:
  /// Throws `invalid_input` for points of different dimension.
  template <BorrowedPoints T, BorrowedPoints P>
  point_features(P&& source, T&& target)
      : target_{as_points(std::forward<T>(target))}, source_{as_points(std::forward<P>(source))} {
    expects(target_.dimension() == source_.dimension(),
            "point_features: target and source must have the same dimension");
  }

  [[nodiscard]] points_view<S, D> target() const { return target_; }
  [[nodiscard]] index_t source_size() const { return source_.size(); }
  template <AffineMap T>
  [[nodiscard]] auto moved_by(const T& transform) const {
    return [this, &transform](index_t i, S* out) {
      Eigen::Map<point_vector<S, D>>{out, source_.dimension()} =
          transform.linear() * source_[i] + transform.translation();
    };
  }

 private:
  points_view<S, D> target_, source_;
};
export template <PointsSource T, PointsSource P>
point_features(T&&, P&&) -> point_features<scalar_of<T>, dimension_of<T>>;

/// How much normals and colours count beside places; what has weight 0 is left out.
export struct feature_weights {
  double normals = 0;  ///< Units of length for each unit of difference between unit normals.
  double colors = 0;   ///< Units of length for each unit of difference in the cube of colours.
};

/// Places together with normals, colours, or both: vectors (p, w·n, w·c). Moving a cloud turns its
/// normals and leaves its colours. Views the source, copies the features of the target.
export template <Scalar S, int D>
class joint_features {
 public:
  /// Throws `invalid_input` if a cloud lacks what has a weight, for clouds of different dimension,
  /// and for weights that are negative or not finite.
  joint_features(const point_cloud<S, D>& source, const point_cloud<S, D>& target,
                 const feature_weights& weights)
      : source_{source}, weights_{weights} {
    expects(weights.normals >= 0 && std::isfinite(weights.normals) && weights.colors >= 0 &&
                std::isfinite(weights.colors),
            "joint_features: weights must be finite and not negative");
    expects(target.dimension() == source.dimension(),
            "joint_features: target and source must have the same dimension");
    for (const auto* cloud : {&target, &source}) {
      expects(weights.normals == 0 || cloud->normals.cols() == cloud->size(),
              "joint_features: a cloud has not one normal a point; estimate them first");
      expects(weights.colors == 0 || cloud->colors.cols() == cloud->size(),
              "joint_features: a cloud has not one color a point");
    }
    const index_t d = target.dimension();
    features_.resize(d + normal_rows(d) + color_rows(), target.size());
    for (index_t i = 0; i < target.size(); ++i) {
      features_.col(i).head(d) = target.points.col(i);
      if (normal_rows(d) > 0)
        features_.col(i).segment(d, d) = static_cast<S>(weights.normals) * target.normals.col(i);
      if (color_rows() > 0) features_.col(i).tail(3) = color(target, i);
    }
  }
  /// A temporary source would be gone before the first search.
  joint_features(point_cloud<S, D>&&, const point_cloud<S, D>&, const feature_weights&) = delete;

  [[nodiscard]] points_view<S, dynamic> target() const { return as_points(features_); }
  [[nodiscard]] index_t source_size() const { return source_.size(); }
  template <AffineMap T>
  [[nodiscard]] auto moved_by(const T& transform) const {
    // Normals of a surface move by the inverse transpose; of a rigid one, by the rotation itself.
    Eigen::Matrix<S, D, D> turn = transform.linear();
    if constexpr (!RigidMap<T>)
      if (weights_.normals > 0) turn = transform.inverse().linear().transpose();
    return [this, &transform, turn](index_t i, S* out) {
      const index_t d = source_.dimension();
      Eigen::Map<Eigen::Matrix<S, dynamic, 1>> feature{out, features_.rows()};
      feature.head(d) = transform.linear() * source_.points.col(i) + transform.translation();
      if (normal_rows(d) > 0) {
        point_vector<S, D> normal = turn * source_.normals.col(i);
        if (const S length = normal.norm(); length > 0) normal /= length;
        feature.segment(d, d) = static_cast<S>(weights_.normals) * normal;
      }
      if (color_rows() > 0) feature.tail(3) = color(source_, i);
    };
  }

 private:
  [[nodiscard]] index_t normal_rows(index_t d) const { return weights_.normals > 0 ? d : 0; }
  [[nodiscard]] index_t color_rows() const { return weights_.colors > 0 ? 3 : 0; }
  [[nodiscard]] Eigen::Matrix<S, 3, 1> color(const point_cloud<S, D>& cloud, index_t i) const {
    return static_cast<S>(weights_.colors) * cloud.colors.col(i).template cast<S>();
  }

  const point_cloud<S, D>& source_;
  feature_weights weights_;
  Eigen::Matrix<S, dynamic, dynamic> features_;
};

}  // namespace cilantro
