// SPDX-License-Identifier: MIT
export module cilantro.visualization:render;

import cilantro.standard;
import cilantro.core;
import :canvas;
import :scene;
import :view;

namespace cilantro {

/// Options of `render` and `write_picture`.
export struct render_options {
  int width = 0, height = 0;      ///< In pixels; 0: those of the camera. No view is stretched.
  rgb background = {24, 26, 32};  ///< Where nothing is.
  /// Whether splats that lie on each other are mixed; otherwise the nearest is seen alone, which is
  /// faster and coarser. More than 16 million points are never mixed.
  bool blend = true;
  /// How dark what lies behind an edge becomes, in multiples of what is usual; 0: not at all. Shows
  /// shape where there are no normals.
  /// Source: Boucheny 2009, "Interactive scientific visualization of large datasets: towards a
  /// perceptive-based approach" (eye-dome lighting).
  double edges = 1;
  /// Each pixel is the mean of so many along each axis: lines and borders become smooth. 1 to 8.
  int supersampling = 1;
  /// For views that move: about so many points are drawn, at most, and those are the same at each
  /// call; splats sized in length grow, so that surfaces stay closed. 0: all points.
  index_t point_budget = 0;
  bool labels = true;   ///< Whether texts are drawn.
  bool legends = true;  ///< Whether bars of colours are drawn.
  int threads = 0;
  task_monitor monitor = {};
};

/// Draws a scene, without a display, a graphics card or a driver: points as round splats, lines,
/// triangles, what is transparent (in any order, it looks the same), and over them texts and bars
/// of colours. The same bits for any number of threads and any vector target. What is nearer than a
/// thousandth of the distance of a perspective view is not seen. Throws `invalid_input` for options
/// that make no sense, for pictures with sides of more than 32768 or more than 2²⁶ pixels, each of
/// which supersampling makes several, and for more than 2³² − 2 things to draw; `cancelled`. Time
/// grows with the things and the pixels that each covers; memory is 15 to 143 bytes for each pixel.
/// Source of the transparency: McGuire & Bavoil 2013, "Weighted blended order-independent
/// transparency".
export [[nodiscard]] image<rgb> render(const scene& all, const view& from,
                                       const render_options& options = {});

/// As above, of all of the scene, as `fit` sees it.
export [[nodiscard]] image<rgb> render(const scene& all, const render_options& options = {});

namespace detail {
/// How many pixels a picture has at most, each of which supersampling makes several.
export inline constexpr index_t most_pixels = index_t(1) << 26;
}  // namespace detail

/// What a `picked` is.
export enum class picked_kind { point, line, triangle };
/// What is seen in a pixel.
export struct picked {
  std::string layer;                      ///< The name of the layer.
  picked_kind kind = picked_kind::point;  ///< What `batch` and `index` count.
  index_t batch = 0;      ///< Which of the layer's batches of that kind; 0 for a cloud.
  index_t index = 0;      ///< Which point, line or triangle of the batch.
  Eigen::Vector3d place;  ///< Where the middle of the pixel meets it, in the world.
};
/// What `render` draws at pixel (x, y) of the picture, counted from the top left; nothing where the
/// background or only what is transparent is. Of the options, size, budget, threads and stop count:
/// with supersampling, what is smaller than a pixel may be another thing. Throws as `render` does.
export [[nodiscard]] std::optional<picked> pick(const scene& all, const view& from, double x,
                                                double y, const render_options& options = {});

}  // namespace cilantro
