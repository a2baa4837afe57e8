// SPDX-License-Identifier: MIT
//
// Points, lines and triangles as short texts, which a page unpacks. Internal; page.html is the
// other side of it.
//
// An array of integers becomes the bytes of its values: of all values the lowest byte, then of all
// the next one, since bytes of one kind compress better beside each other. These are compressed
// (zlib) and written in base64.
module;
#include <zlib.h>

module cilantro.visualization:packing;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :canvas;

namespace cilantro {

/// How many points are packed together: unpacked one after the other, they appear bit by bit.
constexpr index_t points_in_chunk = 1 << 16;

using bytes = std::vector<unsigned char>;

/// Appends `size` bytes of each value, plane by plane.
inline void append_planes(bytes& to, std::span<const std::uint32_t> values, int size) {
  for (int plane = 0; plane < size; ++plane)
    for (const std::uint32_t value : values)
      to.push_back(static_cast<unsigned char>(value >> (8 * plane)));
}

/// Small differences of either sign as small numbers.
inline std::uint32_t folded(std::uint32_t difference) {
  return difference << 1 ^ (0 - (difference >> 31));
}
/// The difference of each value from the one before.
inline void to_differences(std::span<std::uint32_t> values) {
  std::uint32_t before = 0;
  for (std::uint32_t& value : values) value = folded(value - std::exchange(before, value));
}

/// Appends the lowest byte of how much more than the one before a value is.
void append_differences(bytes& to, const auto& things, auto&& value_of) {
  std::uint32_t before = 0;
  for (const auto& thing : things) {
    const std::uint32_t value = value_of(thing);
    to.push_back(static_cast<unsigned char>(value - std::exchange(before, value)));
  }
}

inline std::string in_base64(const bytes& data) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((data.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < data.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, data.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < left ? data[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= left ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

inline std::string packed(const bytes& data) {
  // Neighbours differ by noise, of which a longer search finds no repetition: what there is to gain
  // is in the frequency of bytes.
  z_stream stream{};
  if (deflateInit2(&stream, 6, Z_DEFLATED, MAX_WBITS, MAX_MEM_LEVEL, Z_RLE) != Z_OK)
    throw std::bad_alloc{};
  bytes smaller(deflateBound(&stream, static_cast<uLong>(data.size())));
  stream.next_in = const_cast<unsigned char*>(data.data());
  stream.avail_in = static_cast<uInt>(data.size());
  stream.next_out = smaller.data();
  stream.avail_out = static_cast<uInt>(smaller.size());
  const int end = deflate(&stream, Z_FINISH);
  smaller.resize(stream.total_out);
  deflateEnd(&stream);
  if (end != Z_STREAM_END) throw std::logic_error{"packed: zlib has found no end"};
  return in_base64(smaller);
}

/// Points as integers: multiples of `step` from `low` on.
struct grid {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  double step = 1;

  /// Sized in length, a splat hides what is much smaller than it; otherwise, 65,536 steps are as
  /// many as a screen shows. Never more than 2^21 steps, so that three make a number of 63 bits.
  explicit grid(const point_batch& batch) {
    Eigen::AlignedBox3f box;
    for (const auto p : batch.points.colwise())
      if (is_finite(p)) box.extend(p);
    if (box.isEmpty()) return;
    low = box.min().cast<double>();
    const double extent = (box.max().cast<double>() - low).maxCoeff();
    double finest = extent / 65535;
    if (batch.size.in == point_size::unit::length && batch.size.sizes.size() > 0) {
      Eigen::VectorXf sizes = batch.size.sizes;
      const auto middle = sizes.begin() + sizes.size() / 2;
      std::nth_element(sizes.begin(), middle, sizes.end());
      if (*middle > 0) finest = double(*middle) / 32;
    }
    step = std::max(finest, extent / ((1 << 21) - 1));
    if (!(step > 0)) step = 1;
  }
  [[nodiscard]] inline std::uint32_t at(float coordinate, int axis) const {
    return static_cast<std::uint32_t>((double(coordinate) - low[axis]) / step + 0.5);
  }
};

/// A byte for a size, in equal ratios: 0 is the smallest and 255 the largest of the batch.
struct size_scale {
  float low = 1, high = 1;

  explicit size_scale(const point_size& of) {
    if (of.sizes.size() == 0) return;
    // Next to nothing is nothing; ratios to zero are none.
    high = std::max(of.sizes.maxCoeff(), std::numeric_limits<float>::min());
    low = std::max(of.sizes.minCoeff(), high * 1e-4f);
  }
  [[nodiscard]] inline std::uint32_t at(float size) const {
    if (!(high > low)) return 0;
    const float share = std::log(std::max(size, low) / low) / std::log(high / low);
    return static_cast<std::uint32_t>(std::clamp(share, 0.0f, 1.0f) * 255 + 0.5f);
  }
};

/// A direction as two bytes, each from 0 to 254; two zeros for none.
/// Source: Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit
/// Vectors" (octahedral).
inline std::array<std::uint32_t, 2> octahedral(const Eigen::Vector3f& direction) {
  const float sum = direction.cwiseAbs().sum();
  if (!(sum > 0) || !std::isfinite(sum)) return {0, 0};
  Eigen::Vector2f p = direction.head<2>() / sum;
  if (direction.z() < 0)
    p = {(1 - std::abs(p.y())) * (p.x() >= 0 ? 1.f : -1.f),
         (1 - std::abs(p.x())) * (p.y() >= 0 ? 1.f : -1.f)};
  const auto byte = [](float x) { return static_cast<std::uint32_t>(std::lround(127 * x) + 127); };
  const std::array both{byte(p.x()), byte(p.y())};
  // All four corners are the direction against z.
  return both == std::array{0u, 0u} ? std::array{254u, 254u} : both;
}

/// Bits of a number, with two zeros between them.
inline std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/// The finite points of a batch along a curve that fills space (Morton 1966), so that those beside
/// each other differ little. Of equal ones, the first comes first.
inline std::vector<index_t> along_a_curve(const point_batch& batch, const grid& on,
                                          const execution& how) {
  struct place {
    std::uint64_t code;
    index_t i;
    auto operator<=>(const place&) const = default;
  };
  const index_t n = batch.points.cols();
  std::vector<place> places(static_cast<std::size_t>(n));
  parallel_for(n, how, [&](index_t i) {
    const auto p = batch.points.col(i);
    std::uint64_t code = std::numeric_limits<std::uint64_t>::max();
    if (is_finite(p))
      code = spread(on.at(p.x(), 0)) | spread(on.at(p.y(), 1)) << 1 | spread(on.at(p.z(), 2)) << 2;
    places[static_cast<std::size_t>(i)] = {code, i};
  });
  parallel_blocks(n, points_in_chunk, how, [&](index_t, index_t begin, index_t end) {
    std::sort(places.begin() + begin, places.begin() + end);
  });
  std::vector<place> merged(places.size());
  for (index_t size = points_in_chunk; size < n; size *= 2) {
    parallel_blocks(n, 2 * size, how, [&](index_t, index_t begin, index_t end) {
      const auto middle = places.begin() + std::min(begin + size, end);
      std::merge(places.begin() + begin, middle, middle, places.begin() + end,
                 merged.begin() + begin);
    });
    places.swap(merged);
  }
  std::vector<index_t> order;
  order.reserve(places.size());
  for (const auto& [code, i] : places)
    if (code != std::numeric_limits<std::uint64_t>::max()) order.push_back(i);
  return order;
}

/// The points `order`, as differences from one to the next: of coordinates, 3 bytes each; if each
/// has a colour, of green, and of how much red and blue are more; if each has a size, of its byte;
/// if there are normals, of their two bytes.
inline std::string packed_points(const point_batch& batch, const grid& on, const size_scale& sizes,
                                 std::span<const index_t> order) {
  bytes data;
  std::vector<std::uint32_t> values(order.size());
  const auto append_bytes = [&](auto&& value_of) { append_differences(data, order, value_of); };
  for (int k = 0; k < 3; ++k) {
    std::ranges::transform(order, values.begin(),
                           [&](index_t i) { return on.at(batch.points(k, i), k); });
    to_differences(values);
    append_planes(data, values, 3);
  }
  const auto color = [&](int k) {
    return [&batch, k](index_t i) { return std::uint32_t{batch.colors(k, i)}; };
  };
  if (batch.colors.cols() > 1) {
    append_bytes(color(1));
    append_bytes([&](index_t i) { return color(0)(i) - color(1)(i); });
    append_bytes([&](index_t i) { return color(2)(i) - color(1)(i); });
  }
  if (batch.size.sizes.size() > 1)
    append_bytes([&](index_t i) { return sizes.at(batch.size.sizes[i]); });
  if (batch.normals.cols() > 0)
    for (std::size_t k = 0; k < 2; ++k)
      append_bytes([&](index_t i) { return octahedral(batch.normals.col(i))[k]; });
  return packed(data);
}

/// Colours of pixels, row by row, as those of points.
inline std::string packed_pixels(const image<rgb>& pixels) {
  bytes data;
  const auto append = [&](auto&& value_of) { append_differences(data, pixels.pixels(), value_of); };
  append([](const rgb& pixel) { return std::uint32_t{pixel[1]}; });
  append([](const rgb& pixel) { return std::uint32_t{pixel[0]} - pixel[1]; });
  append([](const rgb& pixel) { return std::uint32_t{pixel[2]} - pixel[1]; });
  return packed(data);
}

/// Columns of floats as their bits, of indices as differences, 4 bytes each; of colours as they
/// are.
template <class Columns>
void append_values(bytes& to, const Columns& columns) {
  using value = typename Columns::Scalar;
  if constexpr (std::same_as<value, std::uint8_t>) {
    to.insert(to.end(), columns.data(), columns.data() + columns.size());
  } else {
    std::vector<std::uint32_t> values;
    for (const value one : columns.reshaped()) values.push_back(std::bit_cast<std::uint32_t>(one));
    if constexpr (std::integral<value>) to_differences(values);
    append_planes(to, values, 4);
  }
}

}  // namespace cilantro
