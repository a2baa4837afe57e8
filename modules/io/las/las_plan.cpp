// SPDX-License-Identifier: MIT
module;
#include "io/common/random_bytes.hpp"
#include "io/las/las_record.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_columns;
import :las_file;
import :las_plan;

namespace cilantro {
namespace {

using detail::number;
using las::field;

/// The greatest count of steps from the offset, with one to spare for rounding.
constexpr double most_steps = 2147483646;

/// The finest power of ten with which a coordinate so far from the offset fits.
double finest_scale(double reach) {
  constexpr double usual = 1e3, most = 1e12;
  double per_unit = usual;
  while (per_unit < most && reach * per_unit * 10 <= most_steps) per_unit *= 10;
  if (reach * per_unit <= most_steps) return 1 / per_unit;
  double scale = 0.01;
  while (reach / scale > most_steps) scale *= 10;
  return scale;
}

/// Calls `f(lowest, highest, is_fraction)` for what a column holds as numbers of double; NaN makes
/// both NaN.
std::pair<double, double> range_of(const file_column& column, index_t size) {
  return std::visit(
      [&](const auto* data) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (index_t i = 0; i < size; ++i) {
          const auto value = static_cast<double>(data[i * column.stride]);
          if (std::isnan(value)) return std::pair{value, value};
          low = std::min(low, value);
          high = std::max(high, value);
        }
        return std::pair{low, high};
      },
      column.data);
}

bool is_real(const file_column& column) {
  return detail::is_floating(column.type());
}

/// The least and the greatest number that a place holds.
std::pair<double, double> limits_of(const las_placed& placed) {
  if (placed.bits > 0) return {0, double((1u << placed.bits) - 1)};
  return detail::visit_number(placed.type, []<class T>(T) {
    return std::pair{double(std::numeric_limits<T>::lowest()),
                     double(std::numeric_limits<T>::max())};
  });
}

void expect_fits(const las_placed& placed, index_t size, int format) {
  if (size == 0 || (placed.bits == 0 && placed.from.type() == placed.type) ||
      detail::is_floating(placed.type))
    return;
  const auto [low, high] = range_of(placed.from, size);
  const auto [least, most] = limits_of(placed);
  const double first = std::round(low * placed.factor + placed.shift),
               last = std::round(high * placed.factor + placed.shift);
  const bool fits = std::min(first, last) >= least && std::max(first, last) <= most;
  expects(fits, "write_las: \"" + placed.from.name + "\" has values from " + in_digits(low) +
                    " to " + in_digits(high) + ", which point format " + std::to_string(format) +
                    " has no place for");
}

/// How the values of `column` get to the place of `f`.
las_placed placed_as(const file_column& column, const field& f, index_t size) {
  las_placed placed{.from = column, .at = f.at, .type = f.type, .bit = f.shift, .bits = f.bits};
  if (f.as == field::form::rank) placed.type = number::int8;
  if (f.as == field::form::angle) {
    placed.type = number::int16;
    placed.factor = 1 / las::angle_step;
  }
  // Intensities of other formats are fractions of what is most.
  if (f.name == "intensity" && is_real(column)) {
    const auto [low, high] = range_of(column, size);
    if (low >= 0 && high <= 1) placed.factor = 65535;
  }
  return placed;
}

void put_text(char* out, std::string_view text, std::size_t most) {
  std::memcpy(out, text.data(), std::min(text.size(), most));
}

/// The descriptor of a column in extra bytes: that of a file that it was read from, if it has one.
std::string descriptor_of(las_placed& placed, const std::vector<las::extra_field>& known) {
  for (const auto& e : known) {
    if (e.count != 1 || e.descriptor.empty() || attribute_name(e.name) != placed.from.name ||
        e.descriptor[2] == 0)
      continue;
    std::string descriptor = e.descriptor;
    // What was the least and the greatest is not that of this cloud.
    constexpr unsigned with_bounds = 2 | 4;
    descriptor[3] = static_cast<char>(static_cast<unsigned char>(descriptor[3]) & ~with_bounds);
    std::fill(descriptor.begin() + 64, descriptor.begin() + 112, '\0');
    placed.type = e.type;
    if (e.is_scaled && e.scale[0] != 0) {
      placed.factor = 1 / e.scale[0];
      placed.shift = -e.offset[0] / e.scale[0];
    }
    return descriptor;
  }
  // In the order of the types of attributes.
  constexpr std::array<char, 10> codes{2, 1, 4, 3, 6, 5, 9, 10, 8, 7};
  std::string descriptor(las::descriptor_size, '\0');
  placed.type = placed.from.type();
  descriptor[2] = codes[static_cast<std::size_t>(placed.type)];
  put_text(descriptor.data() + 4, placed.from.name, 32);
  return descriptor;
}

template <class U, class T>
U rounded(T value, double factor, double shift) {
  const double result = static_cast<double>(value) * factor + shift;
  if constexpr (std::floating_point<U>)
    return static_cast<U>(result);
  else
    return static_cast<U>(std::round(result));
}

}  // namespace

std::vector<file_column> take_coordinates(std::vector<file_column>& columns, int dimension) {
  std::vector<file_column> coordinates{columns.begin(), columns.begin() + dimension};
  columns.erase(columns.begin(), columns.begin() + dimension);
  const auto z = std::ranges::find(columns, "z", &file_column::name);
  if (dimension == 2 && z != columns.end()) {
    coordinates.push_back(*z);
    columns.erase(z);
  }
  return coordinates;
}

