// SPDX-License-Identifier: MIT
export module cilantro.io:ply;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

/// How the data of a PLY file is stored: `ascii`, `binary_little_endian` or `binary_big_endian`.
export enum class ply_format { ascii, binary_little_endian, binary_big_endian };

/// Options of `write_ply`. `format` says how the data is stored.
export struct ply_write_options {
  ply_format format = ply_format::binary_little_endian;
  /// Whether colours are written as float; otherwise, they are rounded to 8 bits.
  bool float_colors = false;
  /// Triangles to write as faces, one per column: by the indices of three points of the cloud.
  Eigen::MatrixXi triangles = {};
  task_monitor monitor = {};
};

/// Reads the vertices of a PLY file in any of the three formats.
///
/// x, y (and z if D is 3) become the points, nx, ny (nz) the normals, and red, green, blue, as 8
/// bits or as floats, the colours; normals and colours only if all their properties are present.
/// Every other scalar property of a vertex becomes an attribute of its own type; list properties
/// and other elements (faces) are skipped. Comments are kept. Coordinates that S would round are
/// treated as `origin_policy` says. Reading does not depend on the locale; non-finite numbers are
/// kept.
///
/// Throws `io_error` with path, and line or byte, for a file that is not regular, malformed or
/// truncated. Memory is bounded by the size of the file, whatever its header claims. Anything after
/// the vertices is ignored.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_ply(const std::filesystem::path& path,
                                         const read_options& options = {});

/// As above, from memory; errors refer to it as `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_ply(std::span<const std::byte> bytes,
                                         const std::filesystem::path& name = "memory",
                                         const read_options& options = {});

/// Writes a cloud with its normals, colours, attributes and comments. Points and normals are
/// written in their own scalar, but points in double if the cloud has an origin. Text has enough
/// digits to be read back exactly.
///
/// The file appears under its name when it is complete, and then replaces an existing file; until
/// then, and if anything fails, the existing file stays as it was. (A pipe, a device or anything
/// else that is not a regular file is written to directly.) Throws `io_error`; and `invalid_input`
/// for mismatched sizes, for attributes whose names would be ambiguous or contain white space, for
/// attributes of 64-bit integers, and for triangles of other than three points, or of points that
/// the cloud does not have.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_ply(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const ply_write_options& options = {});

struct write_ply_tap {
  std::filesystem::path path;
  ply_write_options options;

  static constexpr const char* name = "write_ply";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_ply(cloud, path, options);
  }
};
/// The step that writes the cloud to `path` and passes it on unchanged.
export [[nodiscard]] auto write_ply(std::filesystem::path path, ply_write_options options = {}) {
  return tap_step{write_ply_tap{std::move(path), std::move(options)}};
}

}  // namespace cilantro
