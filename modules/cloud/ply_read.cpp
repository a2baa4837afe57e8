// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "cloud/file.hpp"
#include "cloud/ply_header.hpp"
#include "cloud/ply_number.hpp"
#include "cloud/ply_stream.hpp"
module cilantro.cloud;

namespace cilantro {
namespace {

using ply::byte_stream;
using ply::element;
using ply::encoding;
using ply::load_number;
using ply::number;
using ply::parse_number;
using ply::property;
using ply::word_reader;

/// Where the values of one property of the vertices go: a strided row of scalars, of colours, or an
/// attribute of the property's own type.
template <Scalar S>
struct destination {
  enum class kind { none, scalar, color, attribute };
  kind to = kind::none;
  number type = number::float32;
  index_t row = 0;  ///< Of points (0 to D − 1), of normals (from D on), or of colours.
  attribute_values values = {};
};

inline constexpr auto eight_bit_colors = [] {
  std::array<float, 256> all{};
  for (int i = 0; i < 256; ++i) all[static_cast<std::size_t>(i)] = float(i) / 255.0f;
  return all;
}();

template <class T>
float as_color(T value) {
  if constexpr (std::same_as<T, std::uint8_t>)
    return eight_bit_colors[value];
  else
    return static_cast<float>(value);
}

template <Scalar S, int D>
class vertex_reader {
 public:
  vertex_reader(byte_stream& in, const element& vertex, encoding data, const task_monitor& monitor)
      : in_{in}, vertex_{vertex}, monitor_{monitor}, data_{data} {
    assign_destinations();
    check_size();
  }

  point_cloud<S, D> read() {
    const auto count = static_cast<index_t>(vertex_.count);
    cloud_.points.resize(D, count);
    if (with_normals_) cloud_.normals.resize(D, count);
    if (with_colors_) cloud_.colors.resize(3, count);
    for (auto& d : destinations_)
      if (d.to == kind::attribute)
        std::visit([&](auto& v) { v.resize(static_cast<std::size_t>(count)); }, d.values);

    if (data_ == encoding::ascii)
      read_lines();
    else if (vertex_.has_lists())
      read_with_lists();
    else
      read_records();

    for (std::size_t p = 0; p < destinations_.size(); ++p)
      if (destinations_[p].to == kind::attribute)
        cloud_.attributes.push_back(
            {vertex_.properties[p].name, std::move(destinations_[p].values)});
    return std::move(cloud_);
  }

 private:
  using kind = typename destination<S>::kind;

  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const {
    for (std::size_t p = 0; p < vertex_.properties.size(); ++p)
      if (vertex_.properties[p].name == name && !vertex_.properties[p].is_list) return p;
    return std::nullopt;
  }

  /// Sends the named properties to rows from `row` on, if they are all there and `accepts` their
  /// types.
  template <class Names, class Accepts>
  bool assign(const Names& names, kind to, index_t row, Accepts accepts) {
    std::vector<std::size_t> places;
    for (const std::string_view name : names) {
      const auto p = find(name);
      if (!p || !accepts(vertex_.properties[*p].type)) return false;
      places.push_back(*p);
    }
    for (const std::size_t p : places) {
      destinations_[p].to = to;
      destinations_[p].row = row++;
    }
    return true;
  }

  void assign_destinations() {
    destinations_.resize(vertex_.properties.size());
    for (std::size_t p = 0; p < destinations_.size(); ++p) {
      const auto& property = vertex_.properties[p];
      destinations_[p].type = property.type;
      if (property.is_list) continue;
      destinations_[p].to = kind::attribute;
      ply::visit_number(property.type,
                        [&]<class T>(T) { destinations_[p].values = std::vector<T>{}; });
    }
    using names = std::array<std::string_view, D>;
    constexpr auto point_names = [] {
      if constexpr (D == 2)
        return names{"x", "y"};
      else
        return names{"x", "y", "z"};
    }();
    constexpr auto normal_names = [] {
      if constexpr (D == 2)
        return names{"nx", "ny"};
      else
        return names{"nx", "ny", "nz"};
    }();
    constexpr auto any = [](number) { return true; };
    if (!assign(point_names, kind::scalar, 0, any))
      in_.fail_at_line(D == 2 ? "the vertices have no x and y" : "the vertices have no x, y and z");
    with_normals_ = assign(normal_names, kind::scalar, D, any);
    with_colors_ = assign(
        std::array<std::string_view, 3>{"red", "green", "blue"}, kind::color, 0, [](number n) {
          return n == number::uint8 || n == number::float32 || n == number::float64;
        });
  }