std::pair<double, double> world_bounds(const file_column& coordinate, index_t size) {
  auto bounds = range_of(coordinate, size);
  expects(size == 0 || (std::isfinite(bounds.first) && std::isfinite(bounds.second)),
          "write_las: not all points are finite, which LAS has no numbers for; see remove_invalid");
  if (size == 0) return {0, 0};
  return {bounds.first + coordinate.offset, bounds.second + coordinate.offset};
}

void place_coordinates(const std::vector<file_column>& coordinates, index_t size,
                       const las_write_options& options, const las_info* hint, las_plan& plan) {
  las_info& info = plan.info;
  const bool is_like = options.like.has_value();
  for (index_t d = 0; d < std::ssize(coordinates); ++d) {
    const auto [low, high] = world_bounds(coordinates[d], size);
    double& scale = info.scale[d];
    double& offset = info.offset[d];
    const auto fits = [&](double step, double from) {
      return std::abs((low - from) / step) <= most_steps &&
             std::abs((high - from) / step) <= most_steps;
    };
    const double middle = std::round(low / 2 + high / 2);
    // What the comments of the cloud tell is a wish, since the cloud may have moved.
    scale = options.scale ? (*options.scale)[d] : hint ? hint->scale[d] : 0;
    offset = options.offset ? (*options.offset)[d] : hint ? hint->offset[d] : middle;
    const auto may_change = [&] { return !is_like && !(scale != 0 && fits(scale, offset)); };
    if (!options.offset && may_change()) offset = middle;
    if (!options.scale && may_change())
      scale = finest_scale(std::max(std::abs(low - offset), std::abs(high - offset)));
    expects(std::isfinite(scale) && scale != 0 && std::isfinite(offset),
            "write_las: scale and offset must be finite, and the scale not 0");
    expects(fits(scale, offset), "write_las: coordinates from " + in_digits(low) + " to " +
                                     in_digits(high) + " cannot be counted in steps of " +
                                     in_digits(scale) + " from " + in_digits(offset));
    plan.columns.push_back({.from = coordinates[d],
                            .at = 4 * static_cast<std::size_t>(d),
                            .type = number::int32,
                            .factor = scale,
                            .shift = coordinates[d].offset - offset});
    const auto on_grid = [&](double v) {
      return std::round((v - offset) / scale) * scale + offset;
    };
    info.lower[d] = size > 0 ? on_grid(low) : 0;
    info.upper[d] = size > 0 ? on_grid(high) : 0;
  }
}

void place_columns(const std::vector<file_column>& columns, index_t size,
                   const las_write_options& options, las_plan& plan) {
  las_info& info = plan.info;
  const int format = info.point_format;
  const auto fields = las::fields_of(format);
  const std::vector<las::extra_field> known =
      options.like ? extra_fields(options.like->find_record(las_spec, extra_bytes_id), 65'535)
                   : std::vector<las::extra_field>{};
  std::size_t length = las::record_size(format);
  las_record extra{
      .user_id = std::string{las_spec}, .id = extra_bytes_id, .description = "extra bytes"};
  for (const auto& column : columns) {
    const std::array<std::string_view, 3> channels{"red", "green", "blue"};
    const auto channel = std::ranges::find(channels, column.name);
    const auto found = std::ranges::find(fields, column.name, &field::name);
    if (channel != channels.end() && las::has_colors(format)) {
      plan.columns.push_back(
          {.from = column,
           .at = las::colors_at(format) + 2 * static_cast<std::size_t>(channel - channels.begin()),
           .type = number::uint16,
           .factor = is_real(column) ? 65535.0 : 1.0});
    } else if (found != fields.end()) {
      plan.columns.push_back(placed_as(column, *found, size));
    } else {
      expects(column.name.size() <= 32,
              "write_las: the name \"" + column.name + "\" is longer than the 32 bytes for it");
      las_placed placed{.from = column, .at = length};
      const auto descriptor = descriptor_of(placed, known);
      for (const char c : descriptor) extra.data.push_back(static_cast<std::byte>(c));
      length += detail::size_of(placed.type);
      plan.columns.push_back(std::move(placed));
    }
    expect_fits(plan.columns.back(), size, format);
  }
  expects(length <= 65'535 && extra.data.size() <= 65'535,
          "write_las: there are more attributes than a point of LAS can have");
  info.record_length = static_cast<std::uint16_t>(length);
  if (!extra.data.empty()) info.records.push_back(std::move(extra));
}

void encode_las(const las_plan& plan, index_t first, index_t n, char* out) {
  const std::size_t length = plan.info.record_length;
  for (const las_placed& p : plan.columns) {
    char* begin = out + p.at;
    std::visit(
        [&]<class T>(const T* data) {
          const T* in = data + first * p.from.stride;
          const auto each = [&](auto convert) {
            char* place = begin;
            for (index_t i = 0; i < n; ++i, in += p.from.stride, place += length)
              detail::store_little(place, convert(*in));
          };
          // The steps of a coordinate are counted by division, which is exact where it can be.
          if (p.at < 12 && p.type == number::int32)
            return each([&](T v) {
              return static_cast<std::int32_t>(
                  std::round((static_cast<double>(v) + p.shift) / p.factor));
            });
          if (p.bits > 0) {
            char* place = begin;
            for (index_t i = 0; i < n; ++i, in += p.from.stride, place += length)
              *place = static_cast<char>(static_cast<unsigned char>(*place) |
                                         static_cast<unsigned>(rounded<std::uint8_t>(*in, 1, 0))
                                             << p.bit);
            return;
          }
          detail::visit_number(p.type, [&]<class U>(U) {
            if constexpr (std::same_as<T, U>)
              if (p.factor == 1 && p.shift == 0) return each([](T v) { return v; });
            each([&](T v) { return rounded<U>(v, p.factor, p.shift); });
          });
        },
        p.from.data);
  }
}

}  // namespace cilantro
