// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "cloud/color.hpp"
#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
module cilantro.io;

import :cloud_builder;
import :file_scope;

namespace cilantro {
namespace {

using detail::byte_stream;
using detail::number;
using detail::word_reader;

/// The numbers before the points of a scan.
struct scan_header {
  index_t columns = 0, rows = 0;
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
};

/// A line of a point. Colours are −1 in a scan that has none.
struct ptx_point {
  Eigen::Vector3d place;
  double intensity = 0;
  std::array<std::int16_t, 3> color{-1, -1, -1};

  [[nodiscard]] bool is_missing() const { return place.isZero(0); }
};

class ptx_parser {
 public:
  ptx_parser(byte_stream& in, const task_monitor& monitor) : in_{in}, monitor_{monitor} {
    in_.skip_byte_order_mark();
  }

  /// The next scan; nothing at the end of the file.
  std::optional<scan_header> next_scan() {
    std::optional<std::string_view> line;
    do line = in_.take_line();
    while (line && word_reader{*line}.done());
    if (!line) return std::nullopt;
    scan_header header;
    header.columns = count_in(*line, "columns");
    header.rows = count_in(next_line(), "rows");
    // Where the scanner stands and how it is turned is in the transform, too.
    for (int i = 0; i < 4; ++i) (void)numbers_in<3>(next_line());
    for (index_t i = 0; i < 4; ++i) {
      const auto row = numbers_in<4>(next_line());
      // The points are rows, which the transform multiplies from the right.
      for (index_t d = 0; d < 3; ++d) header.pose.matrix()(d, i) = row[static_cast<std::size_t>(d)];
      if (row[3] != (i == 3 ? 1 : 0))
        in_.fail_at_line("the last column of the transform is not 0 0 0 1");
    }
    if (!header.pose.matrix().allFinite())
      in_.fail_at_line("the transform has numbers that are not finite");
    // A line has four numbers, each followed by something.
    constexpr std::uint64_t shortest = 8;
    const auto count = static_cast<std::uint64_t>(header.columns * header.rows);
    if (count > (in_.remaining() + 1) / shortest)
      in_.fail_at_line("the scan promises " + std::to_string(count) +
                       " points, for which the file is too short");
    return header;
  }

  ptx_point next_point() {
    if (++points_ % 4096 == 0) watch(monitor_, double(in_.position()), double(in_.size()));
    word_reader words{next_line()};
    ptx_point point;
    for (double& v : point.place) v = real(words.next());
    point.intensity = real(words.next());
    if (words.done()) return point;
    for (auto& c : point.color) {
      const auto word = words.next();
      if (!detail::parse_number(word, c) || c < 0 || c > 255)
        in_.fail_at_line(quoted(word) + " is no colour from 0 to 255");
    }
    if (!words.done()) in_.fail_at_line("a point has more than seven numbers");
    return point;
  }

 private:
  static std::string quoted(std::string_view word) {
    return '"' + std::string{word.substr(0, 40)} + '"';
  }

  std::string_view next_line() {
    const auto line = in_.take_line();
    if (!line) in_.fail_at_line("the file ends in the middle of a scan");
    return *line;
  }

  index_t count_in(std::string_view line, const char* what) {
    word_reader words{line};
    std::int32_t count = 0;
    const auto word = words.next();
    if (!detail::parse_number(word, count) || count < 0 || !words.done())
      in_.fail_at_line(quoted(line) + " is no number of " + what);
    return count;
  }

  double real(std::string_view word) {
    double value = 0;
    if (!detail::parse_number(word, value))
      in_.fail_at_line(word.empty() ? std::string{"there are too few numbers"}
                                    : quoted(word) + " is no number");
    return value;
  }

  template <std::size_t n>
  std::array<double, n> numbers_in(std::string_view line) {
    word_reader words{line};
    std::array<double, n> values;
    for (double& v : values) v = real(words.next());
    if (!words.done()) in_.fail_at_line("there are more than " + std::to_string(n) + " numbers");
    return values;
  }

  byte_stream& in_;
  const task_monitor& monitor_;
  std::uint64_t points_ = 0;
};

/// Columns of the points of all scans.
struct ptx_columns {
  std::array<std::vector<double>, 3> place;
  std::vector<double> intensity;
  std::array<std::vector<std::uint8_t>, 3> color;
  std::vector<std::int32_t> scan;
  bool has_color = false;