  /// Every value takes at least a byte, or a digit and a separator: a count that the rest of the
  /// file cannot hold is refused before any memory is asked for.
  void check_size() const {
    const std::uint64_t least =
        data_ == encoding::ascii ? 2 * vertex_.properties.size() : vertex_.least_size();
    if (vertex_.count > (in_.remaining() + 1) / least)
      in_.fail_at_byte("the header promises " + std::to_string(vertex_.count) +
                       " vertices of at least " + std::to_string(least) + " bytes, and only " +
                       std::to_string(in_.remaining()) + " bytes are left");
  }

  template <class T>
  void store(destination<S>& d, index_t i, T value) {
    switch (d.to) {
      case kind::none:
        break;
      case kind::scalar:
        (d.row < D ? cloud_.points(d.row, i) : cloud_.normals(d.row - D, i)) =
            static_cast<S>(value);
        break;
      case kind::color:
        cloud_.colors(d.row, i) = as_color(value);
        break;
      case kind::attribute:
        (*std::get_if<std::vector<T>>(&d.values))[static_cast<std::size_t>(i)] = value;
    }
  }

  [[nodiscard]] bool swapped() const {
    return (data_ == encoding::big_endian) != (std::endian::native == std::endian::big);
  }

  void watch(index_t done) {
    if (monitor_.stop.stop_requested()) throw cancelled{};
    if (monitor_.progress)
      monitor_.progress(double(done) / double(std::max<std::uint64_t>(1, vertex_.count)));
  }

  /// Records of one size, some thousands at a time, property by property: each loop moves one
  /// column.
  void read_records() {
    const std::size_t record = vertex_.least_size();
    const auto count = static_cast<index_t>(vertex_.count);
    const auto at_a_time =
        static_cast<index_t>(std::max<std::size_t>(1, (std::size_t{1} << 16) / record));
    for (index_t first = 0; first < count; first += at_a_time) {
      watch(first);
      const index_t n = std::min(at_a_time, count - first);
      const char* data = in_.take(record * static_cast<std::size_t>(n));
      for (std::size_t p = 0; p < destinations_.size(); ++p) {
        ply::visit_number(destinations_[p].type, [&]<class T>(T) {
          swapped() ? read_column<T, true>(destinations_[p], data, record, first, n)
                    : read_column<T, false>(destinations_[p], data, record, first, n);
        });
        data += ply::size_of(destinations_[p].type);
      }
    }
    watch(count);
  }

  template <class T, bool swap>
  void read_column(destination<S>& d, const char* data, std::size_t record, index_t first,
                   index_t n) {
    const auto each = [&](auto* out, index_t stride, auto convert) {
      for (index_t i = 0; i < n; ++i, data += record, out += stride)
        *out = convert(load_number<T>(data, swap));
    };
    const auto as_scalar = [](T v) { return static_cast<S>(v); };
    switch (d.to) {
      case kind::none:
        break;
      case kind::scalar:
        if (d.row < D)
          each(&cloud_.points(d.row, first), D, as_scalar);
        else
          each(&cloud_.normals(d.row - D, first), D, as_scalar);
        break;
      case kind::color:
        each(&cloud_.colors(d.row, first), 3, as_color<T>);
        break;
      case kind::attribute:
        each(std::get_if<std::vector<T>>(&d.values)->data() + first, 1, [](T v) { return v; });
    }
  }

  void read_with_lists() {
    for (index_t i = 0; i < static_cast<index_t>(vertex_.count); ++i) {
      if (i % 4096 == 0) watch(i);
      for (std::size_t p = 0; p < destinations_.size(); ++p) {
        if (vertex_.properties[p].is_list)
          skip_list(in_, vertex_.properties[p], swapped());
        else
          ply::visit_number(destinations_[p].type, [&]<class T>(T) {
            store(destinations_[p], i, load_number<T>(in_.take(sizeof(T)), swapped()));
          });
      }
    }
    watch(static_cast<index_t>(vertex_.count));
  }

  void read_lines() {
    for (index_t i = 0; i < static_cast<index_t>(vertex_.count); ++i) {
      if (i % 4096 == 0) watch(i);
      word_reader words{next_line(in_, "vertices")};
      for (std::size_t p = 0; p < destinations_.size(); ++p) {
        if (vertex_.properties[p].is_list) {
          skip_words(words);
          continue;
        }
        ply::visit_number(destinations_[p].type, [&]<class T>(T value) {
          const auto word = words.next();
          if (!parse_number(word, value)) fail_in_line(word, vertex_.properties[p]);
          store(destinations_[p], i, value);
        });
      }
      if (!words.done()) in_.fail_at_line("there are more values than the vertex has properties");
    }
    watch(static_cast<index_t>(vertex_.count));
  }

