// SPDX-License-Identifier: MIT
//
// Moving, joining and converting clouds.
module;
#include "core/closed_spaces.hpp"
export module cilantro.cloud:combine;

import cilantro.standard;
import cilantro.core;
import :attribute;
import :point_cloud;

namespace cilantro {

/// The cloud moved by `transform`, a rigid or affine map of world coordinates. Normals are turned
/// by its inverse transpose; colours and attributes stay as they are. If the cloud has an origin,
/// the origin is moved in double, and the points stay small. A transform of another scalar is
/// converted to that of the cloud, except where it acts on the origin; a translation by 10,000
/// units or more that the scalar of the cloud would round becomes the cloud's origin. Throws
/// `invalid_input` for a transform of another dimension, and for one that cannot be inverted if
/// there are normals.
export template <Scalar S, int D, AffineMap T>
  requires std::same_as<typename T::Scalar, S> || requires(const T& t) { t.template cast<S>(); }
[[nodiscard]] point_cloud<S, D> transform(point_cloud<S, D> cloud, const T& transform) {
  expect_consistent(cloud, "transform");
  expects(is_finite(transform.linear().reshaped()) && is_finite(transform.translation()),
          "transform: the transform must be finite");
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

/// As above, by a matrix of homogeneous coordinates, such as pose files contain. Throws
/// `invalid_input` unless its last row is (0, …, 0, 1).
export template <Scalar S, int D, class M>
[[nodiscard]] point_cloud<S, D> transform(point_cloud<S, D> cloud,
                                          const Eigen::MatrixBase<M>& homogeneous) {
  const index_t dimension = cloud.dimension();
  return transform(std::move(cloud),
                   any_transform{homogeneous}.template as<affine_transform<double, D>>(
                       dimension, "transform: matrix and cloud must have the same dimension"));
}

/// Throws `invalid_input` unless two clouds have the same kinds of data about their points.
template <Scalar S, int D>
void expect_appendable(const point_cloud<S, D>& first, const point_cloud<S, D>& second) {
  expects(first.dimension() == second.dimension(), "append: the clouds differ in dimension");
  expects(first.has_normals() == second.has_normals(),
          "append: only one of the clouds has normals");
  expects(first.has_colors() == second.has_colors(), "append: only one of the clouds has colors");
  for (const auto& [one, other] : {std::pair{&first, &second}, std::pair{&second, &first}})
    for (const auto& a : one->attributes)
      expects(other->find_attribute(a.name) != nullptr,
              "append: only one of the clouds has the attribute \"" + a.name + '"');
}

/// The points of all parts, one after the other.
template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> append_parts(std::span<const point_cloud<S, D>* const> parts) {
  std::vector<const point_cloud<S, D>*> filled;
  std::vector<std::string> comments;
  index_t count = 0;
  for (const auto* part : parts) {
    expect_consistent(*part, "append");
    comments.insert(comments.end(), part->comments.begin(), part->comments.end());
    if (part->empty()) continue;
    if (!filled.empty()) expect_appendable(*filled.front(), *part);
    filled.push_back(part);
    count += part->size();
  }
  point_cloud<S, D> all;
  if (filled.size() < 2) {
    if (!parts.empty()) all = filled.empty() ? *parts.front() : *filled.front();
    all.comments = std::move(comments);
    return all;
  }
  const auto& first = *filled.front();
  all.points.resize(first.dimension(), count);
  if (first.has_normals()) all.normals.resize(first.dimension(), count);
  if (first.has_colors()) all.colors.resize(3, count);
  all.comments = std::move(comments);
  all.origin = first.origin;
  for (const auto& a : first.attributes) {
    attribute values = a;
    for (const auto* part : std::span{filled}.subspan(1))
      values = concatenate(std::move(values), *part->find_attribute(a.name));
    all.attributes.push_back(std::move(values));
  }
  index_t begin = 0;
  for (const auto* part : filled) {
    const index_t n = part->size();
    const point_vector<double, D> shift = part->full_origin() - first.full_origin();
    if (shift.isZero(0))
      all.points.middleCols(begin, n) = part->points;
    else
      all.points.middleCols(begin, n) =
          (part->points.template cast<double>().colwise() + shift).template cast<S>();
    if (first.has_normals()) all.normals.middleCols(begin, n) = part->normals;
    if (first.has_colors()) all.colors.middleCols(begin, n) = part->colors;
    begin += n;
  }
  return all;
}

/// The points of `first`, then those of `second`. Both must have the same kinds of data: throws
/// `invalid_input`, naming the normals, colours or attribute that only one of them has, or that
/// differ in type. An empty cloud can be appended to any other. Keeps the comments of both, and the
/// origin of the first cloud that is not empty.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> append(const point_cloud<S, D>& first,
                                       const point_cloud<S, D>& second) {
  return append_parts<S, D>(std::array{&first, &second});
}

/// The points of any number of clouds, joined as by `append`, in time that is linear in the number
/// of points. For no clouds, an empty cloud.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> append_all(const std::vector<point_cloud<S, D>>& clouds) {
  std::vector<const point_cloud<S, D>*> parts;
  for (const auto& cloud : clouds) parts.push_back(&cloud);
  return append_parts<S, D>(parts);
}

/// The cloud with points and normals converted to another scalar. Colours and attributes keep their
/// types.
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
  extern template point_cloud<S, D> append_parts(std::span<const point_cloud<S, D>* const>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
