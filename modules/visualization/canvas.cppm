// SPDX-License-Identifier: MIT
export module cilantro.visualization:canvas;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// `3 × N`: red, green and blue, from 0 to 255.
export using color_matrix = Eigen::Matrix<std::uint8_t, 3, dynamic>;

/// One colour, for batches of one colour.
export [[nodiscard]] inline color_matrix one_color(const rgb& color) {
  color_matrix one(3, 1);
  one << color[0], color[1], color[2];
  return one;
}

/// How large points are drawn: their diameter. None is smaller than a pixel or larger than 1024.
export struct point_size {
  /// What the numbers are.
  enum class unit {
    length,  ///< In the units of the points: what is nearer is larger.
    pixels,  ///< The same at every distance.
  };
  unit in = unit::pixels;                                   ///< Of all sizes.
  Eigen::VectorXf sizes = Eigen::VectorXf::Constant(1, 2);  ///< One for all points, or one each.
};

/// Points to draw, as round splats. In all batches, positions are relative to an `origin`, so that
/// large coordinates keep their digits; what is not finite is left out.
export struct point_batch {
  Eigen::Matrix3Xf points = {};                      ///< `3 × N`.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< Of the points.
  color_matrix colors = one_color({200, 200, 200});  ///< One for all points, or one each.
  Eigen::Matrix3Xf normals = {};  ///< `3 × N`, to light the points by; or no columns.
  point_size size = {};           ///< Of the splats.
  double opacity = 1;             ///< From 0, which shows nothing, to 1.
  bool lit = true;                ///< Whether points with normals are lit from the eye.
  /// Whether a splat is a disc across its normal, which is thin from the side; otherwise it is
  /// round from all sides. Needs normals; a point whose normal is zero or not finite stays round.
  bool along_normals = false;
};

/// Straight lines to draw.
export struct line_batch {
  Eigen::Matrix3Xf points = {};                      ///< `3 × N`.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< Of the points.
  Eigen::Matrix2Xi segments = {};  ///< Which points each line joins; none: the 1st and 2nd, …
  color_matrix colors = one_color({220, 220, 220});  ///< One for all lines, or one each.
  double width = 1.5;                                ///< In pixels.
  double opacity = 1;                                ///< From 0, which shows nothing, to 1.
};

/// Triangles to draw, seen from both sides.
export struct triangle_batch {
  Eigen::Matrix3Xf points = {};                      ///< `3 × N`.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< Of the points.
  Eigen::Matrix3Xi triangles = {};                   ///< The points of each.
  color_matrix colors = one_color({200, 200, 200});  ///< One for all, or one for each point.
  Eigen::Matrix3Xf normals = {};  ///< `3 × N`, to look smooth; or no columns, to look flat.
  double opacity = 1;             ///< From 0, which shows nothing, to 1.
  /// What the triangles are covered with, in place of `colors`; or nothing. Each pixel shows the
  /// one pixel of it that lies there; beyond its borders, those at them.
  std::shared_ptr<const image<rgb>> texture = {};
  /// `2 × N`: where in the texture each point is, in pixels from the top left, integers being their
  /// middles, as cameras count: those of a photo are where its camera sees the points.
  Eigen::Matrix2Xf texture_places = {};
  /// Whether they are lit from the eye and darker behind edges; else they have just their colours.
  bool lit = true;
};

/// A text at a place, drawn over everything else.
export struct label {
  std::string text;                                 ///< In UTF-8; lines end with `\n`.
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< Where its lower left corner is.
  std::optional<rgb> color = {};  ///< Of the letters; none: light or dark, to be read.
  double height = 14;             ///< Of a capital letter, in pixels.
};

/// What the colours of a batch mean: a bar of colours with numbers beside the picture.
export struct color_legend {
  std::string title;         ///< Above the bar.
  std::vector<rgb> colors;   ///< From the lowest value to the highest.
  double low = 0, high = 1;  ///< The values at the ends.
  friend bool operator==(const color_legend& a, const color_legend& b) {
    return a.title == b.title && a.colors == b.colors && a.low == b.low && a.high == b.high;
  }
};

/// What something consists of that is drawn. Passed by reference, and never copied.
export class canvas {
 public:
  canvas() = default;
  canvas(canvas&&) = default;
  canvas& operator=(canvas&&) = default;

  /// Each throws `invalid_input` for colours, normals or sizes that are not as many as their kind
  /// allows, for indices that are not those of points, for sizes, widths and origins that make no
  /// sense, for splats along normals that there are not, for opacities beyond 0 and 1, and for a
  /// texture without pixels, without a finite place for each point, or beside a colour for each. A
  /// label at a place that is not finite is left out.
  void add(point_batch batch);
  void add(line_batch batch);
  void add(triangle_batch batch);
  void add(label batch);
  void add(color_legend legend);

  /// What was added of each kind, in that order.
  [[nodiscard]] const std::vector<point_batch>& points() const { return points_; }
  [[nodiscard]] const std::vector<line_batch>& lines() const { return lines_; }
  [[nodiscard]] const std::vector<triangle_batch>& triangles() const { return triangles_; }
  [[nodiscard]] const std::vector<label>& labels() const { return labels_; }
  [[nodiscard]] const std::vector<color_legend>& legends() const { return legends_; }
  /// The box around all that is finite; empty if there is nothing.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const { return bounds_; }

 private:
  std::vector<point_batch> points_;
  std::vector<line_batch> lines_;
  std::vector<triangle_batch> triangles_;
  std::vector<label> labels_;
  std::vector<color_legend> legends_;
  Eigen::AlignedBox3d bounds_;
};

/// What can be drawn: it says itself what it consists of, by a member `draw(canvas&)`, or a
/// function `draw(thing, canvas&)` in its own namespace.
export template <class R>
concept Renderable = requires(const R& thing, canvas& on) { thing.draw(on); } ||
                     requires(const R& thing, canvas& on) { draw(thing, on); };

/// What can be drawn with a look, a struct of options: by a function `draw(thing, canvas&, look)`.
export template <class R, class Look>
concept RenderableWith =
    requires(const R& thing, canvas& on, const Look& look) { draw(thing, on, look); };

}  // namespace cilantro
