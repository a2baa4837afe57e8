// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "cloud/color.hpp"
#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
module cilantro.io;

import :cloud_columns;
import :file_scope;

namespace cilantro {
namespace {

using form = file_column::form;

/// The first number of a row; nothing in an empty matrix.
template <class M>
const typename M::Scalar* row_of(const M& matrix, index_t row) {
  return matrix.cols() > 0 ? &matrix(row, 0) : nullptr;
}

/// Calls `f(value)` with the value at `data` as it is written.
template <class T, class F>
void written(const file_column& c, const T* data, F&& f) {
  switch (c.as) {
    case form::plain:
      return f(*data);
    case form::shifted:
      return f(static_cast<double>(*data) + c.offset);
    case form::eight_bit:
    case form::packed:
      break;
  }
  if constexpr (std::same_as<T, float>) {
    if (c.as == form::eight_bit) return f(detail::to_eight_bit(*data));
    std::uint32_t bits = 0;
    for (int i = 0; i < 3; ++i) bits = bits << 8 | detail::to_eight_bit(data[i]);
    return f(bits);
  }
}

/// About what fits a core's second cache, together with what it is made from.
constexpr std::size_t piece = std::size_t{1} << 17;

}  // namespace

detail::number file_column::type() const {
  switch (as) {
    case form::eight_bit:
      return detail::number::uint8;
    case form::packed:
      return detail::number::uint32;
    case form::shifted:
      return detail::number::float64;
    case form::plain:
      break;
  }
  return static_cast<detail::number>(data.index());
}

template <Scalar S, int D>
std::vector<file_column> columns_of(const point_cloud<S, D>& cloud, const column_style& style) {
  constexpr std::array axes{"x", "y", "z"};
  constexpr std::array channels{"red", "green", "blue"};
  using color_form = enum column_style::colors;
  std::vector<file_column> columns;
  for (int d = 0; d < D; ++d)
    columns.push_back({axes[d], row_of(cloud.points, d), D,
                       cloud.has_origin() ? form::shifted : form::plain, cloud.origin[d]});
  if (cloud.has_normals())
    for (int d = 0; d < D; ++d)
      columns.push_back({std::string{style.normal_prefix} + axes[d], row_of(cloud.normals, d), D});
  for (index_t i = 0; i < cloud.colors.cols(); ++i)
    for (const float c : cloud.colors.col(i))
      if (!(c >= -1e-6f && c <= 1 + 1e-6f))
        throw invalid_input{"a color of point " + std::to_string(i) + " is " + std::to_string(c) +
                            ", and cannot be written: colors are from 0 to 1"};
  if (cloud.has_colors() && style.colors == color_form::packed)
    columns.push_back({"rgb", row_of(cloud.colors, 0), 3, form::packed});
  else if (cloud.has_colors())
    for (int c = 0; c < 3; ++c)
      columns.push_back({channels[c], row_of(cloud.colors, c), 3,
                         style.colors == color_form::eight_bit ? form::eight_bit : form::plain});
  for (const auto& a : cloud.attributes)
    std::visit([&](const auto& values) { columns.push_back({a.name, values.data()}); }, a.values);
  return columns;
}

void expect_writable_names(const std::vector<file_column>& columns, const char* who,
                           std::string_view forbidden) {
  std::vector<std::string_view> names;
  for (const file_column& c : columns) {
    expects(!c.name.empty() && c.name.find_first_of(" \t\r\n\v\f") == c.name.npos &&
                c.name.find_first_of(forbidden) == c.name.npos,
            std::string{who} + ": the attribute \"" + c.name +
                "\" has a name that the file cannot hold");
    names.push_back(c.name);
  }
  if (const auto twice = repeated_name(std::move(names)))
    throw invalid_input{std::string{who} + ": there would be two columns \"" + std::string{*twice} +
                        '"'};
}

std::size_t record_size(const std::vector<file_column>& columns) {
  std::size_t size = 0;
  for (const file_column& c : columns) size += detail::size_of(c.type());
  return size;
}

void encode_column(const file_column& c, index_t first, index_t n, std::size_t step, bool swap,
                   char* out) {
  std::visit(
      [&]<class T>(const T* data) {
        const T* in = data + first * c.stride;
        const auto each = [&](auto convert) {
          char* place = out;
          for (index_t i = 0; i < n; ++i, in += c.stride, place += step) {
            const auto value = convert(in);
            std::memcpy(place, &value, sizeof value);
          }
        };
        // The common cases are loops without a choice in them.
        if (c.as == form::plain && !swap) return each([](const T* v) { return *v; });
        if constexpr (std::same_as<T, float>)
          if (c.as == form::eight_bit)
            return each([](const T* v) { return detail::to_eight_bit(*v); });
        char* place = out;
        for (index_t i = 0; i < n; ++i, in += c.stride, place += step)
          written(c, in, [&](auto value) {
            if (swap) value = detail::swap_bytes(value);
            std::memcpy(place, &value, sizeof value);
          });
      },
      c.data);
}

void encode_records(const std::vector<file_column>& columns, index_t first, index_t n,
                    std::size_t record, bool swap, char* out) {
  for (const file_column& c : columns) {
    encode_column(c, first, n, record, swap, out);
    out += detail::size_of(c.type());
  }
}

void encode_line(const std::vector<file_column>& columns, index_t i, char separator,
                 std::string& text) {
  std::array<char, 64> digits;
  for (const file_column& c : columns) {
    std::visit(
        [&](const auto* data) {
          written(c, data + i * c.stride, [&]<class V>(V value) {
            const auto put = [&](auto v) {
              const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), v).ptr;
              text.append(digits.data(), end);
            };
            if constexpr (sizeof(V) == 1)
              put(int{value});
            else
              put(value);
          });
        },
        c.data);
    text += separator;
  }
  text.back() = '\n';
}

void encode_text(const std::vector<file_column>& columns, index_t size, char separator,
                 const task_monitor& monitor, const std::function<void(std::string_view)>& write) {
  std::string text;
  for (index_t i = 0; i < size; ++i) {
    encode_line(columns, i, separator, text);
    if (text.size() < piece) continue;
    watch(monitor, double(i), double(size));
    write(text);
    text.clear();
  }
  write(text);
  watch(monitor, double(size), double(size));
}

void encode_binary(const std::vector<file_column>& columns, index_t size, bool swap,
                   const task_monitor& monitor,
                   const std::function<void(std::string_view)>& write) {
  const std::size_t record = record_size(columns);
  const auto at_a_time = static_cast<index_t>(std::max<std::size_t>(1, piece / record));
  std::vector<char> bytes(
      record * static_cast<std::size_t>(std::min(at_a_time, std::max<index_t>(size, 1))));
  for (index_t first = 0; first < size; first += at_a_time) {
    watch(monitor, double(first), double(size));
    const index_t n = std::min(at_a_time, size - first);
    encode_records(columns, first, n, record, swap, bytes.data());
    write({bytes.data(), record * static_cast<std::size_t>(n)});
  }
  watch(monitor, double(size), double(size));
}

template std::vector<file_column> columns_of(const point_cloud<float, 2>&, const column_style&);
template std::vector<file_column> columns_of(const point_cloud<float, 3>&, const column_style&);
template std::vector<file_column> columns_of(const point_cloud<double, 2>&, const column_style&);
template std::vector<file_column> columns_of(const point_cloud<double, 3>&, const column_style&);

}  // namespace cilantro
