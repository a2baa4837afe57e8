// SPDX-License-Identifier: MIT
module;
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
module cilantro.tiles;

import :index_file;
import :survey;

namespace cilantro {
namespace {

using detail::word_reader;

constexpr std::string_view first_words = "cilantro tiles 1";

template <class T>
void put(std::string& line, T value) {
  std::array<char, 64> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  line += ' ';
  line.append(digits.data(), end);
}

/// `file`, counts, squares and runs, and the name, which may have blanks, at the end of the line.
template <int D>
std::string line_of(const survey_file<D>& file) {
  std::string line = "file";
  put(line, file.bytes);
  put(line, file.points);
  put(line, file.squares.size());
  for (const auto& [key, count] : file.squares) {
    put(line, key.x);
    put(line, key.y);
    put(line, count);
  }
  put(line, file.runs.size());
  for (const auto& run : file.runs) {
    put(line, run.count);
    for (int d = 0; d < D; ++d) {
      put(line, run.box.lower[d]);
      put(line, run.box.upper[d]);
    }
  }
  return line + " name " + file.path.filename().string() + '\n';
}

/// What a line says, or nothing if it is not complete or makes no sense.
template <int D>
std::optional<survey_file<D>> parse_line(std::string_view line,
                                         const std::filesystem::path& folder) {
  word_reader words{line};
  bool is_good = words.next() == "file";
  const auto number = [&]<class T>(T value) {
    is_good = is_good && detail::parse_number(words.next(), value);
    return value;
  };
  survey_file<D> file;
  file.bytes = number(std::uint64_t{});
  file.points = number(std::uint64_t{});
  std::uint64_t total = 0;
  for (auto n = number(std::uint64_t{}); is_good && n > 0; --n) {
    const tile_key key{number(std::int64_t{}), number(std::int64_t{})};
    file.squares[key] = number(std::uint64_t{});
  }
  for (auto n = number(std::uint64_t{}); is_good && n > 0; --n) {
    point_run<D> run;
    run.count = number(std::uint32_t{});
    total += run.count;
    for (int d = 0; d < D; ++d) {
      run.box.lower[d] = number(double{});
      run.box.upper[d] = number(double{});
    }
    if (is_good) file.runs.push_back(run);
  }
  if (!is_good || words.next() != "name" || total != file.points) return std::nullopt;
  const std::filesystem::path name{words.rest()};
  // Whoever wrote it may not name what lies elsewhere.
  if (name != name.filename()) return std::nullopt;
  file.path = name.empty() ? name : folder / name;
  return file;
}

/// Whether the squares of a file can be those of its boxes: who trusts squares of another edge
/// loses points.
template <int D>
bool has_squares_of(const survey_file<D>& file, double edge) {
  constexpr double too_far = 0x1p53;
  extent<D> all;
  for (const auto& run : file.runs) {
    const auto& [lower, upper] = run.box;
    for (int d = 0; d < D && !run.box.empty(); ++d)
      if (!std::isfinite(lower[d]) || !std::isfinite(upper[d]) || lower[d] > upper[d]) return false;
    all.add(run.box);
  }
  if (all.empty()) return file.squares.empty();
  for (int d = 0; d < 2; ++d)
    if (!(std::max(std::abs(all.lower[d]), std::abs(all.upper[d])) < too_far * edge)) return false;
  const auto first = key_of(all.lower, edge), last = key_of(all.upper, edge);
  std::uint64_t left = file.points;
  tile_key least = last, most = first;
  for (const auto& [key, count] : file.squares) {
    if (count > left) return false;
    left -= count;
    least = {std::min(least.x, key.x), std::min(least.y, key.y)};
    most = {std::max(most.x, key.x), std::max(most.y, key.y)};
  }
  return least == first && most == last;
}

template <class F>
auto with_errors(const std::filesystem::path& path, F f) {
  try {
    return f();
  } catch (const detail::failure& error) {
    throw io_error{path, error.what(), file_position{file_position::unit::line, error.at}};
  } catch (const std::system_error& error) {
    throw io_error{path, error.code().message()};
  }
}

template <int D>
tile_index<D> parse_index(detail::byte_stream& in, const std::filesystem::path& folder) {
  const auto line = [&] {
    const auto next = in.take_line();
    if (!next) in.fail_at_line("the index ends too early");
    return *next;
  };
  const auto words_after = [&](std::string_view keyword) {
    const auto next = line();
    word_reader words{next};
    if (words.next() != keyword)
      in.fail_at_line("\"" + std::string{keyword} + "\" was expected here");
    return words;
  };
  if (line() != first_words) in.fail_at_line("this is not an index of tiles of this version");
  tile_index<D> index;
  index.made = words_after("made").rest();
  int dimension = 0;
  if (auto words = words_after("dimension");
      !detail::parse_number(words.next(), dimension) || dimension != D)
    in.fail_at_line("the points do not have the dimension that is asked for");
  {
    auto words = words_after("scalar");
    index.scalar = words.next();
    index.is_local = words.next() == "local";
  }
  if (auto words = words_after("edge");
      !detail::parse_number(words.next(), index.edge) || !(index.edge > 0) || index.edge > 1e300)
    in.fail_at_line("the edge must be a positive number");
  auto origin = words_after("origin");
  for (double& coordinate : index.origin)
    if (!detail::parse_number(origin.next(), coordinate) || !std::isfinite(coordinate))
      in.fail_at_line("the origin must be finite");
  std::uint64_t count = 0;
  if (auto words = words_after("files"); !detail::parse_number(words.next(), count))
    in.fail_at_line("the number of files is missing");
  for (; count > 0; --count) {
    auto file = parse_line<D>(line(), folder);
    if (!file || file->path.empty() || !has_squares_of(*file, index.edge))
      in.fail_at_line("this line describes no tile");
    index.files.push_back(std::move(*file));
  }
  (void)words_after("end");
  return index;
}

}  // namespace

template <int D>
std::optional<tile_index<D>> read_index(const std::filesystem::path& folder) {
  const auto path = folder / index_name;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nullopt;
  return with_errors(path, [&] {
    detail::input_file file{path};
    detail::byte_stream in{file.size(),
                           [&](char* out, std::size_t count) { return file.read(out, count); }};
    return parse_index<D>(in, folder);
  });
}

template <int D>
void write_index(const std::filesystem::path& folder, const tile_index<D>& index) {
  const auto path = folder / index_name;
  with_errors(path, [&] {
    detail::output_file out{path};
    std::string text{first_words};
    text += "\nmade " + index.made + "\ndimension";
    put(text, D);
    text += "\nscalar " + index.scalar + (index.is_local ? " local" : "") + "\nedge";
    put(text, index.edge);
    text += "\norigin";
    for (const double coordinate : index.origin) put(text, coordinate);
    text += "\nfiles";
    put(text, index.files.size());
    text += '\n';
    for (const auto& file : index.files) {
      text += line_of(file);
      out.write(text.data(), text.size());
      text.clear();
    }
    text += "end\n";
    out.write(text.data(), text.size());
    out.commit();
  });
}

folder_lock::folder_lock(const std::filesystem::path& folder) : path_{folder / notes_name} {
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw io_error{path_, std::strerror(errno)};
  // A file system without locks has none to offer.
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(descriptor_);
  throw invalid_input{"write_tiles: \"" + folder.string() +
                      "\" is being written by another process or thread"};
}

folder_lock::~folder_lock() {
  struct stat status{};
  // If nothing was begun, nothing is unfinished.
  if (::fstat(descriptor_, &status) == 0 && status.st_size == 0 && status.st_nlink > 0)
    ::unlink(path_.c_str());
  ::close(descriptor_);
}

namespace {

struct noted_lines {
  std::string first;
  std::vector<std::string> complete;
  std::uint64_t bytes = 0;  ///< Up to the end of the last line that is complete.
};

/// Several threads append, each a whole line at a time, so that only the last line can be cut.
noted_lines read_lines(const std::filesystem::path& path) {
  return with_errors(path, [&] {
    detail::input_file file{path};
    std::string text(file.size(), '\0');
    text.resize(file.read(text.data(), text.size()));
    noted_lines found;
    for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != text.npos; begin = end + 1) {
      found.bytes = end + 1;
      auto line = text.substr(begin, end - begin);
      if (begin == 0)
        found.first = std::move(line);
      else
        found.complete.push_back(std::move(line));
    }
    return found;
  });
}

std::vector<std::filesystem::path> notes_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> found;
  std::error_code error;
  for (std::filesystem::directory_iterator at{folder, error}, end; !error && at != end;
       at.increment(error))
    if (is_notes(at->path())) found.push_back(at->path());
  std::ranges::sort(found);
  return found;
}

}  // namespace

