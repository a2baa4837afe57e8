// SPDX-License-Identifier: MIT
//
// What a fuzzer's bytes say where numbers are asked for.
module;
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
export module fuzzed_numbers;

import cilantro;

/// Numbers made of bytes: most of one byte and on a coarse grid, so that many coincide; some nearly
/// so; and any that a double can be.
export class fuzzed_numbers {
 public:
  fuzzed_numbers(const std::uint8_t* data, std::size_t size) : bytes_{data, size} {}

  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  /// From 0 on, below `bound`.
  int below(int bound) { return byte() % bound; }
  double next() {
    const int first = byte();
    if (first < 0xf0) return (first - 0x78) / 8.0;
    if (first < 0xf8) {
      const double near = below(16) - 8;
      return near + std::ldexp(first % 2 == 0 ? 1 : -1, -below(64));
    }
    double any = 0;
    if (bytes_.size() < sizeof(any)) return 0;
    std::memcpy(&any, bytes_.data(), sizeof(any));
    bytes_ = bytes_.subspan(sizeof(any));
    return any;
  }
  /// A table of as many columns as there are numbers for, at most `most`.
  Eigen::MatrixXd columns(cilantro::index_t rows, cilantro::index_t most) {
    Eigen::MatrixXd table(rows, most);
    cilantro::index_t count = 0;
    for (; count < most && !empty(); ++count)
      for (cilantro::index_t d = 0; d < rows; ++d) table(d, count) = next();
    return table.leftCols(count);
  }

 private:
  int byte() {
    if (bytes_.empty()) return 0;
    const int first = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return first;
  }

  std::span<const std::uint8_t> bytes_;
};
