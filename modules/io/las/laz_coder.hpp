// SPDX-License-Identifier: MIT
//
// Arithmetic decoding with adaptive models, as LAZ files use it. A plain header, which needs
// nothing of any module.
//
// Source: A. Said, Introduction to arithmetic coding: theory and practice, HPL-2004-76, 2004, which
// the constants are from; the published description of LASzip for what is coded.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "io/common/byte_stream.hpp"

namespace cilantro::laz {

/// How often each of some symbols was met, and from that their shares of an interval of 2^15.
class symbol_model {
 public:
  static constexpr unsigned share_bits = 15;

  [[nodiscard]] bool empty() const { return counts_.empty(); }
  /// All `symbols`, at least two of them, alike.
  void begin(unsigned symbols) {
    last_ = symbols - 1;
    counts_.assign(symbols, 1);
    shares_.assign(symbols + 1, 0);
    shares_[symbols] = 1u << share_bits;
    // Where to begin to look for a symbol, by about as many places as there are symbols.
    unsigned bits = 3;
    while (symbols > (1u << bits)) ++bits;
    shift_ = share_bits - bits;
    starts_.assign((std::size_t{1} << bits) + 1, 0);
    total_ = 0;
    cycle_ = symbols;
    update();
    cycle_ = left_ = (symbols + 6) >> 1;
  }

  /// The symbol whose share holds a place, of which there are 2^15.
  [[nodiscard]] unsigned find(unsigned place) const {
    unsigned low = starts_[place >> shift_];
    while (shares_[low + 1] <= place) ++low;
    return low;
  }
  /// Where the share of a symbol begins.
  [[nodiscard]] unsigned share(unsigned symbol) const { return shares_[symbol]; }
  [[nodiscard]] bool is_last(unsigned symbol) const { return symbol == last_; }

  void count(unsigned symbol) {
    ++counts_[symbol];
    if (--left_ == 0) update();
  }

 private:
  /// Gives out the shares anew, the more seldom the longer the model has been learning.
  void update() {
    const auto n = static_cast<unsigned>(counts_.size());
    total_ += cycle_;
    if (total_ > 1u << share_bits) {
      total_ = 0;
      for (auto& c : counts_) {
        c = static_cast<std::uint16_t>((c + 1u) >> 1);
        total_ += c;
      }
    }
    const unsigned scale = 0x80000000u / total_;
    unsigned sum = 0, place = 0;
    for (unsigned k = 0; k < n; ++k) {
      shares_[k] = static_cast<std::uint16_t>((scale * sum) >> (31 - share_bits));
      sum += counts_[k];
      // The last symbol that begins at or before a place.
      for (; place < starts_.size() && (place << shift_) < shares_[k]; ++place)
        starts_[place] = static_cast<std::uint16_t>(k - 1);
    }
    for (; place < starts_.size(); ++place) starts_[place] = static_cast<std::uint16_t>(n - 1);
    cycle_ = std::min((5 * cycle_) >> 2, (n + 6) << 3);
    left_ = cycle_;
  }

  std::vector<std::uint16_t> counts_, shares_, starts_;
  unsigned last_ = 0, shift_ = 0, total_ = 0, cycle_ = 0, left_ = 0;
};

/// The same for a bit.
struct bit_model {
  static constexpr unsigned share_bits = 13;
  unsigned zeros = 1, total = 2, share = 1u << (share_bits - 1), cycle = 4, left = 4;

  void count(bool bit) {
    if (!bit) ++zeros;
    if (--left > 0) return;
    total += cycle;
    if (total > 1u << share_bits) {
      total = (total + 1) >> 1;
      zeros = (zeros + 1) >> 1;
      if (zeros == total) ++total;
    }
    share = (zeros * (0x80000000u / total)) >> (31 - share_bits);
    cycle = std::min((5 * cycle) >> 2, 64u);
    left = cycle;
  }
};

/// What is coded in a stretch of bytes. Damaged bytes give wrong symbols, but none that a model
/// does not have.
class decoder {
 public:
  decoder() = default;
  decoder(const char* begin, const char* end) : next_{begin}, end_{end} {
    for (int i = 0; i < 4; ++i) value_ = value_ << 8 | byte();
  }

  unsigned symbol(symbol_model& model) {
    const std::uint32_t part = length_ >> symbol_model::share_bits;
    constexpr unsigned most = (1u << symbol_model::share_bits) - 1;
    const unsigned found = model.find(std::min(value_ / part, most));
    const std::uint32_t begin = model.share(found) * part;
    // What dividing by 2^15 leaves over belongs to the last symbol.
    const std::uint32_t end = model.is_last(found) ? length_ : model.share(found + 1) * part;
    length_ = end - begin;
    value_ -= begin;
    normalize();
    model.count(found);
    return found;
  }

