// SPDX-License-Identifier: MIT
#include "io/common/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>

namespace cilantro::detail {
namespace {

[[noreturn]] void fail(int error) {
  throw std::system_error{error, std::generic_category()};
}

int open_or_fail(const std::filesystem::path& path, int flags, mode_t mode = 0) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC, mode);
  if (descriptor < 0) fail(errno);
  return descriptor;
}

}  // namespace

input_file::input_file(const std::filesystem::path& path)
    // Without O_NONBLOCK, opening a named pipe would wait for a writer.
    : descriptor_{open_or_fail(path, O_RDONLY | O_NONBLOCK)} {
  struct stat status{};
  const int error = ::fstat(descriptor_, &status) != 0 ? errno
                    : S_ISDIR(status.st_mode)          ? EISDIR
                    : !S_ISREG(status.st_mode)         ? EINVAL
                                                       : 0;
  if (error != 0) {
    ::close(descriptor_);
    fail(error);
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

input_file::~input_file() {
  ::close(descriptor_);
}

std::size_t input_file::read(char* out, std::size_t count) {
  std::size_t total = 0;
  while (total < count) {
    const ssize_t got = ::read(descriptor_, out + total, count - total);
    if (got == 0) break;
    if (got > 0)
      total += static_cast<std::size_t>(got);
    else if (errno != EINTR)
      fail(errno);
  }
  return total;
}

std::size_t input_file::read_at(std::uint64_t at, char* out, std::size_t count) const {
  std::size_t total = 0;
  while (total < count) {
    const ssize_t got =
        ::pread(descriptor_, out + total, count - total, static_cast<off_t>(at + total));
    if (got == 0) break;
    if (got > 0)
      total += static_cast<std::size_t>(got);
    else if (errno != EINTR)
      fail(errno);
  }
  return total;
}

void input_file::seek(std::uint64_t place) {
  if (::lseek(descriptor_, static_cast<off_t>(place), SEEK_SET) < 0) fail(errno);
}

output_file::output_file(const std::filesystem::path& path) {
  std::error_code ignored;
  // Renaming over a symbolic link would replace the link, not what it points to.
  final_ = std::filesystem::weakly_canonical(path, ignored);
  if (ignored || final_.empty()) final_ = path;

  struct stat status{};
  const bool exists = ::stat(final_.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) fail(EISDIR);
  if (exists && !S_ISREG(status.st_mode)) {
    descriptor_ = open_or_fail(final_, O_WRONLY);
    return;
  }
  if (!path.has_filename()) fail(ENOENT);
  // Replacing a file needs leave to write to it, as overwriting it would.
  if (exists && ::access(final_.c_str(), W_OK) != 0) fail(errno);

  static std::atomic<unsigned> counter = 0;
  do {
    temporary_ = final_;
    temporary_ += "." + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".part";
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor_ < 0 && errno == EEXIST);
  if (descriptor_ < 0) fail(errno);
  if (exists) ::fchmod(descriptor_, status.st_mode & 07777);
}

output_file::~output_file() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void output_file::write(const char* data, std::size_t count) {
  while (count > 0) {
    const ssize_t put = ::write(descriptor_, data, count);
    if (put >= 0) {
      data += put;
      count -= static_cast<std::size_t>(put);
    } else if (errno != EINTR) {
      fail(errno);
    }
  }
}

void output_file::commit() {
  // Some file systems report a full disk only now.
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  if (closed != 0 && errno != EINTR) fail(errno);
  if (temporary_.empty()) return;
  if (::rename(temporary_.c_str(), final_.c_str()) != 0) fail(errno);
  temporary_.clear();
}

}  // namespace cilantro::detail
