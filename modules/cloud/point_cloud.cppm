// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.cloud:point_cloud;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :attribute;

namespace cilantro {

/// Zeros, or no coordinates at all for a run-time dimension, which mean the same.
template <int D>
point_vector<double, D> no_origin() {
  if constexpr (D == dynamic)
    return {};
  else
    return point_vector<double, D>::Zero();
}

/// Whether T, an integer, holds a value as it is.
template <std::integral T, class V>
[[nodiscard]] bool is_held(V value) {
  if constexpr (std::integral<V>)
    return std::in_range<T>(value);
  else
    return value == std::floor(value) && double(value) >= double(std::numeric_limits<T>::min()) &&
           double(value) < std::ldexp(1.0, std::numeric_limits<T>::digits);
}

/// Points and what is known about each of them. A plain value: copy it, move it, compare it, write
/// to its members. Every function on clouds keeps, drops or transforms each member as its comment
/// says.
export template <Scalar S, int D>
struct point_cloud {
  using scalar = S;
  static constexpr int static_dimension = D;

  sized<point_matrix<S, D>> points = {};  ///< `Dim × N`, relative to `origin`.
  /// `Dim × N`, unit length or zero if unknown; or no columns.
  sized<point_matrix<S, D>> normals = {};
  /// `3 × N` red, green, blue in [0, 1]; or no columns.
  sized<Eigen::Matrix3Xf> colors = {};
  std::vector<attribute> attributes = {};  ///< Any number, with different names.
  std::vector<std::string> comments = {};  ///< About the whole; always kept.
  /// Where in the world (0, 0, …) is, in double: what readers subtract from coordinates, such as
  /// those of maps, that the scalar would round. World coordinates are points + origin.
  sized<point_vector<double, D>> origin = no_origin<D>();
  /// Of an organised cloud, whose points are the pixels of a picture, row by row; otherwise 0. Kept
  /// as long as all points are.
  int width = 0, height = 0;

  [[nodiscard]] index_t size() const { return points.cols(); }
  [[nodiscard]] bool empty() const { return size() == 0; }
  [[nodiscard]] index_t dimension() const { return points.rows(); }
  [[nodiscard]] bool has_normals() const { return normals.cols() > 0; }
  [[nodiscard]] bool has_colors() const { return colors.cols() > 0; }
  [[nodiscard]] bool has_origin() const { return origin.size() > 0 && !origin.isZero(0); }
  [[nodiscard]] bool is_organized() const { return width > 0 && height > 0; }
  /// The origin with all its coordinates, also where it has none.
  [[nodiscard]] point_vector<double, D> full_origin() const {
    if (origin.size() > 0) return origin;
    return point_vector<double, D>::Zero(dimension());
  }
  /// A place in the world as the cloud's points are given.
  [[nodiscard]] coordinates to_local(const coordinates& world) const;

