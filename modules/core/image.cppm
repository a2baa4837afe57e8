// SPDX-License-Identifier: MIT
export module cilantro.core:image;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :indexed_iterator;
import :points;

namespace cilantro {

/// Red, green and blue, each from 0 to 255.
export using rgb = std::array<std::uint8_t, 3>;

/// A picture of `width` × `height` pixels, stored row by row from the top left. It is a range of
/// its rows, each a span; `pixels()` holds all pixels one after the other.
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
  [[nodiscard]] T& operator()(int x, int y) [[clang::lifetimebound]] { return pixels_[at(x, y)]; }
  [[nodiscard]] const T& operator()(int x, int y) const [[clang::lifetimebound]] {
    return pixels_[at(x, y)];
  }
  [[nodiscard]] std::vector<T>& pixels() [[clang::lifetimebound]] { return pixels_; }
  [[nodiscard]] const std::vector<T>& pixels() const [[clang::lifetimebound]] { return pixels_; }

  /// Row `y`. Precondition: 0 <= y < height().
  [[nodiscard]] std::span<T> operator[](index_t y) [[clang::lifetimebound]] {
    return std::span{pixels_}.subspan(at(0, static_cast<int>(y)), width_);
  }
  [[nodiscard]] std::span<const T> operator[](index_t y) const [[clang::lifetimebound]] {
    return std::span{pixels_}.subspan(at(0, static_cast<int>(y)), width_);
  }
  [[nodiscard]] index_t size() const { return height_; }  ///< The number of rows.
  [[nodiscard]] auto begin() const [[clang::lifetimebound]] {
    return indexed_iterator{indexed_rows{this}, 0};
  }
  [[nodiscard]] auto end() const [[clang::lifetimebound]] { return begin() + size(); }

  friend bool operator==(const image&, const image&) = default;

 private:
  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  int width_ = 0, height_ = 0;
  std::vector<T> pixels_;
};

/// A read-only picture of `width` × `height` pixels in memory that it does not own, row by row from
/// the top left; a range of its rows, as `image` is. Made from an `image`, a row-major Eigen
/// matrix, or a pointer, such as to the data of an OpenCV matrix:
/// `image_view{m.ptr<std::uint16_t>(), m.cols, m.rows, m.step1()}`. Valid as long as that memory
/// is.
export template <class T>
class image_view {
 public:
  image_view() = default;
  image_view(const image<T>& source [[clang::lifetimebound]])  // NOLINT: a conversion on purpose
      : image_view{source.pixels().data(), source.width(), source.height()} {}
  /// Each row begins `stride` pixels after the one before; by default `width`. Throws
  /// `invalid_input` for a negative size, a stride below the width, or null data for a picture that
  /// is not empty.
  image_view(const T* data, int width, int height, std::optional<index_t> stride = {})
      : data_{data}, width_{width}, height_{height}, stride_{stride.value_or(width)} {
    expects(width >= 0 && height >= 0, "image_view: width and height must not be negative");
    expects(stride_ >= width, "image_view: the stride must be at least the width");
    expects(data != nullptr || width == 0 || height == 0, "image_view: the data must not be null");
  }
  template <class M>
    requires std::derived_from<M, Eigen::MatrixBase<M>> && std::same_as<typename M::Scalar, T> &&
             (bool(M::IsRowMajor) && M::InnerStrideAtCompileTime == 1)
  image_view(const M& matrix)  // NOLINT
      : image_view{matrix.data(), static_cast<int>(matrix.cols()), static_cast<int>(matrix.rows()),
                   matrix.outerStride()} {}

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// Precondition: 0 <= x < width(), 0 <= y < height().
  [[nodiscard]] const T& operator()(int x, int y) const { return data_[y * stride_ + x]; }
  /// Row `y`. Precondition: 0 <= y < height().
  [[nodiscard]] std::span<const T> operator[](index_t y) const {
    return {data_ + y * stride_, static_cast<std::size_t>(width_)};
  }
  [[nodiscard]] index_t size() const { return height_; }  ///< The number of rows.
  [[nodiscard]] auto begin() const { return indexed_iterator{*this, 0}; }
  [[nodiscard]] auto end() const { return begin() + size(); }

 private:
  const T* data_ = nullptr;
  int width_ = 0, height_ = 0;
  index_t stride_ = 0;
};
export template <class T>
image_view(const image<T>&) -> image_view<T>;
export template <class M>
  requires std::derived_from<M, Eigen::MatrixBase<M>>
image_view(const M&) -> image_view<typename M::Scalar>;

/// A type that an `image_view` can be made from, and the type of its pixels.
export template <class I>
concept ImageSource = requires(const I& source) { image_view{source}; };
export template <ImageSource I>
using pixel_of = std::remove_cvref_t<decltype(image_view{std::declval<const I&>()}(0, 0))>;

}  // namespace cilantro

template <class T>
inline constexpr bool std::ranges::enable_view<cilantro::image_view<T>> = true;
template <class T>
inline constexpr bool std::ranges::enable_borrowed_range<cilantro::image_view<T>> = true;
