// SPDX-License-Identifier: MIT
export module cilantro.io:text;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

export struct text_read_options {
  /// What the columns are, such as {"x", "y", "z", "intensity", "r", "g", "b"}; "_" is skipped. If
  /// empty, what the file says or else what is usual.
  std::vector<std::string> columns = {};
  origin_policy origin = origin_policy::automatic;
  /// Whether commas are decimal, where it cannot be told; otherwise see `read_text`.
  std::optional<bool> decimal_commas = {};
  task_monitor monitor = {};
};

export struct text_write_options {
  char separator = ' ';
  /// Whether a first line names the columns: as a comment if the separator is white space.
  bool names = true;
  task_monitor monitor = {};
};

/// Reads lines of numbers: XYZ, PTS, ASC, CSV and their like, one point a line.
///
/// White space, commas and semicolons separate. Commas are decimal in a file whose first point with
/// commas has semicolons, too, or only numbers such as `1,5` between white space; where only some
/// are such, and nothing says how many columns there are, it may be either and is an error, unless
/// the options say which. Blank lines and lines
/// that begin with # or // are passed over, the latter kept as comments. A first line of one whole
/// number is the count of a PTS file, which may be followed by the counts and points of further
/// scans. Columns are named by a first line of words, quoted or not, or the last comment of as many
/// words as there are columns, if x, y (and z) are among them; otherwise what comes after the
/// coordinates is taken for
///
/// - 1 more: intensity; 3 more: colours if they are whole numbers from 0 to 255 or the file has a
///   count, else normals;
/// - 4 more: intensity and colours, or colours and alpha if those three are whole numbers from 0 to
///   255 and the file has no count; 6 more: colours and normals, in either order;
/// - anything else: attributes named column_4 and so on.
///
/// Colours of whole numbers from 0 to 255 are read as such, those of only 0 and 1 if the columns
/// are spelled out as red, green and blue; others are numbers in [0, 1], or if one of them is above
/// 1, from 0 to 255 (beyond, to 65535). Attributes are of double. Memory beside the result: up to
/// 16 bytes a number. Throws `io_error` with path and line for a line with another number of values
/// than the first, a word that is no number (but in a column that is skipped), or fewer points than
/// the count says (what comes after so many is not read, and a comment says so); `invalid_input` if
/// columns are named and x, y (and z) are not among them.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_text(const std::filesystem::path& path,
                                          const text_read_options& options = {});

/// As above, from memory; errors call it `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_text(std::span<const std::byte> bytes,
                                          const std::filesystem::path& name = "memory",
                                          const text_read_options& options = {});

/// Writes points, normals, colours from 0 to 255, and attributes as lines of numbers, with as many
/// digits as reading them back exactly needs. Comments are kept if the separator is white space.
///
/// The file appears under its name when it is complete, as with `write_ply`. Throws `io_error`; and
/// `invalid_input` for mismatched sizes, for names that could not be told apart, and for a
/// separator that is none of space, tab, comma and semicolon.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_text(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
                const text_write_options& options = {});

/// Writes the count, and points, intensity and colours in the order of PTS files.
/// Throws as above, and `invalid_input` for a cloud with normals or other attributes, for which
/// these files have no place.
export template <Scalar S>
void write_pts(const point_cloud<S, 3>& cloud, const std::filesystem::path& path,
               const task_monitor& monitor = {});

struct write_text_tap {
  std::filesystem::path path;
  text_write_options options;

  static constexpr const char* name = "write_text";
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_text(cloud, path, options);
  }
};
/// Writes the cloud to `path` and hands it on.
export [[nodiscard]] inline auto write_text(std::filesystem::path path,
                                            text_write_options options = {}) {
  return tap_step{write_text_tap{std::move(path), std::move(options)}};
}

}  // namespace cilantro
