// SPDX-License-Identifier: MIT
module;
#include <lzf.h>
#include <cerrno>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
#include "io/pcd/pcd_header.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_columns;
import :file_scope;

namespace cilantro {
namespace {

constexpr bool swapped = std::endian::native == std::endian::big;

/// Columns that stand next to each other in the file under one name.
struct written_field {
  std::string name;
  std::size_t first = 0, count = 1;  ///< Of the columns.
};

/// f[0] to f[k − 1] of one type are one field f.
std::vector<written_field> fields_of(const std::vector<file_column>& columns) {
  std::vector<written_field> fields;
  for (std::size_t c = 0; c < columns.size();) {
    const std::string& name = columns[c].name;
    std::size_t count = 1;
    if (name.ends_with("[0]")) {
      const std::string stem = name.substr(0, name.size() - 3);
      while (c + count < columns.size() && columns[c + count].type() == columns[c].type() &&
             columns[c + count].name == stem + '[' + std::to_string(count) + ']')
        ++count;
      if (count > 1) fields.push_back({stem, c, count});
    }
    if (count == 1) fields.push_back({name, c, 1});
    c += count;
  }
  return fields;
}

std::string header_of(const std::vector<file_column>& columns,
                      const std::vector<written_field>& fields, const auto& cloud,
                      const std::vector<std::string>& comments, pcd_format format) {
  constexpr std::array types{"I", "U", "I", "U", "I", "U", "F", "F", "I", "U"};
  constexpr std::array formats{"ascii", "binary", "binary_compressed"};
  std::string text = "# .PCD v0.7 - Point Cloud Data file format\n", viewpoint = "0 0 0 1 0 0 0";
  for (const std::string& comment : comments) {
    if (comment.starts_with(pcd::viewpoint_keyword) &&
        comment.find_first_of("\r\n") == comment.npos) {
      viewpoint = comment.substr(pcd::viewpoint_keyword.size());
      continue;
    }
    // A comment of several lines would end its line, and with luck the header.
    std::string_view rest = comment;
    for (bool more = true; more;) {
      const auto end = rest.find_first_of("\r\n");
      text += "# " + std::string{rest.substr(0, end)} + '\n';
      more = end != rest.npos;
      if (more) rest.remove_prefix(end + 1);
    }
  }
  std::string names = "FIELDS", sizes = "SIZE", kinds = "TYPE", counts = "COUNT";
  for (const auto& f : fields) {
    const auto type = columns[f.first].type();
    names += ' ' + f.name;
    sizes += ' ' + std::to_string(detail::size_of(type));
    kinds += std::string{" "} + types[static_cast<std::size_t>(type)];
    counts += ' ' + std::to_string(f.count);
  }
  const bool organized = cloud.is_organized() && cloud.height > 1;
  text += "VERSION 0.7\n" + names + '\n' + sizes + '\n' + kinds + '\n' + counts + '\n';
  text += "WIDTH " + std::to_string(organized ? index_t{cloud.width} : cloud.size()) + '\n';
  text += "HEIGHT " + std::to_string(organized ? cloud.height : 1) + '\n';
  text += "VIEWPOINT " + viewpoint + '\n';
  text += "POINTS " + std::to_string(cloud.size()) + '\n';
  return text + "DATA " + formats[static_cast<std::size_t>(format)] + '\n';
}

/// All columns one after another, those of one field point by point, compressed.
std::vector<char> compress(const std::vector<file_column>& columns,
                           const std::vector<written_field>& fields, index_t size,
                           const task_monitor& monitor) {
  if (size == 0) return std::vector<char>(8);
  const std::size_t bytes = record_size(columns) * static_cast<std::size_t>(size);
  std::vector<char> plain(bytes);
  char* out = plain.data();
  for (const auto& f : fields) {
    const std::size_t each = detail::size_of(columns[f.first].type());
    for (std::size_t k = 0; k < f.count; ++k)
      encode_column(columns[f.first + k], 0, size, f.count * each, swapped, out + k * each);
    out += f.count * each * static_cast<std::size_t>(size);
  }
  watch(monitor, 1, 3);
  // What cannot be compressed grows by a byte in 32.
  std::vector<char> packed(8 + bytes + bytes / 16 + 64);
  const auto length = lzf_compress(plain.data(), static_cast<unsigned>(bytes), packed.data() + 8,
                                   static_cast<unsigned>(packed.size() - 8));
  expects(length > 0, "write_pcd: the data could not be compressed");
  packed.resize(8 + length);
  std::uint32_t sizes[] = {length, static_cast<std::uint32_t>(bytes)};
  for (auto& s : sizes)
    if (swapped) s = detail::swap_bytes(s);
  std::memcpy(packed.data(), sizes, sizeof sizes);
  return packed;
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_pcd(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const pcd_write_options& options) {
  expect_consistent(cloud, "write_pcd");
  const auto columns =
      columns_of(cloud, {.normal_prefix = "normal_", .colors = column_style::colors::packed});
  expect_writable_names(columns, "write_pcd");
  const auto fields = fields_of(columns);
  for (const auto& f : fields)
    expects(f.name != "_", "write_pcd: an attribute named \"_\" would be taken for padding");
  constexpr std::uint64_t most_compressed = 0xe0000000u;
  expects(options.format != pcd_format::binary_compressed ||
              record_size(columns) * static_cast<std::uint64_t>(cloud.size()) <= most_compressed,
          "write_pcd: binary_compressed holds at most 3.5 GiB; choose binary");
  auto comments = cloud.comments;
  if (cloud.has_origin()) comments.push_back(origin_comment<D>(cloud.origin));
  const auto header = header_of(columns, fields, cloud, comments, options.format);
  with_output(path, [&](detail::output_file& file) {
    const auto put = [&](std::string_view text) { file.write(text.data(), text.size()); };
    put(header);
    switch (options.format) {
      case pcd_format::ascii:
        return encode_text(columns, cloud.size(), ' ', options.monitor, put);
      case pcd_format::binary:
        return encode_binary(columns, cloud.size(), swapped, options.monitor, put);
      case pcd_format::binary_compressed: {
        const auto packed = compress(columns, fields, cloud.size(), options.monitor);
        watch(options.monitor, 2, 3);
        put({packed.data(), packed.size()});
        watch(options.monitor, 1, 1);
      }
    }
  });
}

template void write_pcd(const point_cloud<float, 2>&, const std::filesystem::path&,
                        const pcd_write_options&);
template void write_pcd(const point_cloud<float, 3>&, const std::filesystem::path&,
                        const pcd_write_options&);
template void write_pcd(const point_cloud<double, 2>&, const std::filesystem::path&,
                        const pcd_write_options&);
template void write_pcd(const point_cloud<double, 3>&, const std::filesystem::path&,
                        const pcd_write_options&);

}  // namespace cilantro
