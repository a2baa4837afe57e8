// SPDX-License-Identifier: MIT
//
// The functions on clouds as steps of a pipeline: the same calls without the cloud. Steps that only
// choose points are in `filters`, beside their functions.
export module cilantro.cloud:steps;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :combine;
import :estimate;
import :pipeline;
import :point_cloud;

namespace cilantro {

/// The reach of a step that looks at such neighbourhoods.
[[nodiscard]] inline step_reach reach_of_neighborhoods(const neighborhood_spec& spec) {
  if (spec.max_distance() < std::numeric_limits<double>::infinity())
    return {.distance = spec.max_distance()};
  return {.neighbors = spec.max_count()};
}

/// `voxel_downsample` of clouds as a step. Members are its arguments: `size` and `options`.
export struct voxel_downsample_step : pipeline_step {
  voxel_size size;
  voxel_downsample_options options;

  static constexpr const char* name = "voxel_downsample";
  explicit voxel_downsample_step(voxel_size edges, voxel_downsample_options how = {})
      : size(std::move(edges)), options(std::move(how)) {}
  /// The longest edge of a cell. (If a cloud is split along cell boundaries, no margin is needed.)
  [[nodiscard]] step_reach reach() const { return {.distance = size.largest()}; }
  template <Scalar S, int D>
  point_cloud<S, D> operator()(const point_cloud<S, D>& cloud) const {
    return voxel_downsample(cloud, size, options);
  }
};
export [[nodiscard]] auto voxel_downsample(voxel_size size, voxel_downsample_options options = {}) {
  return voxel_downsample_step{std::move(size), std::move(options)};
}

/// `estimate_normals` of clouds as a step. Members are its arguments: `spec`, `estimate` and
/// `options`. `E` is the type of the covariance estimator; void for that of the library, which has
/// no member `estimate`.
export template <class E = void>
struct estimate_normals_step : pipeline_step {
  neighborhood_spec spec;
  E estimate;
  normals_options options;

  static constexpr const char* name = "estimate_normals";
  estimate_normals_step(neighborhood_spec near, E covariance, normals_options how)
      : spec(near), estimate(std::move(covariance)), options(std::move(how)) {}
  /// How far around a point it looks.
  [[nodiscard]] step_reach reach() const { return reach_of_neighborhoods(spec); }
  /// Its result has normals.
  static cloud_parts gives() { return {.normals = true}; }
  /// As parts of a larger cloud are processed.
  [[nodiscard]] auto on_tiles() const {
    auto same = *this;
    same.options.ascending = true;
    return same;
  }
  template <PointCloud C, class P = std::remove_cvref_t<C>>
    requires CovarianceEstimator<E, typename P::scalar, P::static_dimension>
  P operator()(C&& cloud) const {
    return estimate_normals(std::forward<C>(cloud), spec, estimate, options);
  }
};
template <>
struct estimate_normals_step<void> : pipeline_step {
  neighborhood_spec spec;
  normals_options options;

  static constexpr const char* name = "estimate_normals";
  explicit estimate_normals_step(neighborhood_spec near, normals_options how = {})
      : spec(near), options(std::move(how)) {}
  /// How far around a point it looks.
  [[nodiscard]] step_reach reach() const { return reach_of_neighborhoods(spec); }
  /// Its result has normals.
  static cloud_parts gives() { return {.normals = true}; }
  /// As parts of a larger cloud are processed.
  [[nodiscard]] auto on_tiles() const {
    auto same = *this;
    same.options.ascending = true;
    return same;
  }
  template <PointCloud C>
  std::remove_cvref_t<C> operator()(C&& cloud) const {
    return estimate_normals(std::forward<C>(cloud), spec, options);
  }
};
export [[nodiscard]] auto estimate_normals(neighborhood_spec spec, normals_options options = {}) {
  return estimate_normals_step<>{spec, std::move(options)};
}
/// The estimator must accept the clouds that the step will receive.
export template <class E>
  requires(!std::convertible_to<E, normals_options>)
[[nodiscard]] auto estimate_normals(neighborhood_spec spec, E estimate,
                                    normals_options options = {}) {
  return estimate_normals_step<E>{spec, std::move(estimate), std::move(options)};
}

/// `orient_consistently` of clouds as a step. Members are its arguments: `spec` and `options`.
export struct orient_consistently_step : pipeline_step {
  neighborhood_spec spec;
  orientation_options options;

