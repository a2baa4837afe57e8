// SPDX-License-Identifier: MIT
//
// Clouds moved, put together and converted.
module;
#include "core/closed_spaces.hpp"
export module cilantro.cloud:combine;

import cilantro.standard;
import cilantro.core;
import :attribute;
import :point_cloud;

namespace cilantro {

/// The cloud moved by `transform`, rigid or affine, of the world: points, and normals by the
/// inverse transpose. A cloud with an origin has that moved in double, and its points stay small.
/// Colours and attributes stay as they are. Throws `invalid_input` for a transform of another
/// dimension, and for one that cannot be inverted if there are normals. A transform of another
/// scalar is converted, but for what it does to the origin; and a translation to 10,000 units or
/// more that the scalar of the cloud would round becomes the origin, as readers choose one.
export template <Scalar S, int D, AffineMap T>
  requires std::same_as<typename T::Scalar, S> || requires(const T& t) { t.template cast<S>(); }
[[nodiscard]] point_cloud<S, D> transform(point_cloud<S, D> cloud, const T& transform) {
  expect_consistent(cloud, "transform");
  auto around_origin = [&] {
    if constexpr (std::same_as<typename T::Scalar, S>)
      return transform;
    else
      return transform.template cast<S>();
  }();
  if (cloud.has_normals()) transform_normals(around_origin, cloud.normals, cloud.normals);
  const bool is_far = (transform.translation().array().abs() >= 10'000).any() &&
                      around_origin.translation().template cast<double>() !=
                          transform.translation().template cast<double>();
  if (!cloud.has_origin() && !is_far) {
    transform_points(around_origin, cloud.points, cloud.points);
    return cloud;
  }
  around_origin.translation().setZero();
  transform_points(around_origin, cloud.points, cloud.points);
  cloud.origin = transform.linear().template cast<double>() * cloud.full_origin() +
                 transform.translation().template cast<double>();
  return cloud;
}

/// The affine transform that a matrix of homogeneous coordinates is. Throws `invalid_input` unless
/// its last row is (0, …, 0, 1).
template <class M>
[[nodiscard]] auto transform_of(const Eigen::MatrixBase<M>& homogeneous) {
  constexpr int D = M::RowsAtCompileTime - 1;
  using vector = Eigen::Matrix<typename M::Scalar, 1, D + 1>;
  expects(homogeneous.row(D) == vector::Unit(D),
          "transform: the last row of a matrix of homogeneous coordinates must be 0, …, 0, 1");
  affine_transform<typename M::Scalar, D> transform;
  transform.matrix() = homogeneous;
  return transform;
}

/// As above, by a matrix of homogeneous coordinates, as files of poses have them.
export template <Scalar S, int D, class M>
  requires(D != dynamic && M::RowsAtCompileTime == D + 1 && M::ColsAtCompileTime == D + 1)
[[nodiscard]] point_cloud<S, D> transform(point_cloud<S, D> cloud,
                                          const Eigen::MatrixBase<M>& homogeneous) {
  return transform(std::move(cloud), transform_of(homogeneous));
}

/// The points of `first`, then those of `second`. Both must know the same about their points:
/// throws `invalid_input` naming normals, colours or the attribute that only one of them has. An
/// empty cloud goes with every other. Comments of both are kept, and the origin of the first one.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> append(point_cloud<S, D> first, const point_cloud<S, D>& second) {
  expect_consistent(first, "append");
  expect_consistent(second, "append");
  const auto comments = [&] {
    auto all = std::move(first.comments);
    all.insert(all.end(), second.comments.begin(), second.comments.end());
    return all;
  };
  if (first.empty() || second.empty()) {
    auto all = comments();
    if (first.empty() && !second.empty()) first = second;
    first.comments = std::move(all);
    return first;
  }
  expects(first.dimension() == second.dimension(), "append: the clouds differ in dimension");
  expects(first.has_normals() == second.has_normals(),
          "append: only one of the clouds has normals");
  expects(first.has_colors() == second.has_colors(), "append: only one of the clouds has colors");
  for (const auto& a : second.attributes)
    expects(first.find_attribute(a.name) != nullptr,
            "append: only one of the clouds has the attribute \"" + a.name + '"');
  std::vector<attribute> attributes;
  for (const auto& a : first.attributes) {
    const attribute* other = second.find_attribute(a.name);
    expects(other != nullptr, "append: only one of the clouds has the attribute \"" + a.name + '"');
    attributes.push_back(concatenate(a, *other));
  }
  const auto extend = [](auto& columns, const auto& more) {
    const auto before = columns.cols();
    columns.conservativeResize(more.rows(), before + more.cols());
    columns.rightCols(more.cols()) = more;
  };
  const point_vector<double, D> shift = second.full_origin() - first.full_origin();
  if (shift.isZero(0))
    extend(first.points, second.points);
  else
    extend(first.points,
           ((second.points.template cast<double>().colwise() + shift).template cast<S>()).eval());
  first.width = first.height = 0;
  if (first.has_normals()) extend(first.normals, second.normals);
  if (first.has_colors()) extend(first.colors, second.colors);
  first.attributes = std::move(attributes);
  first.comments = comments();
  return first;
}

/// The cloud with points and normals in another scalar. Colours and attributes keep their types.
export template <Scalar T, Scalar S, int D>
[[nodiscard]] point_cloud<T, D> cast(const point_cloud<S, D>& cloud) {
  expect_consistent(cloud, "cast");
  return {cloud.points.template cast<T>(),
          cloud.normals.template cast<T>(),
          cloud.colors,
          cloud.attributes,
          cloud.comments,
          cloud.origin,
          cloud.width,
          cloud.height};
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D) \
  extern template point_cloud<S, D> append(point_cloud<S, D>, const point_cloud<S, D>&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
