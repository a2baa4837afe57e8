// SPDX-License-Identifier: MIT
//
// What all readers and writers do with a file around its content. Internal.
module;
#include <cerrno>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
module cilantro.io:file_scope;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// `read()`, with what is wrong with the content said as an error of the file `name`.
template <class F>
auto with_place(const std::filesystem::path& name, F read) {
  try {
    return read();
  } catch (const detail::failure& f) {
    using unit = file_position::unit;
    throw io_error{name, f.what(), file_position{f.in_line ? unit::line : unit::byte, f.at}};
  }
}

/// As above, with what the system says of the file, too.
template <class F>
auto with_file(const std::filesystem::path& path, F read) {
  try {
    return with_place(path, read);
  } catch (const std::system_error& error) {
    throw io_error{path, error.code().value() == EINVAL
                             ? "cannot be read: it is not a regular file"
                             : "cannot be read: " + error.code().message()};
  }
}

/// A file that stays open between the calls that read from it.
class open_file {
 public:
  explicit open_file(const std::filesystem::path& path) : file_{path} { seek(0); }

  [[nodiscard]] detail::byte_stream& stream() { return *stream_; }
  /// Goes on at byte `place`.
  void seek(std::uint64_t place) {
    file_.seek(place);
    stream_.emplace(
        file_.size(), [this](char* out, std::size_t count) { return file_.read(out, count); },
        place);
  }

 private:
  detail::input_file file_;
  std::optional<detail::byte_stream> stream_;
};

/// `read(stream)` of the file at `path`.
template <class F>
auto with_stream(const std::filesystem::path& path, F read) {
  return with_file(path, [&] {
    open_file file{path};
    return read(file.stream());
  });
}

/// `read(stream)` of bytes in memory.
template <class F>
auto with_stream(std::span<const std::byte> bytes, const std::filesystem::path& name, F read) {
  std::size_t at = 0;
  return with_place(name, [&] {
    detail::byte_stream stream{bytes.size(), [&](char* out, std::size_t count) {
                                 const std::size_t part = std::min(count, bytes.size() - at);
                                 std::memcpy(out, bytes.data() + at, part);
                                 at += part;
                                 return part;
                               }};
    return read(stream);
  });
}

/// `write(file)` into a file that appears at `path` when it is complete.
template <class F>
void with_output(const std::filesystem::path& path, F write) {
  try {
    detail::output_file file{path};
    write(file);
    file.commit();
  } catch (const std::system_error& error) {
    throw io_error{path, "cannot be written: " + error.code().message()};
  }
}

/// Reports the progress of a file, and stops it.
inline void watch(const task_monitor& monitor, double done, double all) {
  if (monitor.stop.stop_requested()) throw cancelled{};
  if (monitor.progress) monitor.progress(all > 0 ? done / all : 1);
}

}  // namespace cilantro
