// SPDX-License-Identifier: MIT
module cilantro.tiles;

import :communicator;
import :index_file;
import :ranks;
import :work_folder;

namespace cilantro {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view pass_beginning = "pass-";

std::vector<fs::path> content_of(const fs::path& folder) {
  std::vector<fs::path> content;
  std::error_code error;
  for (fs::directory_iterator at{folder, error}, end; !error && at != end; at.increment(error))
    content.push_back(at->path());
  return content;
}

bool is_pass(const fs::path& path) {
  std::error_code error;
  return path.filename().string().starts_with(pass_beginning) && fs::is_directory(path, error);
}
bool is_leftover(const fs::path& path) {
  return is_pass(path) || path.extension() == part_ending || path.extension() == sets_ending;
}

/// Whether there is anything in an unfinished folder that a run would not make again.
bool has_tiles(const fs::path& folder) {
  for (const auto& path : content_of(folder)) {
    if (is_pass(path) ? has_tiles(path) : !is_leftover(path) && !is_notes(path)) return true;
  }
  return false;
}

/// What a process has left in a complete folder that was killed before it could clean up.
void finish_cleaning(const fs::path& folder) {
  bool is_clean = true;
  for (const auto& path : content_of(folder))
    is_clean = is_clean && !is_leftover(path) && !is_notes(path);
  if (is_clean) return;
  const folder_lock lock{folder};
  remove_leftovers(folder);
  remove_notes(folder);
}

}  // namespace

fs::path pass_folder(const fs::path& folder, std::size_t number) {
  return folder / (std::string{pass_beginning} + std::to_string(number));
}
fs::path points_folder(const fs::path& folder) {
  return folder / (std::string{pass_beginning} + "points");
}

std::unique_ptr<folder_lock> make_folder(const fs::path& folder, bool resume) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (std::error_code ignored; !fs::is_directory(folder, ignored))
    throw io_error{folder, "is no folder, and cannot be made one" +
                               (error ? ": " + error.message() : std::string{})};
  const auto is_full = [&] { return fs::exists(folder / index_name, error); };
  const auto refuse = [&](const std::string& why) {
    throw invalid_input{"write_tiles: \"" + folder.string() + "\" " + why};
  };
  const std::string complete =
      resume ? "is complete, but of other files, steps or options: remove it, or name another"
             : "has tiles already, and they are complete";
  if (is_full()) {
    finish_cleaning(folder);
    refuse(complete);
  }
  const fs::directory_iterator content{folder, error};
  if (error) throw io_error{folder, "cannot be read: " + error.message()};
  if (!has_notes(folder) && content != fs::directory_iterator{}) refuse("is not empty");
  auto lock = std::make_unique<folder_lock>(folder);
  if (is_full()) refuse(complete);  // Another process may just have let go of it.
  if (!has_tiles(folder)) {
    remove_leftovers(folder);
    empty_notes(folder);
  } else if (!resume) {
    refuse(
        "has tiles of a run that was interrupted: go on with {.resume = true}, or remove the "
        "folder");
  }
  return lock;
}

template <int D>
bool is_complete(const process_group* ranks, const fs::path& folder, const std::string& what) {
  bool is_so = false;
  on_first_rank(ranks, [&] {
    const auto index = read_index<D>(folder);
    is_so = index && index->made == what;
    if (is_so) finish_cleaning(folder);
  });
  return gather_texts(ranks, is_so ? "yes" : "").front() == "yes";
}

void remove_files(const fs::path& folder, std::string_view ending) {
  std::error_code ignored;
  for (const auto& path : content_of(folder))
    if (path.extension() == ending) fs::remove(path, ignored);
}

void remove_leftovers(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& path : content_of(folder))
    if (is_leftover(path)) fs::remove_all(path, ignored);
}

template bool is_complete<2>(const process_group*, const fs::path&, const std::string&);
template bool is_complete<3>(const process_group*, const fs::path&, const std::string&);

}  // namespace cilantro