  static constexpr const char* name = "orient_consistently";
  explicit orient_consistently_step(neighborhood_spec near, orientation_options how = {})
      : spec(near), options(std::move(how)) {}
  /// How far around a point it looks.
  static step_reach reach() { return {.everything = true}; }
  /// It needs normals.
  static cloud_parts needs() { return {.normals = true}; }
  template <PointCloud C>
  std::remove_cvref_t<C> operator()(C&& cloud) const {
    return orient_consistently(std::forward<C>(cloud), spec, options);
  }
};
export [[nodiscard]] auto orient_consistently(neighborhood_spec spec,
                                              orientation_options options = {}) {
  return orient_consistently_step{spec, std::move(options)};
}

/// `orient_to_viewpoint` of clouds as a step. The member is its argument, `viewpoint`.
export struct orient_to_viewpoint_step : pipeline_step {
  coordinates viewpoint;

  static constexpr const char* name = "orient_to_viewpoint";
  explicit orient_to_viewpoint_step(coordinates place) : viewpoint(std::move(place)) {}
  /// How far around a point it looks.
  static step_reach reach() { return {}; }
  /// It needs normals.
  static cloud_parts needs() { return {.normals = true}; }
  template <PointCloud C>
  std::remove_cvref_t<C> operator()(C&& cloud) const {
    return orient_to_viewpoint(std::forward<C>(cloud), viewpoint);
  }
};
export [[nodiscard]] auto orient_to_viewpoint(coordinates viewpoint) {
  return orient_to_viewpoint_step{std::move(viewpoint)};
}

/// Whether a transform may be one of points of dimension D.
template <AffineMap T, int D>
inline constexpr bool same_dimension = [] {
  constexpr int E =
      std::remove_cvref_t<decltype(std::declval<const T&>().translation())>::SizeAtCompileTime;
  return D == dynamic || E == dynamic || D == E;
}();

/// `transform` of clouds as a step. The member is its argument, the map `by`.
export template <AffineMap T>
struct transform_step : pipeline_step {
  T by;

  static constexpr const char* name = "transform";
  explicit transform_step(const T& map) : by(map) {}
  /// How far around a point it looks.
  static step_reach reach() { return {}; }
  /// Its points are elsewhere.
  static bool moves_points() { return true; }
  template <PointCloud C>
    requires same_dimension<T, std::remove_cvref_t<C>::static_dimension> &&
             requires(std::remove_cvref_t<C> cloud, const T& map) { transform(cloud, map); }
  std::remove_cvref_t<C> operator()(C&& cloud) const {
    return transform(std::forward<C>(cloud), by);
  }
};
export template <AffineMap T>
[[nodiscard]] auto transform(const T& by) {
  return transform_step<T>{by};
}
/// As above, by a matrix of homogeneous coordinates.
export template <class M>
[[nodiscard]] auto transform(const Eigen::MatrixBase<M>& homogeneous) {
  return transform_step<any_transform>{any_transform{homogeneous}};
}

/// `append` of clouds as a step. The member is the `second` cloud.
export template <Scalar S, int D>
struct append_step : pipeline_step {
  point_cloud<S, D> second;

  static constexpr const char* name = "append";
  explicit append_step(point_cloud<S, D> cloud) : second(std::move(cloud)) {}
  /// How far around a point it looks.
  static step_reach reach() { return {.everything = true}; }
  point_cloud<S, D> operator()(point_cloud<S, D> cloud) const {
    return append(std::move(cloud), second);
  }
};
/// The step that appends `second` to the cloud.
export template <Scalar S, int D>
[[nodiscard]] auto append(point_cloud<S, D> second) {
  return append_step<S, D>{std::move(second)};
}

/// `cast` of clouds as a step.
export template <Scalar T>
struct cast_step : pipeline_step {
  static constexpr const char* name = "cast";
  /// How far around a point it looks.
  static step_reach reach() { return {}; }
  template <Scalar S, int D>
  point_cloud<T, D> operator()(const point_cloud<S, D>& cloud) const {
    return cast<T>(cloud);
  }
};
export template <Scalar T>
[[nodiscard]] auto cast() {
  return cast_step<T>{};
}

}  // namespace cilantro
