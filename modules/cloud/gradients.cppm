// SPDX-License-Identifier: MIT
//
// The values that clouds have at their points, as numbers, and how they change along the surface.
export module cilantro.cloud:gradients;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :attribute;
import :point_cloud;

namespace cilantro {

/// The brightness of each colour: the mean of red, green and blue, in [0, 1].
export [[nodiscard]] std::vector<float> intensities(points_view<float, 3> colors);

/// As above, of the colours of a cloud. Throws `invalid_input` if it has none.
export template <Scalar S, int D>
[[nodiscard]] std::vector<float> intensities(const point_cloud<S, D>& cloud) {
  expect_consistent(cloud, "intensities");
  expects(cloud.has_colors() || cloud.empty(), "intensities: the cloud has no colors");
  return intensities(points_view<float, 3>{as_points(cloud.colors)});
}

/// The values of an attribute of any type as numbers to compute with.
export [[nodiscard]] rounded_values rounded_values_of(const attribute& all);

/// How the brightness of a cloud's colours changes along its surface: the gradient in the tangent
/// plane of each point, `Dim × N`, per unit of length; NaN where nothing is known. Throws
/// `invalid_input` if the cloud has no colours or no normals. See `value_gradients` for points.
export template <Scalar S, int D>
[[nodiscard]] point_matrix<S, D> color_gradients(const point_cloud<S, D>& cloud,
                                                 neighborhood_spec spec,
                                                 const execution& how = {}) {
  expect_consistent(cloud, "color_gradients");
  expects(cloud.has_colors() || cloud.empty(), "color_gradients: the cloud has no colors");
  return value_gradients(cloud, intensities(cloud), spec, how);
}

/// As above, of an attribute of any type: an intensity, a temperature. Throws `invalid_input` if
/// the cloud has none of that name.
export template <Scalar S, int D>
[[nodiscard]] point_matrix<S, D> attribute_gradients(const point_cloud<S, D>& cloud,
                                                     std::string_view name, neighborhood_spec spec,
                                                     const execution& how = {}) {
  expect_consistent(cloud, "attribute_gradients");
  const attribute* found = cloud.find_attribute(name);
  expects(found != nullptr,
          "attribute_gradients: the cloud has no attribute \"" + std::string{name} + '"');
  return std::visit([&](const auto& values) { return value_gradients(cloud, values, spec, how); },
                    found->values);
}

}  // namespace cilantro
