// SPDX-License-Identifier: MIT
export module cilantro.registration:feature_space;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A space in which points of two sets are compared not only by their places, but also, or instead,
/// by normals, colours or descriptors.
///
/// Semantics: `target()` is a `points_view` of the features of the target points, one per column.
/// `source_size()` is the number of source points. `moved_by(transform)` returns a function `f(i,
/// out)` that writes the feature of source point i, after the transform, to `out`, with as many
/// scalars as a target feature has. Distances between features are Euclidean, so that coordinates
/// are weighted by scaling them. All functions are const, and called from several threads at once;
/// a point whose feature is not finite is in no pair. Models: `point_features`, `joint_features`;
/// `check_feature_space` tests yours.
export template <class F, class T>
concept FeatureSpace =
    requires(const F& space, const T& transform, index_t i, typename T::Scalar* out) {
      { space.target().size() } -> std::convertible_to<index_t>;
      requires PointsSource<decltype(space.target())>;
      requires std::same_as<scalar_of<decltype(space.target())>, typename T::Scalar>;
      { space.source_size() } -> std::convertible_to<index_t>;
      { space.moved_by(transform)(i, out) } -> std::same_as<void>;
    };

/// The points themselves as features. Views them.
export template <Scalar S, int D>
class point_features {
 public:
  /// Throws `invalid_input` for points of different dimension or origin.
  template <BorrowedPoints T, BorrowedPoints P>
  point_features(P&& source, T&& target)
      : target_{as_points(std::forward<T>(target))}, source_{as_points(std::forward<P>(source))} {
    expects(target_.dimension() == source_.dimension(),
            "point_features: target and source must have the same dimension");
    expect_same_origin(source, target, "point_features");
  }

  [[nodiscard]] points_view<S, D> target() const { return target_; }
  [[nodiscard]] index_t source_size() const { return source_.size(); }
  /// Keeps the map by reference. Throws `invalid_input` if the map is for another dimension or
  /// number of points.
  template <PointMap<D> M>
  [[nodiscard]] auto moved_by(const M& map [[clang::lifetimebound]]) const {
    expect_moves(map, source_, "point_features");
    return [this, &map](index_t i, S* out) {
      Eigen::Map<point_vector<S, D>>{out, source_.dimension()} = moved_point(map, i, source_[i]);
    };
  }

 private:
  points_view<S, D> target_, source_;
};
export template <PointsSource T, PointsSource P>
point_features(T&&, P&&) -> point_features<scalar_of<T>, dimension_of<T>>;

/// How much normals and colours count beside places; with weight 0 they are left out.
export struct feature_weights {
  double normals = 0;  ///< Units of length for each unit of difference between unit normals.
  double colors = 0;   ///< Units of length for each unit of difference in the cube of colours.
};

/// Places together with normals, colours, or both, as features (p, w·n, w·c). A transform moves
/// points, turns their normals, and leaves their colours unchanged. Views the source, and keeps a
/// copy of the target's features.
export template <Scalar S, int D>
class joint_features {
 public:
  /// Source and target are clouds, or any points whose type provides the normals and colours that
  /// have a weight. Throws `invalid_input` if one of them lacks these, for points of different
  /// dimension or origin, and for weights that are negative or not finite.
  template <BorrowedPoints T, BorrowedPoints P>
  joint_features(P&& source, T&& target, const feature_weights& weights)
      : source_{as_points(source), normals_in(source), colors_in(source)}, weights_{weights} {
    expect_same_origin(source, target, "joint_features");
    take(described_points{as_points(target), normals_in(target), colors_in(target)});
  }

  [[nodiscard]] points_view<S, dynamic> target() const [[clang::lifetimebound]] {
    return as_points(features_);
  }
  [[nodiscard]] index_t source_size() const { return source_.points.size(); }
  /// Keeps the map by reference. Throws `invalid_input` if the map is for another dimension or
  /// number of points, or does not turn normals although these have a weight.
  template <PointMap<D> M>
  [[nodiscard]] auto moved_by(const M& map [[clang::lifetimebound]]) const {
    expect_moves(map, source_.points, "joint_features");
    using vector = point_vector<S, D>;
    std::function<vector(index_t, const vector&)> turned;
    if (weights_.normals > 0) {
      if constexpr (NormalMap<M, D>)
        turned = normals_moved_by<D>(map);
      else
        throw invalid_input{"joint_features: the map has no member normal(i, n)"};
    }
    return [this, &map, turned = std::move(turned)](index_t i, S* out) {
      const index_t d = source_.points.dimension();
      Eigen::Map<Eigen::Matrix<S, dynamic, 1>> feature{out, features_.rows()};
      feature.head(d) = moved_point(map, i, source_.points[i]);
      if (normal_rows(d) > 0) {
        vector normal = turned(i, source_.normals[i]);
        if (const S length = normal.norm(); length > 0) normal /= length;
        feature.segment(d, d) = static_cast<S>(weights_.normals) * normal;
      }
      if (color_rows() > 0) feature.tail(3) = color(source_, i);
    };
  }

 private:
  struct described_points {
    points_view<S, D> points, normals;
    points_view<float, 3> colors;
  };

  void take(const described_points& target) {
    expect_from(0, weights_.normals, "joint_features: the weight of normals");
    expect_from(0, weights_.colors, "joint_features: the weight of colors");
    const index_t d = target.points.dimension();
    expects(d == source_.points.dimension(),
            "joint_features: target and source must have the same dimension");
    for (const auto* set : std::initializer_list<const described_points*>{&target, &source_}) {
      expects(weights_.normals == 0 || set->normals.size() == set->points.size(),
              "joint_features: there must be one normal per point; estimate them first");
      expects(weights_.normals == 0 || set->normals.empty() || set->normals.dimension() == d,
              "joint_features: normals and points differ in dimension");
      expects(weights_.colors == 0 || set->colors.size() == set->points.size(),
              "joint_features: there must be one color per point");
    }
    features_.resize(d + normal_rows(d) + color_rows(), target.points.size());
    for (index_t i = 0; i < target.points.size(); ++i) {
      features_.col(i).head(d) = target.points[i];
      if (normal_rows(d) > 0)
        features_.col(i).segment(d, d) = static_cast<S>(weights_.normals) * target.normals[i];
      if (color_rows() > 0) features_.col(i).tail(3) = color(target, i);
    }
  }
  [[nodiscard]] index_t normal_rows(index_t d) const { return weights_.normals > 0 ? d : 0; }
  [[nodiscard]] index_t color_rows() const { return weights_.colors > 0 ? 3 : 0; }
  [[nodiscard]] Eigen::Matrix<S, 3, 1> color(const described_points& set, index_t i) const {
    return static_cast<S>(weights_.colors) * set.colors[i].template cast<S>();
  }

  described_points source_;
  feature_weights weights_;
  Eigen::Matrix<S, dynamic, dynamic> features_;
};
export template <PointsSource T, PointsSource P>
joint_features(P&&, T&&, const feature_weights&) -> joint_features<scalar_of<T>, dimension_of<T>>;

}  // namespace cilantro
