// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
#include "io/ply/ply_header.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_columns;
import :file_scope;

namespace cilantro {
namespace {

std::vector<file_column> ply_columns(const auto& cloud, bool float_colors) {
  using color_form = enum column_style::colors;
  auto columns =
      columns_of(cloud, {.colors = float_colors ? color_form::floating : color_form::eight_bit});
  expect_writable_names(columns, "write_ply");
  for (const auto& c : columns)
    expects(
        c.type() != detail::number::int64 && c.type() != detail::number::uint64,
        "write_ply: PLY has no integers of 64 bits, as those of the attribute \"" + c.name + '"');
  return columns;
}

std::string header_of(const std::vector<file_column>& columns,
                      const std::vector<std::string>& comments, index_t size, index_t triangles,
                      ply_format format) {
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
  for (const file_column& c : columns)
    text += "property " + std::string{ply::number_names[static_cast<std::size_t>(c.type())].first} +
            ' ' + c.name + '\n';
  if (triangles > 0)
    text +=
        "element face " + std::to_string(triangles) + "\nproperty list uchar int vertex_indices\n";
  return text + "end_header\n";
}

/// Faces as PLY has them: how many corners, and which.
std::string faces_of(const Eigen::MatrixXi& triangles, ply_format format) {
  std::string bytes;
  for (const auto triangle : triangles.colwise()) {
    if (format == ply_format::ascii) {
      bytes += '3';
      for (const auto i : triangle) bytes += ' ' + std::to_string(i);
      bytes += '\n';
      continue;
    }
    bytes += '\3';
    for (const auto i : triangle) {
      const auto number = static_cast<std::uint32_t>(i);
      for (int b = 0; b < 4; ++b) {
        const int place = format == ply_format::binary_little_endian ? b : 3 - b;
        bytes += static_cast<char>(number >> (8 * place) & 0xff);
      }
    }
  }
  return bytes;
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_ply(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const ply_write_options& options) {
  expect_consistent(cloud, "write_ply");
  expects(options.triangles.cols() == 0 || options.triangles.rows() == 3,
          "write_ply: triangles must have three corners each");
  for (const auto i : options.triangles.reshaped())
    expects(0 <= i && i < cloud.size(), "write_ply: a triangle has a point that is not there");
  const auto columns = ply_columns(cloud, options.float_colors);
  auto comments = cloud.comments;
  if (cloud.has_origin()) comments.push_back(origin_comment<D>(cloud.origin));
  if (cloud.is_organized()) comments.push_back(size_comment(cloud.width, cloud.height));
  const auto header =
      header_of(columns, comments, cloud.size(), options.triangles.cols(), options.format);
  with_output(path, [&](detail::output_file& file) {
    const auto put = [&](std::string_view text) { file.write(text.data(), text.size()); };
    put(header);
    if (options.format == ply_format::ascii) {
      encode_text(columns, cloud.size(), ' ', options.monitor, put);
    } else {
      const bool swap = (options.format == ply_format::binary_big_endian) !=
                        (std::endian::native == std::endian::big);
      encode_binary(columns, cloud.size(), swap, options.monitor, put);
    }
    put(faces_of(options.triangles, options.format));
  });
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
