// SPDX-License-Identifier: MIT
export module cilantro.io:pcd;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

/// How the data of a PCD file is stored: `ascii`, `binary` or `binary_compressed`.
export enum class pcd_format { ascii, binary, binary_compressed };

/// Options of `write_pcd`. `format` says how the data is stored.
export struct pcd_write_options {
  pcd_format format = pcd_format::binary;
  task_monitor monitor = {};
};

/// Reads a PCD file of version 0.5 to 0.7 in any of its formats.
///
/// x, y (and z if D is 3) become the points, normal_x, normal_y (normal_z) or nx, ny (nz) the
/// normals, and rgb or rgba, or red, green and blue of 8 bits, the colours; from rgba comes also an
/// attribute "alpha". Every other field becomes an attribute of its own type; a field f with
/// several values per point becomes several attributes, named f[0], f[1] and so on; fields named _
/// are padding, and skipped. A cloud with a height above 1 is organised. Comments are kept; a
/// viewpoint other than the default becomes the comment "VIEWPOINT …". Coordinates that S would
/// round are treated as `origin_policy` says. In text, values may also be separated by commas, as
/// some exporters do.
///
/// Throws `io_error` with path, and line or byte, for a file that is not regular, malformed or
/// truncated. Memory is bounded by the size of the file, times the largest ratio of LZF
/// compression, since compressed data is unpacked at once. Anything after the data is ignored.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_pcd(const std::filesystem::path& path,
                                         const read_options& options = {});

/// As above, from memory; errors refer to it as `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_pcd(std::span<const std::byte> bytes,
                                         const std::filesystem::path& name = "memory",
                                         const read_options& options = {});

/// Writes a cloud with its normals, colours (as rgb, with 8 bits each), attributes, comments, width
/// and height. Points and normals are written in their own scalar, but points in double if the
/// cloud has an origin. Attributes named f[0] to f[k − 1], in this order, become one field f. Text
/// has enough digits to be read back exactly.
///
/// The file appears under its name when it is complete, as with `write_ply`. Throws `io_error`; and
/// `invalid_input` for mismatched sizes, for attribute names that PCD cannot store or that would be
/// ambiguous, and for more than 3.5 GiB of data to compress.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_pcd(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const pcd_write_options& options = {});

struct write_pcd_tap {
  std::filesystem::path path;
  pcd_write_options options;

  static constexpr const char* name = "write_pcd";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_pcd(cloud, path, options);
  }
};
/// The step that writes the cloud to `path` and passes it on unchanged.
export [[nodiscard]] auto write_pcd(std::filesystem::path path, pcd_write_options options = {}) {
  return tap_step{write_pcd_tap{std::move(path), std::move(options)}};
}

}  // namespace cilantro
