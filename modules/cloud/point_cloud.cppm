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

/// The zero origin; for a run-time dimension an empty vector, which means the same.
template <int D>
point_vector<double, D> no_origin() {
  if constexpr (D == dynamic)
    return {};
  else
    return point_vector<double, D>::Zero();
}

/// Whether T, an integer type, can represent a value exactly.
template <std::integral T, class V>
[[nodiscard]] bool is_held(V value) {
  if constexpr (std::integral<V>)
    return std::in_range<T>(value);
  else
    return value == std::floor(value) && double(value) >= double(std::numeric_limits<T>::min()) &&
           double(value) < std::ldexp(1.0, std::numeric_limits<T>::digits);
}

/// Points and what is known about each of them. A plain value: copy it, move it, compare it, write
/// to its members. The comment of each function on clouds says which members it keeps, drops or
/// transforms.
export template <Scalar S, int D>
struct point_cloud {
  using scalar = S;
  static constexpr int static_dimension = D;

  sized<point_matrix<S, D>> points = {};  ///< `Dim × N`, relative to `origin`.
  /// `Dim × N`, of unit length, or zero if unknown; or no columns.
  sized<point_matrix<S, D>> normals = {};
  /// `3 × N`: red, green and blue in [0, 1]; or no columns.
  sized<Eigen::Matrix3Xf> colors = {};
  std::vector<attribute> attributes = {};  ///< Any number of them, with different names.
  std::vector<std::string> comments = {};  ///< Comments about the whole cloud; always kept.
  /// World coordinates are points + origin. Readers set an origin, and subtract it in double, if
  /// the scalar would round the coordinates, such as those of maps. Zero, or of no size, if there
  /// is none.
  sized<point_vector<double, D>> origin = no_origin<D>();
  /// The size of an organised cloud, whose points are the pixels of a picture, row by row;
  /// otherwise 0. Functions keep it as long as they keep all points.
  int width = 0, height = 0;

  [[nodiscard]] index_t size() const { return points.cols(); }
  [[nodiscard]] bool empty() const { return size() == 0; }
  [[nodiscard]] index_t dimension() const { return points.rows(); }
  /// Whether there are normals, colours, and an origin other than zero.
  [[nodiscard]] bool has_normals() const { return normals.cols() > 0; }
  [[nodiscard]] bool has_colors() const { return colors.cols() > 0; }
  [[nodiscard]] bool has_origin() const { return origin.size() > 0 && !origin.isZero(0); }
  /// Whether `width` and `height` are set.
  [[nodiscard]] bool is_organized() const { return width > 0 && height > 0; }
  /// The origin with Dim coordinates, zeros if there is none.
  [[nodiscard]] point_vector<double, D> full_origin() const {
    if (origin.size() > 0) return origin;
    return point_vector<double, D>::Zero(dimension());
  }
  /// Converts a place from world coordinates to those of `points`.
  [[nodiscard]] coordinates to_local(const coordinates& world) const;

  /// The attribute of that name, or null if there is none.
  [[nodiscard]] const attribute* find_attribute(std::string_view name) const
      [[clang::lifetimebound]] {
    for (const auto& a : attributes)
      if (a.name == name) return &a;
    return nullptr;
  }
  /// A view of the values of an attribute that holds T. Throws `invalid_input` if there is none of
  /// that name and type. The type that a reader chooses depends on the file: see `attribute_to`.
  template <class T>
  [[nodiscard]] std::span<const T> attribute_as(std::string_view name) const
      [[clang::lifetimebound]] {
    const attribute* found = find_attribute(name);
    expects(found != nullptr, "the cloud has no attribute \"" + std::string{name} + '"');
    const auto* values = std::get_if<std::vector<T>>(&found->values);
    expects(values != nullptr, "the attribute \"" + std::string{name} + "\" holds " +
                                   std::string{type_name(found->values)} + ", and " +
                                   std::string{type_name(std::vector<T>{})} + " was requested");
    return *values;
  }
  /// The values of an attribute of any type, converted to T. Throws `invalid_input` if there is
  /// none of that name, or if an integer type T cannot hold one of the values.
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
  /// As above, from a range of numbers: `cloud.set_attribute("cluster", found.labels())`.
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

/// What is printed about a cloud.
struct cloud_summary {
  index_t size, dimension;
  bool has_normals, has_colors;
  int width, height;
  std::span<const attribute> attributes;
  Eigen::VectorXd origin;  ///< Of no size if there is no origin.
};
void print(std::ostream& out, const cloud_summary& cloud);

/// Prints one line about what the cloud has.
export template <Scalar S, int D>
std::ostream& operator<<(std::ostream& out, const point_cloud<S, D>& cloud) {
  print(out, {cloud.size(), cloud.dimension(), cloud.has_normals(), cloud.has_colors(), cloud.width,
              cloud.height, cloud.attributes,
              cloud.has_origin() ? Eigen::VectorXd{cloud.origin} : Eigen::VectorXd{}});
  return out;
}

void expect_consistent(index_t points, index_t normals, index_t colors,
                       std::span<const attribute> attributes, const char* who);

/// Lets functions accept a cloud as points, with its normals, colours and origin. Throws
/// `invalid_input` for a cloud whose number of normals or colours is neither 0 nor that of its
/// points.
template <Scalar S, int D>
struct points_traits<point_cloud<S, D>> {
  static points_view<S, D> view(const point_cloud<S, D>& cloud) {
    expect_consistent(cloud.size(), cloud.normals.cols(), cloud.colors.cols(), {}, "cloud");
    return as_points(cloud.points);
  }
  static points_view<S, D> normals(const point_cloud<S, D>& cloud) {
    return as_points(cloud.normals);
  }
  static points_view<float, 3> colors(const point_cloud<S, D>& cloud) {
    return as_points(cloud.colors);
  }
  static auto origin(const point_cloud<S, D>& cloud) { return cloud.full_origin(); }
};

template <class T>
inline constexpr bool is_point_cloud = false;
template <Scalar S, int D>
inline constexpr bool is_point_cloud<point_cloud<S, D>> = true;

/// A `point_cloud` of any scalar and dimension.
export template <class T>
concept PointCloud = is_point_cloud<std::remove_cvref_t<T>>;

/// Whether all members are equal. A cloud with NaN is not equal to itself.
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
/// have one entry per point (normals and colours may be empty), if two attributes have the same
/// name, if width × height is not the number of points, or if the origin is not finite or has
/// another dimension.
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

// Clouds of closed dimensions, and the functions on them, are compiled in the library, so that user
// code compiles fast.
#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                              \
  extern template struct point_cloud<S, D>;                                            \
  extern template bool operator==(const point_cloud<S, D>&, const point_cloud<S, D>&); \
  extern template void expect_consistent(const point_cloud<S, D>&, const char*);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
