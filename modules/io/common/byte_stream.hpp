// SPDX-License-Identifier: MIT
//
// How a file is taken apart: bytes, lines, words. A plain header, which needs nothing of any
// module.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cilantro::detail {

/// What is wrong with the content, and the line or byte where it is.
struct failure : std::runtime_error {
  failure(const std::string& what, bool is_line, std::uint64_t place)
      : std::runtime_error{what}, in_line{is_line}, at{place} {}
  bool in_line;
  std::uint64_t at;
};

/// Lines in memory, somewhere in a text: what a thread takes of a `byte_stream`.
class line_span {
 public:
  line_span(std::string_view text, char line_end) : rest_{text}, line_end_{line_end} {}

  /// Says how many lines come before.
  void set_line(std::uint64_t line) { line_ = line; }
  /// How many lines were taken, with those that come before.
  [[nodiscard]] std::uint64_t line() const { return line_; }
  [[nodiscard]] std::size_t remaining() const { return rest_.size(); }

  /// As that of `byte_stream`.
  std::optional<std::string_view> take_line() {
    if (rest_.empty()) return std::nullopt;
    const std::size_t end = rest_.find(line_end_);
    auto line = rest_.substr(0, end);
    rest_.remove_prefix(end == rest_.npos ? rest_.size() : end + 1);
    ++line_;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  [[noreturn]] void fail_at_line(const std::string& what) const {
    throw failure{what, true, line_};
  }

 private:
  std::string_view rest_;
  char line_end_;
  std::uint64_t line_ = 0;
};

/// A stretch of bytes to read from front to back, of a known size, refilled piece by piece.
class byte_stream {
 public:
  using refill = std::function<std::size_t(char*, std::size_t)>;

  /// Of `size` bytes, of which `more` gives those from `first` on.
  byte_stream(std::uint64_t size, refill more, std::uint64_t first = 0)
      : size_{size}, loaded_{first}, more_{std::move(more)} {}

  /// Where the next byte to be taken is in the file.
  [[nodiscard]] std::uint64_t position() const { return loaded_ - (end_ - begin_); }
  [[nodiscard]] std::uint64_t remaining() const { return size_ - position(); }
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// The next `count` bytes, which stay where they are until the next call.
  const char* take(std::size_t count) {
    if (end_ - begin_ < count) load(count);
    if (end_ - begin_ < count) fail_at_byte("the file ends in the middle of the data");
    const char* data = room_.data() + begin_;
    begin_ += count;
    return data;
  }

  /// Tells that no more than the next `count` bytes are wanted, so that no more need be loaded.
  void will_take(std::uint64_t count) { wanted_ = std::min(count, remaining()) + position(); }

  /// The next `count` bytes, or what there is of them, without taking them.
  std::string_view peek(std::size_t count) {
    if (end_ - begin_ < count) load(count);
    return {room_.data() + begin_, std::min(count, end_ - begin_)};
  }

  void skip(std::uint64_t count) {
    if (count > remaining()) fail_at_byte("the file ends in the middle of the data");
    while (count > 0) {
      const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(count, piece));
      take(part);
      count -= part;
    }
  }

  /// Passes over the three bytes with which some editors begin a text.
  void skip_byte_order_mark() {
    if (peek(3) == "\xEF\xBB\xBF") take(3);
  }

  /// The next line without its end, or nothing at the end of the file. Lines end as the first of
  /// them does: in a newline, with or without a carriage return before it, or in one alone.
  std::optional<std::string_view> take_line() {
    std::size_t searched = 0;
    if (line_end_ == '\0') line_end_ = first_line_end();
    for (;;) {
      const char* first = room_.data() + begin_;
      const std::size_t available = end_ - begin_;
      const void* newline = available > searched
                                ? std::memchr(first + searched, line_end_, available - searched)
                                : nullptr;
      if (newline != nullptr || available == size_ - position()) {
        if (newline == nullptr && available == 0) return std::nullopt;
        std::size_t length =
            newline ? static_cast<std::size_t>(static_cast<const char*>(newline) - first)
                    : available;
        begin_ += length + (newline ? 1 : 0);
        ++line_;
        if (length > 0 && first[length - 1] == '\r') --length;
        return std::string_view{first, length};
      }
      searched = available;
      load(available + 1);
      if (end_ - begin_ == available) fail_at_byte("the file became shorter while it was read");
    }
  }

