// SPDX-License-Identifier: MIT
//
// A program that reads what it is sent. Internal.
module;
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
module cilantro.visualization:child_process;

import cilantro.standard;

namespace cilantro {

/// What a system call says, or the error of one that fails.
inline int expect_no_error(int result) {
  if (result < 0) throw std::system_error{errno, std::generic_category()};
  return result;
}

/// An open file, which closes itself.
class descriptor {
 public:
  descriptor() = default;
  explicit descriptor(int number) : number_{number} {}
  descriptor(descriptor&& other) noexcept : number_{std::exchange(other.number_, -1)} {}
  descriptor& operator=(descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~descriptor() { close(); }

  void close() {
    if (number_ >= 0) ::close(std::exchange(number_, -1));
  }
  [[nodiscard]] int number() const { return number_; }

 private:
  int number_ = -1;
};

/// Two ends of a way for bytes, which no other program inherits.
inline std::array<descriptor, 2> connected_pair() {
  std::array<int, 2> ends{};
  expect_no_error(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()));
  std::array<descriptor, 2> pair{descriptor{ends[0]}, descriptor{ends[1]}};
  // In a program without standard streams they might have the numbers that those get in the child.
  for (auto& end : pair)
    if (end.number() <= STDERR_FILENO)
      end = descriptor{expect_no_error(::fcntl(end.number(), F_DUPFD_CLOEXEC, STDERR_FILENO + 1))};
  return pair;
}

/// A running program, which ends when this is destroyed at the latest. Its input is a socket, since
/// only there a write to a program that has ended can be kept from raising SIGPIPE, which belongs
/// to all threads.
class child_process {
 public:
  /// `command`: the program, searched in PATH, and its arguments, as they are. Throws
  /// `std::system_error` if it cannot be started.
  explicit child_process(std::vector<std::string> command) {
    auto [input, input_of_child] = connected_pair();
    auto [words, words_of_child] = connected_pair();
    std::vector<char*> arguments;
    for (auto& argument : command) arguments.push_back(argument.data());
    arguments.push_back(nullptr);

    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_adddup2(&files, input_of_child.number(), STDIN_FILENO);
    ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_adddup2(&files, words_of_child.number(), STDERR_FILENO);
    // Signals that this thread keeps away are not kept from the child; those of the terminal are,
    // so that a program that ends itself in order on Ctrl-C can end its child, too.
    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    sigset_t none;
    ::sigemptyset(&none);
    ::posix_spawnattr_setsigmask(&attributes, &none);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
    const int error =
        ::posix_spawnp(&id_, arguments[0], &files, &attributes, arguments.data(), environ);
    ::posix_spawnattr_destroy(&attributes);
    ::posix_spawn_file_actions_destroy(&files);
    if (error != 0) throw std::system_error{error, std::generic_category()};
    input_ = std::move(input);
    words_ = std::move(words);
  }
  child_process(const child_process&) = delete;
  child_process& operator=(const child_process&) = delete;
  ~child_process() {
    // If something else waited for it, its number may be that of another program by now.
    if (id_ < 0 || ::waitpid(id_, nullptr, WNOHANG) != 0) return;
    ::kill(id_, SIGKILL);
    reap();
  }

  /// Whether all was read; not so if the program has ended, or has closed its input.
  [[nodiscard]] bool send(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      // What the program says is heard meanwhile: it waits when nobody listens.
      std::array<pollfd, 2> ready{pollfd{input_.number(), POLLOUT, 0},
                                  pollfd{words_.number(), POLLIN, 0}};
      if (::poll(ready.data(), ready.size(), -1) < 0 && errno != EINTR) expect_no_error(-1);
      if (ready[1].revents != 0) listen();
      if (ready[0].revents == 0) continue;
      const ssize_t sent =
          ::send(input_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent >= 0)
        bytes = bytes.subspan(static_cast<std::size_t>(sent));
      else if (errno == EPIPE || errno == ECONNRESET)
        return false;
      else if (errno != EAGAIN && errno != EINTR)
        expect_no_error(-1);
    }
    return true;
  }

  /// Ends the input, waits, and says how the program has ended: "" if it did all it should.
  [[nodiscard]] std::string end() {
    input_.close();
    while (words_.number() >= 0) listen();
    const auto status = reap();
    // Where something else waits for all children, what the program says has to do.
    if (!status.is_known) return last_words_.empty() ? "" : last_lines();
    if (WIFSIGNALED(status.value))
      return "it was ended by signal " + std::to_string(WTERMSIG(status.value));
    if (WEXITSTATUS(status.value) == 0) return "";
    const std::string lines = last_lines();
    return lines.empty() ? "it ended with " + std::to_string(WEXITSTATUS(status.value)) : lines;
  }

 private:
  struct end_status {
    bool is_known;
    int value;
  };
  end_status reap() {
    int status = 0;
    pid_t found = 0;
    do found = ::waitpid(id_, &status, 0);
    while (found < 0 && errno == EINTR);
    id_ = -1;
    return {found >= 0, status};
  }

  void listen() {
    std::array<char, 4096> heard{};
    const ssize_t count = ::read(words_.number(), heard.data(), heard.size());
    if (count > 0) {
      last_words_.append(heard.data(), static_cast<std::size_t>(count));
      if (last_words_.size() > heard.size())
        last_words_.erase(0, last_words_.size() - heard.size());
    } else if (count == 0 || errno != EINTR) {
      words_.close();
    }
  }

  /// The last two lines of what it said, in one: the last one alone often says only where.
  [[nodiscard]] std::string last_lines() const {
    std::vector<std::string> lines{""};
    for (const char c : last_words_) {
      if (c != '\n' && c != '\r')
        lines.back() += c;
      else if (!lines.back().empty())
        lines.emplace_back();
    }
    if (lines.back().empty()) lines.pop_back();
    if (lines.empty()) return "";
    return (lines.size() > 1 ? lines[lines.size() - 2] + "; " : "") + lines.back();
  }

  pid_t id_ = -1;
  descriptor input_, words_;
  std::string last_words_;
};

}  // namespace cilantro