  /// The attribute of that name, or null.
  [[nodiscard]] const attribute* find_attribute(std::string_view name) const {
    for (const auto& a : attributes)
      if (a.name == name) return &a;
    return nullptr;
  }
  /// The values of an attribute that holds T, where they lie. Throws `invalid_input` if there is
  /// none of that name and type. What type a reader gives, depends on the file: see `attribute_to`.
  template <class T>
  [[nodiscard]] std::span<const T> attribute_as(std::string_view name) const {
    const attribute* found = find_attribute(name);
    expects(found != nullptr, "the cloud has no attribute \"" + std::string{name} + '"');
    const auto* values = std::get_if<std::vector<T>>(&found->values);
    expects(values != nullptr, "the attribute \"" + std::string{name} + "\" holds " +
                                   std::string{type_name(found->values)} + ", and " +
                                   std::string{type_name(std::vector<T>{})} + " was asked for");
    return *values;
  }
  /// The values of an attribute of any type, converted to T. Throws `invalid_input` if there is
  /// none of that name, and for an integer T that cannot hold a value.
  template <class T>
    requires std::is_arithmetic_v<T>
  [[nodiscard]] std::vector<T> attribute_to(std::string_view name) const {
    const attribute* found = find_attribute(name);
    expects(found != nullptr, "the cloud has no attribute \"" + std::string{name} + '"');
    std::vector<T> converted;
    std::visit(
        [&](const auto& values) {
          for (const auto value : values) {
            const T next = static_cast<T>(value);
            if constexpr (std::integral<T>)
              expects(is_held<T>(value),
                      "the attribute \"" + std::string{name} + "\" has the value " +
                          in_digits(double(value)) + ", which " +
                          std::string{type_name(std::vector<typename kept_type<T>::type>{})} +
                          " cannot hold");
            converted.push_back(next);
          }
        },
        found->values);
    return converted;
  }
  /// Adds an attribute, or replaces the one of that name. Throws `invalid_input` unless there is
  /// one value per point.
  void set_attribute(std::string_view name, attribute_values values) {
    attribute next{std::string{name}, std::move(values)};
    expects(next.size() == size(),
            "set_attribute: \"" + next.name + "\" must have one value per point");
    for (auto& a : attributes)
      if (a.name == name) {
        a = std::move(next);
        return;
      }
    attributes.push_back(std::move(next));
  }
  /// The same of any numbers: `cloud.set_attribute("cluster", found.labels())`.
  template <AttributeRange R>
  void set_attribute(std::string_view name, R&& values) {
    using T = typename kept_type<std::ranges::range_value_t<R>>::type;
    std::vector<T> kept;
    for (const auto value : values) kept.push_back(static_cast<T>(value));
    set_attribute(name, attribute_values{std::move(kept)});
  }
  template <class T>
    requires std::is_arithmetic_v<T>
  void set_attribute(std::string_view name, std::initializer_list<T> values) {
    set_attribute(name, std::span<const T>{values.begin(), values.size()});
  }
};

/// What is told of a cloud that is printed.
struct cloud_summary {
  index_t size, dimension;
  bool has_normals, has_colors;
  int width, height;
  std::span<const attribute> attributes;
  Eigen::VectorXd origin;  ///< Of no size if there is none.
};
void print(std::ostream& out, const cloud_summary& cloud);

/// A line of what the cloud has.
export template <Scalar S, int D>
std::ostream& operator<<(std::ostream& out, const point_cloud<S, D>& cloud) {
  print(out, {cloud.size(), cloud.dimension(), cloud.has_normals(), cloud.has_colors(), cloud.width,
              cloud.height, cloud.attributes,
              cloud.has_origin() ? Eigen::VectorXd{cloud.origin} : Eigen::VectorXd{}});
  return out;
}

void expect_consistent(index_t points, index_t normals, index_t colors,
                       std::span<const attribute> attributes, const char* who);

/// A cloud is its points, with its normals, colours and origin, wherever points are asked for.
/// Throws `invalid_input` for one that has other numbers of normals or colours than of points.
template <Scalar S, int D>
struct points_traits<point_cloud<S, D>> {
  static auto view(const point_cloud<S, D>& cloud) {
    expect_consistent(cloud.size(), cloud.normals.cols(), cloud.colors.cols(), {}, "cloud");
    return as_points(cloud.points);
  }
  static auto normals(const point_cloud<S, D>& cloud) { return as_points(cloud.normals); }
  static auto colors(const point_cloud<S, D>& cloud) { return as_points(cloud.colors); }
  static auto origin(const point_cloud<S, D>& cloud) { return cloud.full_origin(); }
};

/// A `point_cloud` of any scalar and dimension.
export template <class T>
concept PointCloud = requires(const std::remove_cvref_t<T>& c) {
  []<class S, int D>(const point_cloud<S, D>&) {}(c);
};

/// Whether everything is the same; a cloud with NaN differs from itself.
export template <Scalar S, int D>
bool operator==(const point_cloud<S, D>& a, const point_cloud<S, D>& b) {
  const auto same = [](const auto& m, const auto& n) {
    return m.rows() == n.rows() && m.cols() == n.cols() && (m.array() == n.array()).all();
  };
  return same(a.points, b.points) && same(a.normals, b.normals) && same(a.colors, b.colors) &&
         a.attributes == b.attributes && a.comments == b.comments && a.width == b.width &&
         a.height == b.height && same(a.full_origin(), b.full_origin());
}

template <Scalar S, int D>
coordinates point_cloud<S, D>::to_local(const coordinates& world) const {
  if (!has_origin() || world.size() != dimension()) return world;
  return world.as<double, D>(dimension(), "") - origin;
}

/// Throws `invalid_input`, naming the function `who`, if normals, colours or an attribute do not
/// have one entry per point, if two attributes have one name, if width and height are not those of
/// the points, or if the origin is not finite or of another dimension.
export template <Scalar S, int D>
void expect_consistent(const point_cloud<S, D>& cloud, const char* who) {
  expect_consistent(cloud.size(), cloud.normals.cols(), cloud.colors.cols(), cloud.attributes, who);
  expects(!cloud.has_normals() || cloud.normals.rows() == cloud.dimension(),
          std::string{who} + ": points and normals of the cloud differ in dimension");
  expects((cloud.width == 0 && cloud.height == 0) ||
              index_t{cloud.width} * cloud.height == cloud.size(),
          std::string{who} + ": width and height of the cloud do not fit its points");
  expects(cloud.origin.size() == 0 ||
              (cloud.origin.size() == cloud.dimension() && is_finite(cloud.origin)),
          std::string{who} + ": the origin of the cloud must be finite, of the points' dimension");
}

template <Scalar S, int D>
point_matrix<S, D> gather_columns(points_view<S, D> all, std::span<const std::int32_t> indices);
template <Scalar S, int D>
std::vector<std::int32_t> finite_columns(points_view<S, D> all);

template <Scalar S, int D>
point_cloud<S, D> gather(const point_cloud<S, D>& cloud, std::span<const std::int32_t> indices) {
  constexpr int C = closed_dimension<D>;
  point_cloud<S, D> selected;
  selected.points = gather_columns<S, C>(as_points(cloud.points), indices);
  if (cloud.has_normals())
    selected.normals = gather_columns<S, C>(as_points(cloud.normals), indices);
  if (cloud.has_colors())
    selected.colors = gather_columns<float, 3>(as_points(cloud.colors), indices);
  for (const auto& a : cloud.attributes) selected.attributes.push_back(select(a, indices));
  selected.comments = cloud.comments;
  selected.origin = cloud.origin;
  return selected;
}

/// The cloud moved by `transform`, rigid or affine, of the world: points, and normals by the
/// inverse transpose. A cloud with an origin has that moved in double, and its points stay small.
/// Colours and attributes stay as they are. Throws `invalid_input` for a transform of another
/// dimension, and for one that cannot be inverted if there are normals. A transform of another
/// scalar is converted, but for what it does to the origin.
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
  if (!cloud.has_origin()) {
    transform_points(around_origin, cloud.points, cloud.points);
    return cloud;
  }
  around_origin.translation().setZero();
  transform_points(around_origin, cloud.points, cloud.points);
  cloud.origin = transform.linear().template cast<double>() * cloud.origin +
                 transform.translation().template cast<double>();
  return cloud;
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

/// The options with the viewpoint as the cloud's points are given.
template <Scalar S, int D>
normals_options local_to(const point_cloud<S, D>& cloud, normals_options options) {
  if (options.viewpoint) options.viewpoint = cloud.to_local(*options.viewpoint);
  return options;
}

template <Scalar S, int D>
point_cloud<S, D> with_normals(point_cloud<S, D>&& cloud, normals_result<S, D>&& found) {
  cloud.normals = std::move(found.normals);
  cloud.set_attribute("curvature", std::vector<S>(found.curvature.data(),
                                                  found.curvature.data() + found.curvature.size()));
  return std::move(cloud);
}

/// The cloud with normals, and with the curvatures as its attribute "curvature"; both replace what
/// was there. Everything else is kept. See `estimate_normals` on points.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> estimate_normals(point_cloud<S, D> cloud, neighborhood_spec spec,
                                                 const normals_options& options = {}) {
  expect_consistent(cloud, "estimate_normals");
  return with_normals(std::move(cloud),
                      estimate_normals(cloud.points, spec, local_to(cloud, options)));
}

