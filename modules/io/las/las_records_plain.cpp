// SPDX-License-Identifier: MIT
module;
#include "io/common/random_bytes.hpp"
module cilantro.io;

import :las_file;

namespace cilantro {
namespace {

/// Records one after another.
class plain_records : public las_records {
 public:
  plain_records(const detail::random_bytes& file, const las_layout& layout)
      : file_{file},
        begin_{layout.points_at},
        count_{layout.info.points},
        length_{layout.info.record_length} {
    const std::uint64_t left = file.size() - begin_;
    if (count_ > left / length_)
      throw detail::failure{"the header promises " + std::to_string(count_) + " points of " +
                                std::to_string(length_) + " bytes, and only " +
                                std::to_string(left) + " bytes are left",
                            false, begin_};
  }

  void visit(std::uint64_t first, std::uint64_t count, const task_monitor& monitor,
             const record_visitor& visit) override {
    // What stays in a core's cache.
    constexpr std::size_t piece = std::size_t{3} << 15;
    const auto at_a_time =
        std::clamp<index_t>(static_cast<index_t>(piece / length_), 1, most_records);
    parallel_blocks(static_cast<index_t>(count), at_a_time, {.monitor = monitor},
                    [&](index_t, index_t begin, index_t end) {
                      const auto n = static_cast<std::size_t>(end - begin);
                      const auto records = std::make_unique_for_overwrite<char[]>(n * length_);
                      const std::uint64_t from = first + static_cast<std::uint64_t>(begin);
                      file_.read(begin_ + from * length_, records.get(), n * length_);
                      visit(from, end - begin, records.get());
                    });
  }

  [[nodiscard]] std::vector<char> sample() const override {
    constexpr std::size_t coordinates = 12;
    const std::uint64_t n = std::min<std::uint64_t>(count_, 1000);
    std::vector<char> records(static_cast<std::size_t>(n) * length_);
    for (std::uint64_t i = 0; i < n; ++i)
      file_.read(begin_ + i * (count_ / n) * length_, records.data() + i * length_, coordinates);
    return records;
  }

 private:
  const detail::random_bytes& file_;
  std::uint64_t begin_, count_;
  std::size_t length_;
};

}  // namespace

std::unique_ptr<las_records> open_records(const detail::random_bytes& file,
                                          const las_layout& layout) {
  if (layout.info.is_compressed) return open_compressed_records(file, layout);
  return std::make_unique<plain_records>(file, layout);
}

}  // namespace cilantro