template <int D>
tile_notes<D>::tile_notes(const std::filesystem::path& folder, const std::string& what, int rank)
    : path_{folder / (std::string{notes_name} + (rank == 0 ? "" : '.' + std::to_string(rank)))} {
  with_errors(path_, [&] {
    std::error_code error;
    const auto good = std::filesystem::exists(path_, error) ? read_lines(path_).bytes : 0;
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (descriptor_ < 0 || ::ftruncate(descriptor_, static_cast<off_t>(good)) != 0)
      throw std::system_error{errno, std::generic_category()};
    if (good > 0) return;
    const std::string line = what + '\n';
    if (::write(descriptor_, line.data(), line.size()) != std::ssize(line))
      throw std::system_error{errno, std::generic_category()};
  });
}

template <int D>
std::vector<survey_file<D>> read_notes(const std::filesystem::path& folder,
                                       const std::string& what) {
  std::vector<survey_file<D>> done;
  for (const auto& path : notes_in(folder)) {
    const auto lines = read_lines(path);
    // Whoever was killed before the first line was complete has written nothing else.
    if (lines.first.empty()) continue;
    expects(lines.first == what, "write_tiles: what is in \"" + folder.string() +
                                     "\" was begun with other files, steps or options:\n" +
                                     lines.first + "\nand not\n" + what);
    for (const auto& line : lines.complete)
      if (auto file = parse_line<D>(line, folder)) done.push_back(std::move(*file));
  }
  return done;
}