/// As above, from the covariance that an estimator finds for each neighbourhood.
export template <Scalar S, int D, CovarianceEstimator<S, D> E>
[[nodiscard]] point_cloud<S, D> estimate_normals(point_cloud<S, D> cloud, neighborhood_spec spec,
                                                 const E& estimate,
                                                 const normals_options& options = {}) {
  expect_consistent(cloud, "estimate_normals");
  return with_normals(std::move(cloud),
                      estimate_normals(cloud.points, spec, estimate, local_to(cloud, options)));
}

/// As above, from neighbourhoods that are known.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> estimate_normals(point_cloud<S, D> cloud,
                                                 const neighborhoods<S>& near,
                                                 const normals_options& options = {}) {
  expect_consistent(cloud, "estimate_normals");
  return with_normals(std::move(cloud),
                      estimate_normals(cloud.points, near, local_to(cloud, options)));
}
export template <Scalar S, int D, CovarianceEstimator<S, D> E>
[[nodiscard]] point_cloud<S, D> estimate_normals(point_cloud<S, D> cloud,
                                                 const neighborhoods<S>& near, const E& estimate,
                                                 const normals_options& options = {}) {
  expect_consistent(cloud, "estimate_normals");
  return with_normals(std::move(cloud),
                      estimate_normals(cloud.points, near, estimate, local_to(cloud, options)));
}

