// SPDX-License-Identifier: MIT
export module cilantro.io:text;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

/// Options of `read_text`.
export struct text_read_options {
  /// The names of the columns, such as {"x", "y", "z", "intensity", "r", "g", "b"}; a column "_" is
  /// skipped. If empty, they are taken from the file, or guessed: see `read_text`.
  std::vector<std::string> columns = {};
  origin_policy origin = origin_policy::automatic;  ///< Whether large coordinates get an origin.
  /// Whether commas are decimal commas, for files where this is ambiguous; see `read_text`.
  std::optional<bool> decimal_commas = {};
  int threads = 0;  ///< How many read the numbers: see `execution`.
  task_monitor monitor = {};
};

/// Options of `write_text`.
export struct text_write_options {
  char separator = ' ';  ///< Space, tab, comma or semicolon.
  /// Whether the first line names the columns; it is a comment if the separator is white space.
  bool names = true;
  task_monitor monitor = {};
};

/// Reads lines of numbers, one point per line: XYZ, PTS, ASC, CSV and similar files.
///
/// Values are separated by white space, commas or semicolons. Commas are decimal commas if the
/// first point with commas has semicolons, too, or has only numbers such as `1,5` between white
/// space. If only some of its numbers are like that, and nothing tells how many columns there are,
/// the file is ambiguous: an error, unless `decimal_commas` decides. Blank lines are skipped, and
/// lines that begin with # or // are kept as comments. A first line with a single whole number is
/// the count of a PTS file, whose points may be followed by the counts and points of further scans.
/// Columns are named by a first line of words, quoted or not, or by the last comment that has as
/// many words as there are columns, if x, y (and z) are among the words. Otherwise, the columns
/// after the coordinates are taken to be
///
/// - if there is 1: intensity; 3: colours if they are whole numbers from 0 to 255 or the file has a
///   count, else normals;
/// - 4: intensity and colours, or colours and alpha if those three are whole numbers from 0 to 255
///   and the file has no count; 6: colours and normals, in either order;
/// - any other number: attributes named column_4 and so on.
///
/// Colours that are whole numbers from 0 to 255 are read as such; if all of them are 0 or 1, only
/// if the columns are named red, green and blue. Other colours are numbers in [0, 1], or, if one of
/// them is above 1, from 0 to 255 (if one is above 255, to 65535). Attributes hold doubles. Memory
/// beside the result: 8 bytes per number. Throws `io_error` with path and line for a line
/// with another number of values than the first, a word that is not a number (except in a skipped
/// column), or fewer points than the count says (points beyond the count are not read, which a
/// comment then notes); throws `invalid_input` if `columns` does not contain x, y (and z).
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_text(const std::filesystem::path& path,
                                          const text_read_options& options = {});

/// As above, from memory; errors refer to it as `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_text(std::span<const std::byte> bytes,
                                          const std::filesystem::path& name = "memory",
                                          const text_read_options& options = {});

/// Writes points, normals, colours from 0 to 255, and attributes as lines of numbers, with enough
/// digits to be read back exactly. Comments are written if the separator is white space.
///
/// The file appears under its name when it is complete, as with `write_ply`. Throws `io_error`; and
/// `invalid_input` for mismatched sizes, for attribute names that would be ambiguous, and for a
/// separator other than space, tab, comma and semicolon.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_text(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
                const text_write_options& options = {});

/// Writes a PTS file: the count, then points, intensity and colours. Throws as above, and
/// `invalid_input` for a cloud with normals or other attributes, which PTS files cannot hold.
export template <Scalar S>
void write_pts(const point_cloud<S, 3>& cloud, const std::filesystem::path& path,
               const task_monitor& monitor = {});

struct write_text_tap {
  std::filesystem::path path;
  text_write_options options;

  static constexpr const char* name = "write_text";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_text(cloud, path, options);
  }
};
/// The step that writes the cloud to `path` and passes it on unchanged.
export [[nodiscard]] auto write_text(std::filesystem::path path, text_write_options options = {}) {
  return tap_step{write_text_tap{std::move(path), std::move(options)}};
}

}  // namespace cilantro
