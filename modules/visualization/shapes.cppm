// SPDX-License-Identifier: MIT
//
// Lines and triangles that stand for something.
export module cilantro.visualization:shapes;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.cloud;
import :canvas;
import :clouds;

namespace cilantro {

/// Batches are drawn as they are.
export void draw(const point_batch& batch, canvas& on);
export void draw(const line_batch& batch, canvas& on);
export void draw(const triangle_batch& batch, canvas& on);
export void draw(const label& text, canvas& on);

/// Lines whose ends are given one after the other, relative to an origin.
[[nodiscard]] line_batch lines_between(const std::vector<Eigen::Vector3f>& ends,
                                       const Eigen::Vector3d& origin, const rgb& color);

/// Options of `normal_lines`.
export struct normal_lines_options {
  positive length = 1;         ///< Of each line, in the units of the points.
  index_t every = 1;           ///< Only so many points from one with a line to the next.
  rgb color = {90, 200, 255};  ///< Of the lines.
};
/// A line along the normal of each point that has one. Throws `invalid_input` for points without
/// normals, or of other than three dimensions.
export template <PointsSource P>
[[nodiscard]] line_batch normal_lines(const P& points, const normal_lines_options& options) {
  static_assert(dimension_of<P> == 3 || dimension_of<P> == dynamic,
                "normal_lines: points must have three dimensions");
  expects(options.every >= 1, "normal_lines: .every must be at least 1");
  const auto view = points_in(points);
  const auto normals = normals_in(points);
  expects(normals.size() == view.size() && (view.empty() || view.dimension() == 3),
          "normal_lines: points must have three dimensions and normals; estimate them first");
  const Eigen::Vector3d middle = middle_of(view);
  std::vector<Eigen::Vector3f> ends;
  for (index_t i = 0; i < view.size(); i += options.every) {
    if (!is_finite(view[i]) || !is_finite(normals[i]) || normals[i].isZero(0)) continue;
    const Eigen::Vector3d from = view[i].template cast<double>() - middle;
    const Eigen::Vector3d to =
        from + double(options.length) * normals[i].template cast<double>().stableNormalized();
    ends.push_back(from.cast<float>());
    ends.push_back(to.cast<float>());
  }
  return lines_between(ends, middle + origin_in_space(points), options.color);
}

/// Pairs of indices, of a source point and a target point: `correspondences`, or pairs of numbers.
export template <class R>
concept IndexPairs =
    std::ranges::input_range<R> &&
    (requires(const std::ranges::range_value_t<R>& pair) {
      requires std::integral<std::remove_cvref_t<decltype(pair.source)>>;
      requires std::integral<std::remove_cvref_t<decltype(pair.target)>>;
    } || requires(const std::ranges::range_value_t<R>& pair) {
      requires std::integral<std::remove_cvref_t<decltype(pair.first)>>;
      requires std::integral<std::remove_cvref_t<decltype(pair.second)>>;
    });

/// A line from each source point to its target point. Throws `invalid_input` for an index that is
/// not one of a point, and for more than three dimensions.
export template <PointsSource P, PointsSource T, IndexPairs R>
[[nodiscard]] line_batch pair_lines(const P& source, const T& target, const R& pairs,
                                    const rgb& color = {255, 220, 90}) {
  const auto from = points_in(source);
  const auto to = points_in(target);
  expects(from.dimension() <= 3 && to.dimension() <= 3,
          "pair_lines: points must have at most three dimensions");
  expect_same_origin(source, target, "pair_lines");
  const Eigen::Vector3d middle = middle_of(from);
  std::vector<Eigen::Vector3f> ends;
  const auto add = [&](const auto& view, index_t i) {
    expects(0 <= i && i < view.size(), "pair_lines: an index is not one of a point");
    Eigen::Vector3d p = -middle;
    for (index_t d = 0; d < view.dimension(); ++d) p[d] += double(view[i][d]);
    ends.push_back(p.cast<float>());
  };
  for (const auto& pair : pairs) {
    if constexpr (requires { pair.source; }) {
      add(from, pair.source);
      add(to, pair.target);
    } else {
      add(from, pair.first);
      add(to, pair.second);
    }
  }
  return lines_between(ends, middle + origin_in_space(source), color);
}

/// The axes of a pose: x red, y green, z blue, each `length` long.
export [[nodiscard]] line_batch frame_lines(const Eigen::Isometry3d& pose, positive length = 1);

/// What a camera sees, as a pyramid whose base is `depth` ahead.
export [[nodiscard]] line_batch frustum_lines(const pinhole_camera<double>& camera,
                                              positive depth = 1,
                                              const rgb& color = {255, 160, 60});

/// The twelve edges of a box. Throws `invalid_input` for a box that is empty or not finite.
export [[nodiscard]] line_batch box_lines(const Eigen::AlignedBox3d& edges,
                                          const rgb& color = {220, 220, 220});
/// As above. Not for what is written in braces, which is that above.
export template <std::same_as<box> B>
[[nodiscard]] line_batch box_lines(const B& edges, const rgb& color = {220, 220, 220}) {
  edges.check(3);
  return box_lines(
      Eigen::AlignedBox3d{Eigen::Vector3d{edges.lower[0], edges.lower[1], edges.lower[2]},
                          Eigen::Vector3d{edges.upper[0], edges.upper[1], edges.upper[2]}},
      color);
}

/// Options of `grid_lines`.
export struct grid_lines_options {
  double height = 0;          ///< The z of the grid.
  positive step = 1;          ///< From one line to the next.
  int cells = 10;             ///< Along each side, from 1 to 1000.
  rgb color = {90, 90, 100};  ///< Of the lines.
};
/// A grid of squares of constant z, around z axis. Throws `invalid_input` for options that make no
/// sense.
export [[nodiscard]] line_batch grid_lines(const grid_lines_options& options = {});

/// The triangles of a mesh with the given points, `3 × M` indices of these: those of hulls,
/// triangulations and outlines, too. With the colours and normals of the points, if they have any;
/// without normals it looks flat. Its members may be changed before it is drawn.
export template <PointsSource P>
[[nodiscard]] triangle_batch triangle_mesh(const P& points,
                                           const Eigen::Ref<const Eigen::MatrixXi>& triangles,
                                           const rgb& color = {200, 200, 200}) {
  expects(triangles.rows() == 3 || triangles.size() == 0,
          "triangle_mesh: triangles are columns of three indices");
  // A mesh has the points, colours and normals that a cloud has.
  canvas on;
  draw(points, on, {.color = own_colors{color}, .size = splat_pixels{}});
  const point_batch& drawn = on.points()[0];
  return {.points = drawn.points,
          .origin = drawn.origin,
          .triangles = triangles.size() == 0 ? Eigen::Matrix3Xi(3, 0) : Eigen::Matrix3Xi{triangles},
          .colors = drawn.colors,
          .normals = drawn.normals};
}

/// A set in space whose boundary is triangles of its vertices.
///
/// Semantics: `vertices()` are points of three dimensions at compile time; `simplices()` are `3 ×
/// M` indices of them, of type `int`, turned to either side. What is not bounded, or whose
/// `affine_dimension()` is not 3, has no such boundary: `triangle_mesh` and `draw` throw
/// `invalid_input`. Models: `convex_polytope<S, 3>`, or one of yours:
/// `static_assert(TriangulatedHull<my_hull>)` names what is missing.
export template <class H>
concept TriangulatedHull = requires(const H& hull) {
  { hull.is_bounded() } -> std::convertible_to<bool>;
  { hull.affine_dimension() } -> std::convertible_to<index_t>;
  { hull.vertices() } -> PointsSource;
  { hull.simplices() } -> std::convertible_to<Eigen::Ref<const Eigen::MatrixXi>>;
  requires dimension_of<decltype(hull.vertices())> == 3;
};

/// The boundary of a hull. Throws `invalid_input` for one that is empty, flat or unbounded.
export template <TriangulatedHull H>
[[nodiscard]] triangle_batch triangle_mesh(const H& hull, const rgb& color = {200, 200, 200}) {
  expects(
      hull.is_bounded() && hull.affine_dimension() == 3,
      "triangle_mesh: a polytope that is empty, flat or unbounded has no boundary of triangles");
  return triangle_mesh(hull.vertices(), hull.simplices(), color);
}
/// As that mesh, a hull is drawn; one that is a set of points, too, as points.
export template <TriangulatedHull H>
  requires(!PointsSource<H>)
void draw(const H& hull, canvas& on) {
  on.add(triangle_mesh(hull));
}

/// The edges of the triangles of a mesh, each once.
export [[nodiscard]] line_batch wireframe(const triangle_batch& mesh,
                                          const rgb& color = {80, 140, 210});

}  // namespace cilantro