/// One point per occupied cell, as `voxel_downsample` on points: the mean of the points, of the
/// normals (turned to one side, at unit length) and of the colours of a cell; attributes as a mean
/// if they are floating, as the lower median if they are integers. Or one of the points of the
/// cell, with all that belongs to it. Cells lie where they do in the world, whatever the cloud's
/// origin. Throws as `voxel_grid` does, and if normals are to be compared and there are none.
/// Memory beside the result: about 24 bytes a point.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> voxel_downsample(const point_cloud<S, D>& cloud,
                                                 const voxel_size& size,
                                                 const voxel_downsample_options& options = {}) {
  expect_consistent(cloud, "voxel_downsample");
  voxel_options cells{options.min_points, options.origin, options.threads, options.monitor};
  if (cloud.has_origin())
    cells.origin = cloud.to_local(cells.origin.value_or(
        coordinates{point_vector<double, D>::Zero(cloud.dimension()).eval()}));
  const voxel_grid<S, D> grid{as_points(cloud.points), size, cells};
  const execution how{.threads = options.threads};
  if (options.pick != voxel_pick::mean)
    return gather(cloud,
                  std::span<const std::int32_t>{representatives(cloud, grid, options.pick, how)});
  point_cloud<S, D> reduced;
  reduced.points = group_means(cloud.points, grid.groups(), how);
  if (cloud.has_normals()) reduced.normals = group_directions(cloud.normals, grid.groups(), how);
  if (cloud.has_colors()) reduced.colors = group_means(cloud.colors, grid.groups(), how);
  for (const auto& a : cloud.attributes) reduced.attributes.push_back(reduce(a, grid.groups()));
  reduced.comments = cloud.comments;
  reduced.origin = cloud.origin;
  return reduced;
}

/// The cloud with each normal turned towards `viewpoint`. Throws `invalid_input` if it has none.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> orient_to_viewpoint(point_cloud<S, D> cloud,
                                                    const coordinates& viewpoint) {
  expect_consistent(cloud, "orient_to_viewpoint");
  expects(cloud.has_normals() || cloud.empty(),
          "orient_to_viewpoint: the cloud has no normals; estimate them first");
  if (cloud.has_normals())
    orient_to_viewpoint(cloud.normals, cloud.points, cloud.to_local(viewpoint));
  return cloud;
}

/// The cloud with its normals turned so that neighbours agree over the whole surface, as
/// `orient_consistently` on points. Throws `invalid_input` if it has none.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> orient_consistently(point_cloud<S, D> cloud, neighborhood_spec spec,
                                                    orientation_options options = {}) {
  expect_consistent(cloud, "orient_consistently");
  expects(cloud.has_normals() || cloud.empty(),
          "orient_consistently: the cloud has no normals; estimate them first");
  if (options.viewpoint) options.viewpoint = cloud.to_local(*options.viewpoint);
  if (cloud.has_normals()) orient_consistently(cloud.normals, cloud.points, spec, options);
  return cloud;
}

// Clouds of closed dimensions are compiled in the library, so that a pipeline costs its author
// little.
#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                         \
  extern template struct point_cloud<S, D>;                                                       \
  extern template bool operator==(const point_cloud<S, D>&, const point_cloud<S, D>&);            \
  extern template void expect_consistent(const point_cloud<S, D>&, const char*);                  \
  extern template point_cloud<S, D> gather(const point_cloud<S, D>&,                              \
                                           std::span<const std::int32_t>);                        \
  extern template point_cloud<S, D> append(point_cloud<S, D>, const point_cloud<S, D>&);          \
  extern template point_cloud<S, D> estimate_normals(point_cloud<S, D>, neighborhood_spec,        \
                                                     const normals_options&);                     \
  extern template point_cloud<S, D> voxel_downsample(const point_cloud<S, D>&, const voxel_size&, \
                                                     const voxel_downsample_options&);            \
  extern template point_cloud<S, D> orient_to_viewpoint(point_cloud<S, D>, const coordinates&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