  void skip_words(word_reader& words) {
    std::uint32_t count = 0;
    if (!parse_number(words.next(), count))
      in_.fail_at_line("a list does not begin with its length");
    for (; count > 0; --count)
      if (words.next().empty()) in_.fail_at_line("a list is shorter than its length says");
  }

  [[noreturn]] void fail_in_line(std::string_view word, const property& p) const {
    if (word.empty()) in_.fail_at_line("the value of \"" + p.name + "\" is missing");
    in_.fail_at_line("\"" + std::string{word.substr(0, 40)} + "\" is no value of \"" + p.name +
                     "\"");
  }

 public:
  /// The next line that is not blank.
  static std::string_view next_line(byte_stream& in, const std::string& what) {
    for (;;) {
      const auto line = in.take_line();
      if (!line) in.fail_at_line("the file ends before all " + what + " were read");
      if (!word_reader{*line}.done()) return *line;
    }
  }

  static void skip_list(byte_stream& in, const property& list, bool swap) {
    const auto length = ply::visit_number(list.count_type, [&]<class T>(T) -> std::int64_t {
      return static_cast<std::int64_t>(load_number<T>(in.take(sizeof(T)), swap));
    });
    if (length < 0) in.fail_at_byte("a list has a negative length");
    in.skip(static_cast<std::uint64_t>(length) * ply::size_of(list.type));
  }

 private:
  byte_stream& in_;
  const element& vertex_;
  const task_monitor& monitor_;
  encoding data_;
  bool with_normals_ = false, with_colors_ = false;
  std::vector<destination<S>> destinations_;
  point_cloud<S, D> cloud_;
};

/// Passes over an element that comes before the vertices.
template <class Reader>
void skip_element(byte_stream& in, const element& e, encoding data) {
  if (e.properties.empty()) return;
  if (data == encoding::ascii) {
    for (std::uint64_t i = 0; i < e.count; ++i) Reader::next_line(in, e.name + " elements");
    return;
  }
  if (e.count > in.remaining() / e.least_size())
    in.fail_at_byte("the header promises more \"" + e.name + "\" than the file has bytes for");
  if (!e.has_lists()) return in.skip(e.count * e.least_size());
  const bool swap = (data == encoding::big_endian) != (std::endian::native == std::endian::big);
  for (std::uint64_t i = 0; i < e.count; ++i)
    for (const auto& p : e.properties)
      p.is_list ? Reader::skip_list(in, p, swap) : in.skip(ply::size_of(p.type));
}

template <Scalar S, int D>
point_cloud<S, D> read_stream(const std::filesystem::path& name, byte_stream in,
                              const ply_read_options& options) {
  try {
    auto header = ply::read_header(in);
    for (const auto& e : header.elements) {
      if (e.name != "vertex") {
        skip_element<vertex_reader<S, D>>(in, e, header.data);
        continue;
      }
      auto cloud = vertex_reader<S, D>{in, e, header.data, options.monitor}.read();
      cloud.comments = std::move(header.comments);
      return cloud;
    }
    in.fail_at_line("the file has no vertices");
  } catch (const ply::failure& f) {
    using unit = file_position::unit;
    throw io_error{name, f.what(), file_position{f.in_line ? unit::line : unit::byte, f.at}};
  }
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_ply(const std::filesystem::path& path, const ply_read_options& options) {
  try {
    detail::input_file file{path};
    return read_stream<S, D>(
        path, {file.size(), [&](char* out, std::size_t count) { return file.read(out, count); }},
        options);
  } catch (const std::system_error& error) {
    throw io_error{path, error.code().value() == EINVAL
                             ? "cannot be read: it is not a regular file"
                             : "cannot be read: " + error.code().message()};
  }
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_ply(std::span<const std::byte> bytes, const std::filesystem::path& name,
                           const ply_read_options& options) {
  std::size_t at = 0;
  return read_stream<S, D>(name,
                           {bytes.size(),
                            [&](char* out, std::size_t count) {
                              const std::size_t part = std::min(count, bytes.size() - at);
                              std::memcpy(out, bytes.data() + at, part);
                              at += part;
                              return part;
                            }},
                           options);
}

#define CILANTRO_INSTANTIATE(S, D)                                        \
  template point_cloud<S, D> read_ply<S, D>(const std::filesystem::path&, \
                                            const ply_read_options&);     \
  template point_cloud<S, D> read_ply<S, D>(                              \
      std::span<const std::byte>, const std::filesystem::path&, const ply_read_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