  bool bit(bit_model& model) {
    const unsigned split = model.share * (length_ >> bit_model::share_bits);
    const bool one = value_ >= split;
    if (one) {
      value_ -= split;
      length_ -= split;
    } else {
      length_ = split;
    }
    normalize();
    model.count(one);
    return one;
  }

  /// How many bytes beyond the end were asked for. Encoders write a few that nothing depends on.
  [[nodiscard]] unsigned beyond() const { return beyond_; }

  /// Bits that are not modelled, up to 32.
  std::uint32_t bits(unsigned count) {
    if (count > 19) {
      const std::uint32_t low = bits(16);
      return bits(count - 16) << 16 | low;
    }
    length_ >>= count;
    const std::uint32_t found = std::min(value_ / length_, (1u << count) - 1);
    value_ -= length_ * found;
    normalize();
    return found;
  }

 private:
  unsigned byte() {
    if (next_ != end_) [[likely]]
      return static_cast<unsigned char>(*next_++);
    if (++beyond_ > 16) throw detail::failure{"the compressed points are not all there", false, 0};
    return 0;
  }
  void normalize() {
    while (length_ < 1u << 24) {
      value_ = value_ << 8 | byte();
      length_ <<= 8;
    }
  }

  const char* next_ = nullptr;
  const char* end_ = nullptr;
  std::uint32_t value_ = 0, length_ = 0xffffffffu;
  unsigned beyond_ = 0;
};

/// Integers as their differences from predictions: how many bits a difference has, by a model for
/// each context, then its highest eight, then the others as they are.
class integer_model {
 public:
  integer_model(unsigned bits, unsigned contexts)
      : bits_{bits}, lengths_(contexts), high_(bits + 1) {}

  std::int32_t decode(decoder& in, std::int32_t prediction, unsigned context = 0) {
    const std::uint32_t value = static_cast<std::uint32_t>(prediction) +
                                static_cast<std::uint32_t>(difference(in, context));
    return static_cast<std::int32_t>(bits_ < 32 ? value & ((1u << bits_) - 1) : value);
  }
  /// How many bits the last difference had.
  [[nodiscard]] unsigned length() const { return length_; }

 private:
  static constexpr unsigned modelled_bits = 8;

  std::int32_t difference(decoder& in, unsigned context) {
    auto& lengths = lengths_[context];
    if (lengths.empty()) lengths.begin(bits_ + 1);
    length_ = in.symbol(lengths);
    if (length_ == 0) return in.bit(lowest_) ? 1 : 0;
    if (length_ >= 32) return std::numeric_limits<std::int32_t>::min();
    auto& high = high_[length_];
    if (high.empty()) high.begin(1u << std::min(length_, modelled_bits));
    auto value = static_cast<std::int32_t>(in.symbol(high));
    if (length_ > modelled_bits) {
      const unsigned low = length_ - modelled_bits;
      value = static_cast<std::int32_t>(static_cast<std::uint32_t>(value) << low | in.bits(low));
    }
    // The lower half are the negative differences of that length.
    const std::int64_t half = std::int64_t{1} << (length_ - 1);
    return static_cast<std::int32_t>(value >= half ? std::int64_t{value} + 1
                                                   : std::int64_t{value} - (2 * half - 1));
  }

  unsigned bits_, length_ = 0;
  std::vector<symbol_model> lengths_, high_;
  bit_model lowest_;
};

/// The median of the last five values, as far as it is kept track of: the third of five in order,
/// of which the least and the greatest are dropped by turns.
class running_median {
 public:
  [[nodiscard]] std::int32_t get() const { return values_[2]; }
  void add(std::int32_t value) {
    // To make room, one of the ends is dropped.
    if (drop_high_) {
      if (value >= values_[2]) drop_high_ = false;
      insert(value, 4);
    } else {
      if (value <= values_[2]) drop_high_ = true;
      insert(value, 0);
    }
  }

 private:
  /// In place of the value at one end, in order.
  void insert(std::int32_t value, std::size_t end) {
    std::size_t i = end;
    if (end == 4) {
      for (; i > 0 && value < values_[i - 1]; --i) values_[i] = values_[i - 1];
    } else {
      for (; i < 4 && values_[i + 1] < value; ++i) values_[i] = values_[i + 1];
    }
    values_[i] = value;
  }

  std::array<std::int32_t, 5> values_{};
  bool drop_high_ = true;
};

}  // namespace cilantro::laz
