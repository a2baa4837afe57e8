// SPDX-License-Identifier: MIT
//
// How a cloud is put together from the columns of a file. Internal: shared by the readers.
module;
#include "cloud/color.hpp"
#include "io/common/number.hpp"
module cilantro.io:cloud_builder;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

/// Whether two names are the same but for capital letters.
bool same_name(std::string_view a, std::string_view b);

/// A column of a file: its name, the type of its numbers, and whether anybody wants it.
struct file_field {
  std::string name;
  detail::number type = detail::number::float32;
  bool is_skipped = false;
};

/// What the pieces of one file have in common, which the first of them decides.
template <int D>
struct piece_agreement {
  std::optional<point_vector<double, D>> origin = {};
  std::optional<float> color_unit = {};  ///< What a floating colour of full intensity is.
};

/// Sends the columns of a file to points, normals, colours and attributes of a cloud.
template <Scalar S, int D>
class cloud_builder {
 public:
  /// What else is special: colours may be packed in 32 bits, or numbers are decimal.
  enum class style { plain, packed, text };

  /// x, y (and z) become the points, nx or normal_x and so on the normals, red or r and so on, as 8
  /// bits or as floating numbers, the colours; rgb and rgba, of 32 bits, colours, too, if they are
  /// packed. Case does not matter. Every other column becomes an attribute.
  cloud_builder(std::vector<file_field> fields, origin_policy origin, style how = style::plain);

  /// Makes this a piece of a file: an origin that was agreed is used, whatever the numbers or the
  /// file say, and so is a unit of colours, which is noted if it was not known. Before `resize`.
  void agree_with(piece_agreement<D>& others) {
    agreement_ = &others;
    if (others.origin) is_wide_ = std::same_as<S, float>;
  }

  [[nodiscard]] bool has_points() const { return has_points_; }
  /// Whether colours are of a unit that only their values tell.
  [[nodiscard]] bool has_floating_colors() const;
  /// Makes room. Nothing is asked for before.
  void resize(index_t count);

  /// Value `i` of column `f`, whose type is T.
  template <class T>
  void store(std::size_t f, index_t i, T value) {
    auto& to = targets_[f];
    switch (to.to) {
      case kind::none:
        break;
      case kind::point:
        is_wide_ ? void(wide_(to.row, i) = static_cast<double>(value))
                 : void(cloud_.points(to.row, i) = static_cast<S>(value));
        break;
      case kind::normal:
        cloud_.normals(to.row, i) = static_cast<S>(value);
        break;
      case kind::color:
        cloud_.colors(to.row, i) = as_color(value);
        break;
      case kind::packed_color:
        store_packed(to, i, value);
        break;
      case kind::attribute:
        (*std::get_if<std::vector<T>>(&to.values))[i] = value;
    }
  }

  /// Values `first` to `first + n` − 1 of column `f`, `stride` bytes apart.
  void store_column(std::size_t f, index_t first, index_t n, const char* data, std::size_t stride,
                    bool swap);

  /// The cloud, once every value is there, with the comments of the file.
  [[nodiscard]] point_cloud<S, D> finish(std::vector<std::string> comments);

 private:
  enum class kind { none, point, normal, color, packed_color, attribute };
  struct target {
    enum kind to = kind::none;
    index_t row = 0;
    attribute_values values = {};
    std::vector<std::uint8_t> alpha = {};
  };

  template <class T>
  static float as_color(T value) {
    if constexpr (std::same_as<T, std::uint8_t>)
      return detail::from_eight_bit(value);
    else
      return static_cast<float>(value);
  }
  template <class T>
  void store_packed(target& to, index_t i, T value) {
    if constexpr (sizeof(T) == 4) {
      const auto bits = std::bit_cast<std::uint32_t>(value);
      for (int c = 0; c < 3; ++c)
        cloud_.colors(c, i) =
            detail::from_eight_bit(static_cast<std::uint8_t>(bits >> (16 - 8 * c)));
      if (!to.alpha.empty()) to.alpha[i] = static_cast<std::uint8_t>(bits >> 24);
    }
  }
  template <class T, bool swap>
  void store_column(std::size_t f, index_t first, index_t n, const char* data, std::size_t stride);
  bool assign(std::initializer_list<std::string_view> names, kind to);
  void choose_origin();
  [[nodiscard]] bool is_exact(double value) const;
  void scale_colors();
  void take_size(std::vector<std::string>& comments);

  std::vector<file_field> fields_;
  origin_policy origin_;
  piece_agreement<D>* agreement_ = nullptr;
  bool is_text_;
  bool has_points_ = false, with_normals_ = false, with_colors_ = false;
  bool is_wide_ = false;  ///< Whether coordinates are kept in double until all are known.
  point_matrix<double, D> wide_;
  std::vector<target> targets_;
  point_cloud<S, D> cloud_;
};

/// The origin that a comment of a file names, which is removed; nothing if there is none.
template <int D>
std::optional<point_vector<double, D>> take_origin(std::vector<std::string>& comments);
/// The comment in which a writer notes the origin of a cloud.
template <int D>
std::string origin_comment(const point_vector<double, D>& origin);
/// The comment in which a writer notes width and height, where the format has no place for them.
std::string size_comment(int width, int height);

}  // namespace cilantro
