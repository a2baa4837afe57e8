// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
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
module cilantro.cloud;

namespace cilantro {
namespace {

/// A property of the file: its name, and the strided numbers that it is written from.
struct column {
  std::string name;
  std::variant<const std::int8_t*, const std::uint8_t*, const std::int16_t*, const std::uint16_t*,
               const std::int32_t*, const std::uint32_t*, const float*, const double*>
      data;
  index_t stride = 1;
  bool as_eight_bit = false;  ///< A colour in [0, 1] that is written as 0 to 255.

  [[nodiscard]] ply::number type() const {
    return as_eight_bit ? ply::number::uint8 : static_cast<ply::number>(data.index());
  }
};

std::uint8_t to_eight_bit(float color) {
  // NaN fails both comparisons and becomes black.
  return static_cast<std::uint8_t>(255.0f * (color > 0 ? std::min(color, 1.0f) : 0.0f) + 0.5f);
}

/// The first number of a row; nothing in an empty matrix.
template <class M>
const typename M::Scalar* row_of(const M& matrix, index_t row) {
  return matrix.cols() > 0 ? &matrix(row, 0) : nullptr;
}

template <Scalar S, int D>
std::vector<column> columns_of(const point_cloud<S, D>& cloud, bool float_colors) {
  constexpr std::array axes{"x", "y", "z"};
  constexpr std::array channels{"red", "green", "blue"};
  std::vector<column> columns;
  for (int d = 0; d < D; ++d) columns.push_back({axes[d], row_of(cloud.points, d), D});
  if (cloud.has_normals())
    for (int d = 0; d < D; ++d)
      columns.push_back({std::string{"n"} + axes[d], row_of(cloud.normals, d), D});
  if (cloud.has_colors())
    for (int c = 0; c < 3; ++c)
      columns.push_back({channels[c], row_of(cloud.colors, c), 3, !float_colors});
  for (const auto& a : cloud.attributes)
    std::visit([&](const auto& values) { columns.push_back({a.name, values.data()}); }, a.values);

  std::vector<std::string_view> names;
  for (const column& c : columns) {
    expects(!c.name.empty() && c.name.find_first_of(" \t\r\n\v\f") == c.name.npos,
            "write_ply: the attribute \"" + c.name + "\" has a name that PLY cannot hold");
    names.push_back(c.name);
  }
  if (const auto twice = repeated_name(std::move(names)))
    throw invalid_input{"write_ply: there would be two properties \"" + std::string{*twice} + '"'};
  return columns;
}

std::string header_of(const std::vector<column>& columns, const std::vector<std::string>& comments,
                      index_t size, ply_format format) {
  constexpr std::array formats{"ascii", "binary_little_endian", "binary_big_endian"};
  std::string text =
      std::string{"ply\nformat "} + formats[static_cast<std::size_t>(format)] + " 1.0\n";
  for (const std::string& comment : comments) {
    // A comment of several lines would end the header's line, and with luck the header.
    std::string_view rest = comment;
    const bool is_info = rest.starts_with("obj_info ");
    if (is_info) rest.remove_prefix(9);
    for (bool more = true; more;) {
      const auto end = rest.find_first_of("\r\n");
      text += (is_info ? "obj_info " : "comment ") + std::string{rest.substr(0, end)} + '\n';
      more = end != rest.npos;
      if (more) rest.remove_prefix(end + 1);
    }
  }
  text += "element vertex " + std::to_string(size) + '\n';
  for (const column& c : columns)
    text += "property " + std::string{ply::number_names[static_cast<std::size_t>(c.type())].first} +
            ' ' + c.name + '\n';
  return text + "end_header\n";
}

/// The records `first` to `first + n` − 1 as bytes; each loop fills one column.
void encode_records(const std::vector<column>& columns, index_t first, index_t n,
                    std::size_t record, bool swap, char* out) {
  for (const column& c : columns) {
    std::visit(
        [&]<class T>(const T* data) {
          const auto each = [&](auto convert) {
            const T* in = data + first * c.stride;
            char* place = out;
            for (index_t i = 0; i < n; ++i, in += c.stride, place += record) {
              const auto value = convert(*in);
              std::memcpy(place, &value, sizeof value);
            }
          };
          if constexpr (std::same_as<T, float>)
            if (c.as_eight_bit) return each(to_eight_bit);
          if (swap)
            each(ply::swap_bytes<T>);
          else
            each([](T v) { return v; });
        },
        c.data);
    out += ply::size_of(c.type());
  }
}

void encode_line(const std::vector<column>& columns, index_t i, std::string& text) {
  std::array<char, 64> digits;
  for (const column& c : columns) {
    std::visit(
        [&]<class T>(const T* data) {
          const T value = data[i * c.stride];
          const auto put = [&](auto v) {
            const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), v).ptr;
            text.append(digits.data(), end);
          };
          if constexpr (std::same_as<T, float>)
            c.as_eight_bit ? put(int{to_eight_bit(value)}) : put(value);
          else if constexpr (sizeof(T) == 1)
            put(int{value});
          else
            put(value);
        },
        c.data);
    text += ' ';
  }
  text.back() = '\n';
}

/// About what fits a core's second cache, together with what it is made from.
constexpr std::size_t piece = std::size_t{1} << 17;

void write_columns(const std::vector<column>& columns, index_t size,
                   const ply_write_options& options, detail::output_file& file) {
  const auto watch = [&](index_t done) {
    if (options.monitor.stop.stop_requested()) throw cancelled{};
    if (options.monitor.progress)
      options.monitor.progress(double(done) / double(std::max(index_t{1}, size)));
  };
  if (options.format == ply_format::ascii) {
    std::string text;
    for (index_t i = 0; i < size; ++i) {
      encode_line(columns, i, text);
      if (text.size() < piece) continue;
      watch(i);
      file.write(text.data(), text.size());
      text.clear();
    }
    file.write(text.data(), text.size());
  } else {
    std::size_t record = 0;
    for (const column& c : columns) record += ply::size_of(c.type());
    const bool swap = (options.format == ply_format::binary_big_endian) !=
                      (std::endian::native == std::endian::big);
    const auto at_a_time = static_cast<index_t>(std::max<std::size_t>(1, piece / record));
    std::vector<char> bytes(record * static_cast<std::size_t>(at_a_time));
    for (index_t first = 0; first < size; first += at_a_time) {
      watch(first);
      const index_t n = std::min(at_a_time, size - first);
      encode_records(columns, first, n, record, swap, bytes.data());
      file.write(bytes.data(), record * static_cast<std::size_t>(n));
    }
  }
  watch(size);
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_ply(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const ply_write_options& options) {
  expect_consistent(cloud, "write_ply");
  const auto columns = columns_of(cloud, options.float_colors);
  const auto header = header_of(columns, cloud.comments, cloud.size(), options.format);
  try {
    detail::output_file file{path};
    file.write(header.data(), header.size());
    write_columns(columns, cloud.size(), options, file);
    file.commit();
  } catch (const std::system_error& error) {
    throw io_error{path, "cannot be written: " + error.code().message()};
  }
}

template void write_ply(const point_cloud<float, 2>&, const std::filesystem::path&,
                        const ply_write_options&);
template void write_ply(const point_cloud<float, 3>&, const std::filesystem::path&,
                        const ply_write_options&);
template void write_ply(const point_cloud<double, 2>&, const std::filesystem::path&,
                        const ply_write_options&);
template void write_ply(const point_cloud<double, 3>&, const std::filesystem::path&,
                        const ply_write_options&);

}  // namespace cilantro
