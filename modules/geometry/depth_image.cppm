// SPDX-License-Identifier: MIT
export module cilantro.geometry:depth_image;

import cilantro.standard;
import cilantro.core;
import :camera;

namespace cilantro {

/// Converts the value that a sensor stores in a pixel to a depth: the distance z ahead of the
/// camera in metres, not the distance along the ray. A function of the pixel's value; zero,
/// negative and non-finite results mean that the depth is unknown. Pure, and called from several
/// threads at once.
/// Models: `depth_scale`, `truncated_depth`, `disparity`; any lambda.
export template <class F, class Pixel>
concept DepthConverter = requires(const F& convert, const Pixel& pixel) {
  { convert(pixel) } -> std::convertible_to<double>;
};

/// Depth in multiples of a unit. By default, integers are millimetres and floating-point numbers
/// metres. In integers, 0 and the largest value mean unknown, since sensors store these where they
/// have measured nothing.
export struct depth_scale {
  std::optional<positive> units_per_metre = {};  ///< 1000 for millimetres, 5000 in the TUM data.

  template <class Pixel>
  [[nodiscard]] double operator()(Pixel value) const {
    if constexpr (std::integral<Pixel>) {
      if (value == std::numeric_limits<Pixel>::max()) return 0;
      return double(value) / (units_per_metre ? double(*units_per_metre) : 1000.0);
    } else {
      return units_per_metre ? double(value) / double(*units_per_metre) : double(value);
    }
  }
};

/// The depth of another converter, if it is from `nearest` to `farthest`; otherwise unknown.
export template <class F = depth_scale>
class truncated_depth {
 public:
  /// Both limits are in metres, and inclusive. Throws `invalid_input` unless `nearest` <=
  /// `farthest`.
  truncated_depth(double nearest, double farthest, F convert = {})
      : nearest_{nearest}, farthest_{farthest}, convert_{std::move(convert)} {
    expects(nearest <= farthest,
            "truncated_depth: the nearest depth must not be beyond the farthest");
  }

  template <class Pixel>
    requires DepthConverter<F, Pixel>
  [[nodiscard]] double operator()(Pixel value) const {
    const double depth = convert_(value);
    return depth >= nearest_ && depth <= farthest_ ? depth : 0;
  }

 private:
  double nearest_, farthest_;
  F convert_;
};

/// Depth from the shift between the two images of a stereo camera: focal length × baseline / shift.
export struct disparity {
  positive focal_length;         ///< In pixels.
  positive baseline;             ///< In metres.
  positive pixels_per_unit = 1;  ///< 1/16 for OpenCV's fixed-point disparities.

  template <class Pixel>
  [[nodiscard]] double operator()(Pixel value) const {
    const double shift = double(value) * double(pixels_per_unit);
    return shift > 0 ? double(focal_length) * double(baseline) / shift : 0;
  }
};

/// The depth of each pixel in metres, 0 where it is unknown. In parallel.
export template <Scalar S, ImageSource I, DepthConverter<pixel_of<I>> F = depth_scale>
[[nodiscard]] image<S> to_depth(const I& stored, const F& convert = {}, const execution& how = {}) {
  const image_view view{stored};
  image<S> depth(view.width(), view.height());
  parallel_blocks(view.height(), 16, how, [&](index_t, index_t begin, index_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < view.width(); ++x) {
        const double z = convert(view(x, y));
        depth(x, y) = z > 0 && std::isfinite(z) ? static_cast<S>(z) : S(0);
      }
  });
  return depth;
}

template <Scalar S>
point_matrix<S, 3> closed_unproject(const image<S>& depth, const pinhole_camera<S>& camera,
                                    const execution& how);

/// The points that a depth image shows, in world coordinates: one per pixel, row by row, NaN where
/// the depth is unknown, so that neighbouring pixels can be found by their indices;
/// `remove_invalid` drops the unknown ones. By default, integers are millimetres and floating-point
/// pixels metres. Throws `invalid_input` if image and camera differ in size, or for focal lengths
/// that are not positive. Memory beside the result: one scalar per pixel.
export template <Scalar S, ImageSource I, DepthConverter<pixel_of<I>> F = depth_scale>
[[nodiscard]] point_matrix<S, 3> unproject(const I& depth, const pinhole_camera<S>& camera,
                                           const F& convert = {}, const execution& how = {}) {
  return closed_unproject<S>(to_depth<S>(depth, convert, how), camera, how);
}

/// As `unproject`, without the pixels that have no depth. The image is in metres.
export template <Scalar S>
[[nodiscard]] point_matrix<S, 3> unproject_known(const image<S>& depth,
                                                 const pinhole_camera<S>& camera,
                                                 const execution& how = {});

/// Normals of the organised points of one camera: for each pixel, the cross product of the
/// differences between its right and left and its lower and upper neighbour, at unit length and
/// turned towards the camera. Zero at the border of the image, and where the pixel or one of its
/// four neighbours is unknown. Throws `invalid_input` unless there is one point per pixel.
/// Source: Holzer et al. 2012, "Adaptive neighborhood selection", section III, without smoothing.
export template <Scalar S>
[[nodiscard]] point_matrix<S, 3> organized_normals(const point_matrix<S, 3>& points,
                                                   const pinhole_camera<S>& camera,
                                                   const execution& how = {});

/// Converts depth in metres to 16-bit multiples of a unit, rounded to the nearest; 0 where the
/// depth is unknown or too large.
export template <Scalar S>
[[nodiscard]] image<std::uint16_t> quantize_depth(const image<S>& depth,
                                                  positive units_per_metre = 1000);

}  // namespace cilantro
