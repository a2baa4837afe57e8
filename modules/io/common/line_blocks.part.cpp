// SPDX-License-Identifier: MIT
//
// Lines of a text that several threads read. Internal: shared by the readers.
module;
#include "io/common/byte_stream.hpp"
module cilantro.io:line_blocks;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Reads rows, each of which is a line, in blocks whose parts go to several threads. What is read,
/// and the line that is at fault if one is, does not depend on how many.
class line_blocks {
 public:
  /// Of rows that take so many bytes at least.
  line_blocks(detail::byte_stream& in, int threads, std::size_t least_row)
      : in_{&in}, threads_{threads}, row_bytes_{static_cast<double>(least_row)} {}

  /// What was read at a time.
  struct rows_read {
    index_t count;
    bool is_stopped;  ///< Whether the next line is nothing for what reads.
  };

  /// The next rows, as many as are convenient and `most` at most. Nothing if they are few, or a
  /// line is long: then the calling thread had better read `few` of them itself.
  ///
  /// `is_row(line)` says whether a line is one; others are passed over. `prepare(n)` is called
  /// once, before the rows 0 to n − 1 are read. `read_part(lines, first, n)` reads the rows `first`
  /// to `first + n` − 1 by taking lines until it has them, on any thread, and returns how many
  /// these were: less than n if it stops before a line that is nothing for it, which is then the
  /// next of the stream.
  template <class IsRow, class Prepare, class Read>
  std::optional<rows_read> read(index_t most, IsRow is_row, Prepare prepare, Read read_part) {
    const auto block = threads_ == 1 || most < few ? std::string_view{} : next_block(most);
    if (block.empty()) return {};

    auto parts = parts_of(block);
    const auto each_part = [&](auto f) {
      parallel_blocks(std::ssize(parts), 1, {.threads = threads_},
                      [&](index_t p, index_t, index_t) { f(parts[static_cast<std::size_t>(p)]); });
    };
    each_part([&](part& p) {
      auto lines = p.lines;
      while (const auto line = lines.take_line()) p.rows += is_row(*line);
      p.line_count = lines.line();
    });
    index_t rows = 0;
    std::uint64_t line = in_->line();
    for (part& p : parts) {
      p.first = rows;
      p.lines.set_line(line);
      rows += p.rows;
      line += p.line_count;
    }
    prepare(std::min(rows, most));
    each_part([&](part& p) {
      const index_t wanted = std::min(p.rows, most - p.first);
      if (wanted > 0) p.done = read_part(p.lines, p.first, wanted);
    });

    index_t done = 0;
    bool is_stopped = false;
    const std::uint64_t begin = in_->position();
    for (const part& p : parts) {
      if (done == most) break;
      done += p.done;
      const bool is_whole = p.done == p.rows;
      in_->pass_lines(p.size - (is_whole ? 0 : p.lines.remaining()),
                      is_whole ? p.line_count : p.lines.line() - in_->line());
      is_stopped = !is_whole && done < most;
      if (!is_whole) break;
    }
    if (done > 0)
      row_bytes_ = static_cast<double>(in_->position() - begin) / static_cast<double>(done);
    return rows_read{done, is_stopped};
  }

  /// Fewer rows are read by the calling thread.
  static constexpr index_t few = 4096;

 private:
  struct part {
    detail::line_span lines;
    std::size_t size;
    std::uint64_t line_count = 0;
    index_t rows = 0, first = 0, done = 0;
  };

  // A part takes a thread a fraction of a millisecond.
  static constexpr std::size_t part_size = std::size_t{1} << 16, most_parts = 64;

  std::string_view next_block(index_t most) {
    // Several a file, so that progress is seen; and no more than is needed, since what is left is
    // looked at again.
    const auto largest =
        std::clamp<std::uint64_t>(in_->size() / 8, 4 * part_size, most_parts * part_size);
    const double wanted = 1.05 * row_bytes_ * static_cast<double>(most);
    return in_->peek_lines(
        static_cast<std::size_t>(std::clamp(wanted, double(part_size), double(largest))));
  }

  [[nodiscard]] std::vector<part> parts_of(std::string_view block) const {
    std::vector<part> parts;
    while (!block.empty()) {
      const auto end = block.find(in_->line_end(), std::min(part_size, block.size()) - 1);
      const std::size_t size = end == block.npos ? block.size() : end + 1;
      parts.push_back({{block.substr(0, size), in_->line_end()}, size});
      block.remove_prefix(size);
    }
    return parts;
  }

  detail::byte_stream* in_;
  int threads_;
  double row_bytes_;
};

}  // namespace cilantro
