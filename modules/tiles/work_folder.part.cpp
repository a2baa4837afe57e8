// SPDX-License-Identifier: MIT
//
// A folder that tiles are written to, and what lies in it meanwhile. Internal.
module cilantro.tiles:work_folder;

import cilantro.standard;
import :communicator;
import :index_file;

namespace cilantro {

/// Files that are not complete, and sets of points that have no numbers yet.
constexpr std::string_view part_ending = ".part", sets_ending = ".sets";
/// Where points are put aside before a last pass, and before they are clustered.
std::filesystem::path pass_folder(const std::filesystem::path& folder, std::size_t number);
std::filesystem::path points_folder(const std::filesystem::path& folder);

/// Makes the folder, or finds it as it must be, and keeps others from it. What is left of a run
/// that has not finished a single tile is removed. Throws `invalid_input` for a folder that is not
/// empty, unless it is unfinished and resumed.
std::unique_ptr<folder_lock> make_folder(const std::filesystem::path& folder, bool resume);
/// Whether a folder is complete, and was made so; the same for all ranks. What a process has left
/// there that was killed after the last tile is removed.
template <int D>
bool is_complete(const process_group* ranks, const std::filesystem::path& folder,
                 const std::string& what);
/// Removes the files of one ending, that of files which are needed on the way.
void remove_files(const std::filesystem::path& folder, std::string_view ending);
/// Removes all that is needed on the way, but for the notes.
void remove_leftovers(const std::filesystem::path& folder);

}  // namespace cilantro
