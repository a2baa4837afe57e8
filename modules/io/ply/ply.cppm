// SPDX-License-Identifier: MIT
export module cilantro.io:ply;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

export enum class ply_format { ascii, binary_little_endian, binary_big_endian };

export struct ply_write_options {
  ply_format format = ply_format::binary_little_endian;
  /// Colours as float instead of as 8 bits, to which they are rounded otherwise.
  bool float_colors = false;
  task_monitor monitor = {};
};

/// Reads the vertices of a PLY file in any of the three formats.
///
/// x, y (and z if D is 3) become the points, nx, ny (nz) the normals, and red, green, blue, as 8
/// bits or as floats, the colours, where they are all there. Every other scalar property of a
/// vertex becomes an attribute of its own type; list properties and other elements (faces) are
/// skipped. Comments are kept. Coordinates that S would round are treated as `origin_policy` says.
/// Numbers do not depend on the locale; non-finite ones are read as
/// such.
///
/// Throws `io_error` with path, and line or byte, for what is not a regular file, or is malformed
/// or truncated. Memory is bounded by the size of the file, whatever its header promises. Only what
/// comes before the end of the vertices is looked at.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_ply(const std::filesystem::path& path,
                                         const read_options& options = {});

/// As above, from memory; errors call it `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_ply(std::span<const std::byte> bytes,
                                         const std::filesystem::path& name = "memory",
                                         const read_options& options = {});

/// Writes a cloud with its normals, colours, attributes and comments, points and normals in their
/// own scalar, or in double where the cloud has an origin; as text, numbers have as many digits as
/// reading them back exactly needs.
///
/// The file appears under its name when it is complete, and replaces one that was there; until
/// then, and if anything fails, that one stays as it was. (What is not a regular file, such as a
/// pipe or a device, is written to directly.) Throws `io_error`; and `invalid_input` for mismatched
/// sizes, for attributes that PLY could not tell apart or of integers with 64 bits, and for names
/// with white space.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_ply(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const ply_write_options& options = {});

struct write_ply_tap {
  std::filesystem::path path;
  ply_write_options options;

  static constexpr const char* name = "write_ply";
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_ply(cloud, path, options);
  }
};
/// Writes the cloud to `path` and hands it on.
export [[nodiscard]] inline auto write_ply(std::filesystem::path path,
                                           ply_write_options options = {}) {
  return tap_step{write_ply_tap{std::move(path), std::move(options)}};
}

}  // namespace cilantro