  void add(const Eigen::Vector3d& at, const ptx_point& point, std::int32_t index) {
    for (std::size_t d = 0; d < 3; ++d) {
      place[d].push_back(at[static_cast<index_t>(d)]);
      has_color = has_color || point.color[d] >= 0;
      color[d].push_back(static_cast<std::uint8_t>(std::max<std::int16_t>(point.color[d], 0)));
    }
    intensity.push_back(point.intensity);
    scan.push_back(index);
  }
};

template <Scalar S, int D>
point_cloud<S, D> read_stream(byte_stream& in, const read_options& options) {
  ptx_parser parser{in, options.monitor};
  ptx_columns all;
  std::int32_t scans = 0;
  while (const auto header = parser.next_scan()) {
    for (index_t i = 0; i < header->columns * header->rows; ++i) {
      const auto point = parser.next_point();
      if (!point.is_missing()) all.add(header->pose * point.place, point, scans);
    }
    ++scans;
  }
  if (scans == 0) in.fail_at_line("the file has no scan");
  if (all.scan.size() > std::size_t{std::numeric_limits<std::int32_t>::max()})
    in.fail_at_line("there are more than 2^31 - 1 points");

  std::vector<file_field> fields;
  for (const char* name : {"x", "y", "z", "intensity"}) fields.push_back({name, number::float64});
  for (const char* name : {"red", "green", "blue"})
    fields.push_back({name, number::uint8, !all.has_color});
  fields.push_back({"scan", number::int32, scans == 1});
  cloud_builder<S, D> builder{fields, options.origin};
  const auto n = static_cast<index_t>(all.scan.size());
  builder.resize(n);
  std::size_t f = 0;
  const auto store = [&](auto& values) {
    builder.store_column(f++, 0, n, reinterpret_cast<const char*>(values.data()), sizeof(values[0]),
                         false);
    values = {};
  };
  for (auto& values : all.place) store(values);
  store(all.intensity);
  for (auto& values : all.color) store(values);
  store(all.scan);
  watch(options.monitor, 1, 1);
  return builder.finish({});
}

/// A scan as a picture, whose rows are those of the cloud: the file has column after column.
template <Scalar S>
posed_scan<S> read_scan(ptx_parser& parser, const scan_header& header) {
  const index_t n = header.columns * header.rows;
  posed_scan<S> scan{.pose = header.pose};
  auto& cloud = scan.cloud;
  cloud.points.resize(3, n);
  cloud.colors.resize(3, n);
  std::vector<double> intensity(static_cast<std::size_t>(n));
  bool has_color = false;
  for (index_t column = 0; column < header.columns; ++column)
    for (index_t row = 0; row < header.rows; ++row) {
      const auto point = parser.next_point();
      const index_t i = row * header.columns + column;
      intensity[i] = point.intensity;
      if (point.is_missing())
        cloud.points.col(i).setConstant(std::numeric_limits<S>::quiet_NaN());
      else
        cloud.points.col(i) = point.place.cast<S>();
      for (index_t c = 0; c < 3; ++c) {
        const auto value = point.color[static_cast<std::size_t>(c)];
        has_color = has_color || value >= 0;
        cloud.colors(c, i) =
            detail::from_eight_bit(static_cast<std::uint8_t>(std::max<std::int16_t>(value, 0)));
      }
    }
  if (!has_color) cloud.colors.resize(3, 0);
  cloud.set_attribute("intensity", std::move(intensity));
  if (n > 0) {
    cloud.width = static_cast<int>(header.columns);
    cloud.height = static_cast<int>(header.rows);
  }
  return scan;
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_ptx(const std::filesystem::path& path, const read_options& options) {
  return with_stream(path, [&](byte_stream& in) { return read_stream<S, D>(in, options); });
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_ptx(std::span<const std::byte> bytes, const std::filesystem::path& name,
                           const read_options& options) {
  return with_stream(bytes, name, [&](byte_stream& in) { return read_stream<S, D>(in, options); });
}

template <Scalar S>
std::vector<posed_scan<S>> read_ptx_scans(const std::filesystem::path& path,
                                          const task_monitor& monitor) {
  return with_stream(path, [&](byte_stream& in) {
    ptx_parser parser{in, monitor};
    std::vector<posed_scan<S>> scans;
    while (const auto header = parser.next_scan()) scans.push_back(read_scan<S>(parser, *header));
    if (scans.empty()) in.fail_at_line("the file has no scan");
    watch(monitor, 1, 1);
    return scans;
  });
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template point_cloud<S, D> read_ptx<S, D>(const std::filesystem::path&, const read_options&); \
  template point_cloud<S, D> read_ptx<S, D>(std::span<const std::byte>,                         \
                                            const std::filesystem::path&, const read_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE
template std::vector<posed_scan<float>> read_ptx_scans(const std::filesystem::path&,
                                                       const task_monitor&);
template std::vector<posed_scan<double>> read_ptx_scans(const std::filesystem::path&,
                                                        const task_monitor&);

}  // namespace cilantro
