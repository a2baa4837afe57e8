// SPDX-License-Identifier: MIT
export module cilantro.core:image;

import cilantro.standard;
import :error;
import :points;

namespace cilantro {

/// A red, green and blue value from 0 to 255.
export using rgb = std::array<std::uint8_t, 3>;

/// A picture of `width` times `height` pixels, row by row from the top left.
export template <class T>
class image {
 public:
  image() = default;
  /// Throws `invalid_input` for a negative size.
  image(int width, int height, const T& fill = {}) : width_{width}, height_{height} {
    expects(width >= 0 && height >= 0, "image: width and height must not be negative");
    pixels_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), fill);
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// Precondition: 0 <= x < width(), 0 <= y < height().
  [[nodiscard]] T& operator()(int x, int y) { return pixels_[at(x, y)]; }
  [[nodiscard]] const T& operator()(int x, int y) const { return pixels_[at(x, y)]; }
  [[nodiscard]] std::vector<T>& pixels() { return pixels_; }
  [[nodiscard]] const std::vector<T>& pixels() const { return pixels_; }

  friend bool operator==(const image&, const image&) = default;

 private:
  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  int width_ = 0, height_ = 0;
  std::vector<T> pixels_;
};

}  // namespace cilantro
