// SPDX-License-Identifier: MIT
//
// How clouds, and points of any kind, look.
export module cilantro.visualization:clouds;

import cilantro.standard;
import cilantro.cloud;
import :canvas;
import :color_map;

namespace cilantro {

/// Colours points by an attribute of the cloud, of any type; with a legend.
export struct by_attribute {
  std::string name;    ///< Of the attribute.
  color_map map = {};  ///< From the lowest value to the highest.
  std::optional<double> low = {},
                        high = {};  ///< The values at the ends of the map; else those there are.
};
/// Colours points by an attribute of whole numbers, such as clusters: a colour for each value.
export struct by_label {
  std::string name;  ///< Of the attribute.
};
/// Colours points by a coordinate; with a legend.
export struct by_coordinate {
  index_t axis = 2;    ///< 0, 1 or 2.
  color_map map = {};  ///< From the lowest value to the highest.
  std::optional<double> low = {},
                        high = {};  ///< The values at the ends of the map; else those there are.
};
/// Colours points by where their normals point: x, y and z as red, green and blue.
export struct by_normal {};
/// Shows the colours of the cloud; if it has none, `otherwise`.
export struct own_colors {
  rgb otherwise = {200, 200, 200};  ///< One colour for all points.
};
/// What the colours of points are.
export using point_coloring =
    std::variant<own_colors, rgb, by_attribute, by_label, by_coordinate, by_normal>;

/// Splats as large as the points are apart where they lie, so that a surface has no holes: `factor`
/// times the distance to the eighth nearest point, from the point or, at borders, from those around
/// it, and at most three times as much as for half of all. Closes a grid of squares, also where
/// scans lie on each other, and what lies at random but for a hundredth. Takes two searches for all
/// points. A point that is alone, and points that are all at one place, are dots of five pixels.
export struct local_spacing {
  positive factor = 1.5;  ///< Smaller ones show more detail, and more holes.
};
/// `local_spacing` of points in space, and `splat_pixels` of those in a plane or on a line, which
/// are seldom surfaces.
export struct automatic_size {};
/// Splats of one diameter, in the units of the points.
export struct splat_length {
  positive diameter;  ///< Of each.
};
/// Splats of one diameter in pixels, at every distance.
export struct splat_pixels {
  positive diameter = 3;  ///< Of each.
};
/// How large splats are.
export using splat_size = std::variant<automatic_size, local_spacing, splat_length, splat_pixels>;

/// How a cloud, or points of any kind, are drawn: `scene{}.set("scan", cloud, cloud_look{…})`.
export struct cloud_look {
  point_coloring color = own_colors{};  ///< Of the points.
  splat_size size = automatic_size{};   ///< Of the splats.
  /// Whether points with normals are lit from the eye. By default not those with colours of their
  /// own, which hold the light that was there.
  std::optional<bool> lit = {};
  /// Whether splats of points with normals are discs across these, which make smoother surfaces and
  /// sharper borders; without normals, and otherwise, they are round from all sides.
  bool along_normals = true;
  double opacity = 1;  ///< Of each splat, and several lie on each other: from 0 to 1.
  int threads = 0;     ///< For `local_spacing`.
};

/// What there is to draw of points of any kind.
struct points_to_draw {
  Eigen::Matrix3Xf points;
  Eigen::Vector3d origin;
  Eigen::Matrix3Xf normals;
  points_view<float, 3> colors;
  std::span<const attribute> attributes;
  index_t dimension;
};
void draw_points(points_to_draw all, canvas& on, const cloud_look& look);

/// Coordinates of up to three dimensions, relative to a place between them. What is missing is 0.
template <Scalar S, int D>
[[nodiscard]] Eigen::Vector3d middle_of(points_view<S, D> points) {
  Eigen::AlignedBox3d box;
  for (const auto& p : points) {
    if (!is_finite(p)) continue;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (index_t d = 0; d < points.dimension(); ++d) place[d] = double(p[d]);
    box.extend(place);
  }
  if (box.isEmpty()) return Eigen::Vector3d::Zero();
  return box.min() / 2 + box.max() / 2;
}
template <Scalar S, int D>
[[nodiscard]] Eigen::Matrix3Xf in_three_dimensions(points_view<S, D> points,
                                                   const Eigen::Vector3d& middle) {
  Eigen::Matrix3Xf result = Eigen::Matrix3Xf::Zero(3, points.size());
  for (index_t i = 0; i < points.size(); ++i)
    for (index_t d = 0; d < points.dimension(); ++d)
      result(d, i) = float(double(points[i][d]) - middle[d]);
  return result;
}

/// The origin of points of up to three dimensions.
template <PointsSource P>
[[nodiscard]] Eigen::Vector3d origin_in_space(const P& points) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  if (const Eigen::VectorXd own = origin_in(points); own.size() > 0) origin.head(own.size()) = own;
  return origin;
}

/// Draws a cloud, or points of any kind, of one, two or three dimensions, with their colours,
/// normals and origin. Throws `invalid_input` for more dimensions, and for attributes, normals or
/// axes that `look` needs and there are not.
export template <PointsSource P>
void draw(const P& points, canvas& on, const cloud_look& look = {}) {
  constexpr int D = dimension_of<P>;
  static_assert(D <= 3,
                "what is drawn has at most three dimensions: choose three, or find them by "
                "principal components or multidimensional scaling");
  const auto view = points_in(points);
  expects(view.dimension() <= 3,
          "draw: points have at most three dimensions: choose three, or find them by "
          "principal_components or multidimensional_scaling");
  // Floats are as exact as they are where they are.
  const Eigen::Vector3d middle = std::same_as<scalar_of<P>, float>
                                     ? Eigen::Vector3d{Eigen::Vector3d::Zero()}
                                     : middle_of(view);
  points_to_draw all{in_three_dimensions(view, middle), middle, {}, {}, {}, view.dimension()};
  if constexpr (PointCloud<P>) {
    expect_consistent(points, "draw");
    all.attributes = points.attributes;
    all.colors = as_points(points.colors);
    if (points.has_normals())
      all.normals = in_three_dimensions(as_points(points.normals), Eigen::Vector3d::Zero());
    all.origin += origin_in_space(points);
  }
  draw_points(std::move(all), on, look);
}

}  // namespace cilantro
