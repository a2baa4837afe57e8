// SPDX-License-Identifier: MIT
export module cilantro.io:pcd;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

export enum class pcd_format { ascii, binary, binary_compressed };

export struct pcd_write_options {
  pcd_format format = pcd_format::binary;
  task_monitor monitor = {};
};

/// Reads a PCD file of version 0.5 to 0.7 in any of its formats.
///
/// x, y (and z if D is 3) become the points, normal_x, normal_y (normal_z) or nx, ny (nz) the
/// normals, and rgb or rgba, or red, green and blue of 8 bits, the colours; rgba leaves an
/// attribute "alpha". Every other field becomes an attribute of its own type; one with several
/// values a point becomes that many, named f[0], f[1] and so on; fields named _ are padding. A
/// cloud with a height above 1 is organised. Comments are kept, and a viewpoint that is not the
/// default as the comment "VIEWPOINT …". Coordinates that S would round are treated as
/// `origin_policy` says. Lines of text may separate values with commas, as some exporters do.
///
/// Throws `io_error` with path, and line or byte, for what is not a regular file, or is malformed
/// or truncated. Memory is bounded by the size of the file, times what LZF can compress, which are
/// unpacked at once; what follows the data is not looked at.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_pcd(const std::filesystem::path& path,
                                         const read_options& options = {});

/// As above, from memory; errors call it `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_pcd(std::span<const std::byte> bytes,
                                         const std::filesystem::path& name = "memory",
                                         const read_options& options = {});

/// Writes a cloud with its normals, colours (as rgb, with 8 bits each), attributes, comments, width
/// and height; points and normals in their own scalar, points in double where the cloud has an
/// origin. Attributes named f[0] to f[k − 1] in this order become one field. Text has as many
/// digits as reading it back exactly needs.
///
/// The file appears under its name when it is complete, as with `write_ply`. Throws `io_error`; and
/// `invalid_input` for mismatched sizes, for names that PCD cannot hold or tell apart, and for more
/// than 3.5 GiB to be compressed.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_pcd(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const pcd_write_options& options = {});

struct write_pcd_tap {
  std::filesystem::path path;
  pcd_write_options options;

  static constexpr const char* name = "write_pcd";
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_pcd(cloud, path, options);
  }
};
/// Writes the cloud to `path` and hands it on.
export [[nodiscard]] inline auto write_pcd(std::filesystem::path path,
                                           pcd_write_options options = {}) {
  return tap_step{write_pcd_tap{std::move(path), std::move(options)}};
}

}  // namespace cilantro
