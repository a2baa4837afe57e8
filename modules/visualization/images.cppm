// SPDX-License-Identifier: MIT
//
// Images in a scene, and as pictures of their own.
export module cilantro.visualization:images;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import cilantro.io;
import :canvas;
import :color_map;
import :picture;
import :render;
import :scene;
import :view;

namespace cilantro {

/// What can be drawn as an image: pixels that are `rgb`, shown with their own colours, or numbers,
/// shown by a `color_map` with a legend: an `image`, an `image_view` or a row-major matrix.
export template <class I>
concept DrawableImage = ImageSource<I> && !PointsSource<I> &&
                        (std::same_as<pixel_of<I>, rgb> || std::is_arithmetic_v<pixel_of<I>>);

/// How an image is drawn: `scene{}.set("depth", depth, image_look{.map = viridis})`. In a scene it
/// lies in the plane z = 0, the middle of pixel (x, y) at (x, −y, 0), or elsewhere. It has its
/// colours exactly, without light from the eye or darker edges; where a pixel of it covers several
/// of the picture, they are alike.
export struct image_look {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< Of that plane, in the world.
  Eigen::Vector2d pixel_size = {1, 1};  ///< Width and height of a pixel, in units of the world.
  double opacity = 1;                   ///< From 0, which shows nothing, to 1.
  /// Of numbers, from the lowest value to the highest; by default `turbo`.
  std::optional<color_map> map = {};
  /// The values at the ends of the map, of numbers; by default those there are.
  std::optional<double> low = {}, high = {};
  /// The number that means that a value is not known, as NaN always does. By default 0 in images of
  /// 16 bits, which are depths in this library, and none in others; NaN: none.
  std::optional<double> unknown = {};
  std::string title = {};  ///< Of the legend of numbers.
};

/// An image as triangles with a texture, and what the colours of numbers mean.
void draw_colors(image<rgb> colors, canvas& on, const image_look& look);
void draw_values(std::vector<double> values, int width, int height, canvas& on,
                 const image_look& look);

/// Draws an image; one without pixels is nothing. Throws `invalid_input` for a look that is not
/// finite, for an opacity beyond 0 and 1, for ends of the map in the wrong order, and for what only
/// numbers have if the pixels are `rgb`.
export template <DrawableImage I>
void draw(const I& source, canvas& on, const image_look& look = {}) {
  const image_view pixels{source};
  using pixel = pixel_of<I>;
  if constexpr (std::same_as<pixel, rgb>) {
    image<rgb> colors(pixels.width(), pixels.height());
    for (int y = 0; y < pixels.height(); ++y) std::ranges::copy(pixels[y], colors[y].begin());
    draw_colors(std::move(colors), on, look);
  } else {
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(pixels.width()) *
                   static_cast<std::size_t>(pixels.height()));
    for (int y = 0; y < pixels.height(); ++y)
      for (const pixel value : pixels[y]) values.push_back(double(value));
    image_look known = look;
    if (std::same_as<pixel, std::uint16_t> && !look.unknown) known.unknown = 0;
    draw_values(std::move(values), pixels.width(), pixels.height(), on, known);
  }
}

/// The look of an image that a camera has taken, `depth` ahead of it, as large as what it sees
/// there: the frustum of `frustum_lines` with the same depth ends in it.
export [[nodiscard]] image_look image_at(const pinhole_camera<double>& camera, positive depth = 1);

/// `one_to_one` of an image of that size.
[[nodiscard]] view view_of_pixels(int width, int height, const image_look& look);

/// The view that shows an image pixel by pixel: of its size, by parallel rays, straight from the
/// front. Throws `invalid_input` for an image without pixels and a look that is not finite.
export template <DrawableImage I>
[[nodiscard]] view one_to_one(const I& source, const image_look& look = {}) {
  const image_view pixels{source};
  return view_of_pixels(pixels.width(), pixels.height(), look);
}

/// A picture of a scene that is an image of that size.
[[nodiscard]] image<rgb> render_pixels(const scene& all, int width, int height,
                                       const image_look& look, const render_options& options);

/// An image pixel by pixel, that of numbers with its legend to the right of it, as far as there is
/// room. In a picture of another size, as large as fits. Throws `invalid_input` for an image
/// without pixels, and as `draw` and the `render` of scenes do.
export template <DrawableImage I>
[[nodiscard]] image<rgb> render(const I& source, const image_look& look = {},
                                const render_options& options = {}) {
  const image_view pixels{source};
  return render_pixels(scene{}.set("image", source, look), pixels.width(), pixels.height(), look,
                       options);
}

/// As above, as a PNG file. Throws as the `write_picture` of scenes does, too.
export template <DrawableImage I>
void write_picture(const I& source, const std::filesystem::path& path, const image_look& look = {},
                   const render_options& options = {}) {
  expect_picture_name(path);
  write_png(render(source, look, options), path);
}

}  // namespace cilantro