  /// How many lines were taken.
  [[nodiscard]] std::uint64_t line() const { return line_; }
  /// What ends them, once one was taken or looked at.
  [[nodiscard]] char line_end() const { return line_end_; }

  /// The whole lines among the next `count` bytes, of which there may be none, without taking them;
  /// at the end of the file, also one without an end.
  std::string_view peek_lines(std::size_t count) {
    if (line_end_ == '\0') line_end_ = first_line_end();
    const auto all = peek(count);
    return all.size() == remaining() ? all : all.substr(0, all.rfind(line_end_) + 1);
  }
  /// Takes so many bytes of these, which are so many lines.
  void pass_lines(std::size_t count, std::uint64_t lines) {
    take(count);
    line_ += lines;
  }

  [[noreturn]] void fail_at_line(const std::string& what) const {
    throw failure{what, true, line_};
  }
  [[noreturn]] void fail_at_byte(const std::string& what) const {
    throw failure{what, false, position()};
  }

 private:
  static constexpr std::size_t piece = std::size_t{1} << 18;
  /// Whoever looks at a header, or at a few points, does not want a whole piece.
  static constexpr std::size_t first_piece = std::size_t{1} << 13;

  char first_line_end() {
    for (std::size_t looked_at = 0, before = 0;;) {
      const auto all = peek(looked_at + first_piece);
      const auto at = all.find_first_of("\r\n", looked_at);
      // One more byte tells whether a newline follows.
      if (at != all.npos && (all[at] == '\n' || at + 1 < all.size() || all.size() == remaining()))
        return all[at] == '\r' && (at + 1 == all.size() || all[at + 1] != '\n') ? '\r' : '\n';
      if (all.size() == remaining()) return '\n';
      if (all.size() <= before) fail_at_byte("the file became shorter while it was read");
      before = all.size();
      looked_at = at == all.npos ? all.size() : at;
    }
  }

  /// Makes at least `count` bytes available, if the file has them.
  void load(std::size_t count) {
    std::copy(room_.data() + begin_, room_.data() + end_, room_.data());
    end_ -= begin_;
    begin_ = 0;
    // Lines may be long; growing by factors keeps reading one of them linear.
    const std::size_t enough = std::min(piece, std::max(first_piece, 4 * room_.size()));
    if (room_.size() < std::max(count, enough))
      room_.resize(std::max({enough, count, count > piece ? 2 * room_.size() : 0}));
    std::size_t room = room_.size() - end_;
    if (wanted_ > loaded_)
      room =
          std::min<std::uint64_t>(room, std::max<std::uint64_t>(wanted_ - loaded_, count - end_));
    const std::size_t got = more_(room_.data() + end_, room);
    end_ += got;
    loaded_ += got;
  }

  std::uint64_t size_, loaded_, line_ = 0;
  std::uint64_t wanted_ = 0;  ///< Where what is wanted ends; 0 if that is not known.
  refill more_;
  std::vector<char> room_;
  std::size_t begin_ = 0, end_ = 0;
  char line_end_ = '\0';  ///< Not known before the first line.
};

/// The words of a line, between white space, and commas and semicolons if these separate, too.
class word_reader {
 public:
  explicit word_reader(std::string_view line, bool commas = false) : rest_{line}, commas_{commas} {}

  std::string_view next() {
    const auto is_space = [this](char c) {
      return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f' ||
             (commas_ && (c == ',' || c == ';'));
    };
    std::size_t begin = 0;
    while (begin < rest_.size() && is_space(rest_[begin])) ++begin;
    std::size_t end = begin;
    while (end < rest_.size() && !is_space(rest_[end])) ++end;
    const auto word = rest_.substr(begin, end - begin);
    rest_.remove_prefix(end);
    return word;
  }
  [[nodiscard]] bool done() { return word_reader{rest_, commas_}.next().empty(); }
  /// What follows, without the one space that separates it.
  [[nodiscard]] std::string_view rest() const { return rest_.substr(rest_.empty() ? 0 : 1); }

 private:
  std::string_view rest_;
  bool commas_;
};

}  // namespace cilantro::detail
