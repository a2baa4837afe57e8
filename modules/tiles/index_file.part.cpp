// SPDX-License-Identifier: MIT
//
// What lies beside tiles in a folder: an index once all are there, and notes until then. Internal.
module cilantro.tiles:index_file;

import cilantro.standard;
import cilantro.core;
import :survey;

namespace cilantro {

constexpr std::string_view index_name = "tiles.index", notes_name = "tiles.unfinished";

/// What an index says beside its files.
template <int D>
struct tile_index {
  std::string made;  ///< Of what, and how: the first line of the notes while it was written.
  bool is_local = false;
  std::string scalar;  ///< `float` or `double`: with other numbers, points may change squares.
  double edge = 0;
  point_vector<double, D> origin = point_vector<double, D>::Zero();
  std::vector<survey_file<D>> files;  ///< Their paths begin with the folder.
};

/// The index of a folder, or nothing if it has none. Throws `io_error` for one that is malformed.
template <int D>
std::optional<tile_index<D>> read_index(const std::filesystem::path& folder);
template <int D>
void write_index(const std::filesystem::path& folder, const tile_index<D>& index);

/// What is known of tiles while not all of them are written: lines that are only appended, by each
/// rank to a file of its own.
template <int D>
class tile_notes {
 public:
  /// Begins, or goes on with what is there.
  tile_notes(const std::filesystem::path& folder, const std::string& what, int rank);
  tile_notes(const tile_notes&) = delete;
  tile_notes& operator=(const tile_notes&) = delete;
  ~tile_notes();

  /// Notes that a tile is complete. May be called by several threads at once.
  void add(const survey_file<D>& tile);

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

/// While it lives, no other process may write into a folder: two that resume the same run would
/// overwrite what each has put aside.
class folder_lock {
 public:
  /// Throws `invalid_input` if another one lives.
  explicit folder_lock(const std::filesystem::path& folder);
  folder_lock(const folder_lock&) = delete;
  folder_lock& operator=(const folder_lock&) = delete;
  ~folder_lock();

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

/// The tiles that all ranks of a run that was interrupted have noted. Throws `invalid_input` if the
/// first line of what is there is not `what`.
template <int D>
std::vector<survey_file<D>> read_notes(const std::filesystem::path& folder,
                                       const std::string& what);
void remove_notes(const std::filesystem::path& folder);
/// Makes the notes those of a run that has not begun, under a lock.
void empty_notes(const std::filesystem::path& folder);
[[nodiscard]] bool is_notes(const std::filesystem::path& path);
[[nodiscard]] bool has_notes(const std::filesystem::path& folder);

/// Tiles as text, and back.
template <int D>
std::string text_of(const survey_file<D>& file);
template <int D>
std::vector<survey_file<D>> files_of_text(std::string_view text,
                                          const std::filesystem::path& folder);

}  // namespace cilantro
