// SPDX-License-Identifier: MIT
//
// Each function on clouds once more, with the cloud left out, as a step of a pipeline.
export module cilantro.cloud:steps;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :combine;
import :estimate;
import :filters;
import :pipeline;
import :point_cloud;

namespace cilantro {

export [[nodiscard]] inline auto remove_invalid() {
  return step{[]<PointCloud C>(C&& cloud) { return remove_invalid(std::forward<C>(cloud)); }};
}

export [[nodiscard]] inline auto voxel_downsample(voxel_size size,
                                                  voxel_downsample_options options = {}) {
  return step{[size = std::move(size), options = std::move(options)]<PointCloud C>(C&& cloud) {
    return voxel_downsample(cloud, size, options);
  }};
}

export [[nodiscard]] inline auto estimate_normals(neighborhood_spec spec,
                                                  normals_options options = {}) {
  return step{[spec, options = std::move(options)]<PointCloud C>(C&& cloud) {
    return estimate_normals(std::forward<C>(cloud), spec, options);
  }};
}

/// The estimator is any that is one for the clouds that come.
export template <class E>
  requires(!std::convertible_to<E, normals_options>)
[[nodiscard]] auto estimate_normals(neighborhood_spec spec, E estimate,
                                    normals_options options = {}) {
  return step{[spec, estimate = std::move(estimate),
               options = std::move(options)]<PointCloud C>(C&& cloud) {
    return estimate_normals(std::forward<C>(cloud), spec, estimate, options);
  }};
}

export [[nodiscard]] inline auto orient_consistently(neighborhood_spec spec,
                                                     orientation_options options = {}) {
  return step{[spec, options = std::move(options)]<PointCloud C>(C&& cloud) {
    return orient_consistently(std::forward<C>(cloud), spec, options);
  }};
}

export [[nodiscard]] inline auto orient_to_viewpoint(coordinates viewpoint) {
  return step{[viewpoint = std::move(viewpoint)]<PointCloud C>(C&& cloud) {
    return orient_to_viewpoint(std::forward<C>(cloud), viewpoint);
  }};
}

export template <AffineMap T>
[[nodiscard]] auto transform(const T& by) {
  return step{[by]<PointCloud C>(C&& cloud) { return transform(std::forward<C>(cloud), by); }};
}

export template <class M>
  requires(M::RowsAtCompileTime == M::ColsAtCompileTime && M::RowsAtCompileTime >= 2)
[[nodiscard]] auto transform(const Eigen::MatrixBase<M>& homogeneous) {
  return transform(transform_of(homogeneous));
}

/// Keeps the chosen points: by indices, a mask or a predicate.
export template <class Which>
  requires PointChoice<const Which&>
[[nodiscard]] auto select(Which which) {
  return step{[which = std::move(which)]<PointCloud C>(C&& cloud) { return select(cloud, which); }};
}
/// Keeps all others.
export template <class Which>
  requires PointChoice<const Which&>
[[nodiscard]] auto exclude(Which which) {
  return step{
      [which = std::move(which)]<PointCloud C>(C&& cloud) { return exclude(cloud, which); }};
}

/// Appends `second` to the cloud.
export template <Scalar S, int D>
[[nodiscard]] auto append(point_cloud<S, D> second) {
  return step{[second = std::move(second)](point_cloud<S, D> cloud) {
    return append(std::move(cloud), second);
  }};
}

export template <Scalar T>
[[nodiscard]] auto cast() {
  return step{[]<PointCloud C>(C&& cloud) { return cast<T>(cloud); }};
}

export [[nodiscard]] inline auto remove_statistical_outliers(
    statistical_outlier_options options = {}, removed_indices removed = nullptr) {
  return step{[options = std::move(options), removed]<PointCloud C>(C&& cloud) {
    return remove_statistical_outliers(cloud, options, removed);
  }};
}

export [[nodiscard]] inline auto remove_radius_outliers(radius_outlier_options options,
                                                        removed_indices removed = nullptr) {
  return step{[options = std::move(options), removed]<PointCloud C>(C&& cloud) {
    return remove_radius_outliers(cloud, options, removed);
  }};
}

export [[nodiscard]] inline auto random_sample(index_t count, std::uint64_t seed = 0,
                                               removed_indices removed = nullptr) {
  return step{[count, seed, removed]<PointCloud C>(C&& cloud) {
    return random_sample(cloud, count, seed, removed);
  }};
}

export [[nodiscard]] inline auto uniform_sample(index_t count, removed_indices removed = nullptr) {
  return step{
      [count, removed]<PointCloud C>(C&& cloud) { return uniform_sample(cloud, count, removed); }};
}

export [[nodiscard]] inline auto farthest_point_sample(index_t count,
                                                       farthest_point_options options = {},
                                                       removed_indices removed = nullptr) {
  return step{[count, options = std::move(options), removed]<PointCloud C>(C&& cloud) {
    return farthest_point_sample(cloud, count, options, removed);
  }};
}

}  // namespace cilantro