void remove_notes(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const auto& path : notes_in(folder)) std::filesystem::remove(path, ignored);
}

void empty_notes(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const auto& path : notes_in(folder)) {
    // The first is the file that is locked.
    if (path.filename() == notes_name)
      std::filesystem::resize_file(path, 0, ignored);
    else
      std::filesystem::remove(path, ignored);
  }
}

bool is_notes(const std::filesystem::path& path) {
  return path.filename().string().starts_with(notes_name);
}

bool has_notes(const std::filesystem::path& folder) {
  return !notes_in(folder).empty();
}

template <int D>
std::string text_of(const survey_file<D>& file) {
  return line_of(file);
}

template <int D>
std::vector<survey_file<D>> files_of_text(std::string_view text,
                                          const std::filesystem::path& folder) {
  std::vector<survey_file<D>> files;
  while (!text.empty()) {
    const auto end = text.find('\n');
    auto file = parse_line<D>(text.substr(0, end), folder);
    if (!file) throw std::runtime_error{"ranks run different programs"};
    files.push_back(std::move(*file));
    text.remove_prefix(end + 1);
  }
  return files;
}

template <int D>
tile_notes<D>::~tile_notes() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

template <int D>
void tile_notes<D>::add(const survey_file<D>& tile) {
  const std::string line = line_of(tile);
  const auto put = ::write(descriptor_, line.data(), line.size());
  // What follows a line that was cut would not be read.
  if (put != std::ssize(line))
    throw io_error{path_, put < 0 ? std::strerror(errno) : "only a part could be written"};
}

template std::optional<tile_index<2>> read_index(const std::filesystem::path&);
template std::optional<tile_index<3>> read_index(const std::filesystem::path&);
template void write_index(const std::filesystem::path&, const tile_index<2>&);
template void write_index(const std::filesystem::path&, const tile_index<3>&);
template class tile_notes<2>;
template class tile_notes<3>;
template std::vector<survey_file<2>> read_notes(const std::filesystem::path&, const std::string&);
template std::vector<survey_file<3>> read_notes(const std::filesystem::path&, const std::string&);
template std::string text_of(const survey_file<2>&);
template std::string text_of(const survey_file<3>&);
template std::vector<survey_file<2>> files_of_text(std::string_view, const std::filesystem::path&);
template std::vector<survey_file<3>> files_of_text(std::string_view, const std::filesystem::path&);

}  // namespace cilantro
