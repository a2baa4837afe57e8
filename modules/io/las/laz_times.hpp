// SPDX-License-Identifier: MIT
//
// How LAZ files code times: as multiples of the last difference, in up to four sequences between
// which they change. A plain header, which needs nothing of any module.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "io/common/byte_stream.hpp"
#include "io/las/laz_coder.hpp"

namespace cilantro::laz {

/// Times as the integers that have the same bits. In files of LAS 1.4 it is coded elsewhere whether
/// a time is that of the point before.
class time_sequences {
 public:
  explicit time_sequences(std::int64_t first, bool can_repeat)
      : times_{first}, can_repeat_{can_repeat} {}

  std::int64_t next(decoder& in) {
    // Damaged data could change from sequence to sequence for ever.
    for (int changes = 0; changes < most_changes; ++changes)
      if (step(in)) return times_[last_];
    throw detail::failure{"the compressed times are damaged", false, 0};
  }

 private:
  static constexpr std::int32_t most = 500, least = -10;
  static constexpr int most_changes = 8;

  /// Whether a time was found; otherwise the sequence has changed.
  bool step(decoder& in) {
    return differences_[last_] == 0 ? step_without_difference(in) : step_by_multiple(in);
  }

  bool step_without_difference(decoder& in) {
    if (without_.empty()) without_.begin(can_repeat_ ? 6 : 5);
    int symbol = static_cast<int>(in.symbol(without_));
    if (can_repeat_ && symbol-- == 0) return true;
    if (symbol == 0) {
      differences_[last_] = integers_.decode(in, 0, 0);
      advance(differences_[last_]);
      extremes_[last_] = 0;
      return true;
    }
    if (symbol == 1) {
      begin_sequence(in);
      return true;
    }
    change(symbol - 1);
    return false;
  }

  bool step_by_multiple(decoder& in) {
    constexpr int multiples = most - least + 1;
    if (multiples_.empty()) multiples_.begin(multiples + (can_repeat_ ? 5 : 4));
    int symbol = static_cast<int>(in.symbol(multiples_));
    if (symbol < multiples) {
      advance(difference(in, symbol));
      return true;
    }
    symbol -= multiples;
    if (can_repeat_ && symbol-- == 0) return true;
    if (symbol == 0) {
      begin_sequence(in);
      return true;
    }
    change(symbol);
    return false;
  }

  /// The difference that a symbol says to be about a multiple of the last one.
  std::int32_t difference(decoder& in, int symbol) {
    const auto times_last = [&](std::int32_t factor) {
      return static_cast<std::int32_t>(static_cast<std::uint32_t>(factor) *
                                       static_cast<std::uint32_t>(differences_[last_]));
    };
    if (symbol == 1) {
      extremes_[last_] = 0;
      return integers_.decode(in, differences_[last_], 1);
    }
    if (symbol == 0) return note_extreme(integers_.decode(in, 0, 7));
    if (symbol < most) return integers_.decode(in, times_last(symbol), symbol < 10 ? 2 : 3);
    if (symbol == most) return note_extreme(integers_.decode(in, times_last(most), 4));
    const std::int32_t negative = most - symbol;
    if (negative > least) return integers_.decode(in, times_last(negative), 5);
    return note_extreme(integers_.decode(in, times_last(least), 6));
  }

  /// What was out of range often enough becomes the difference to multiply.
  std::int32_t note_extreme(std::int32_t difference) {
    if (++extremes_[last_] > 3) {
      differences_[last_] = difference;
      extremes_[last_] = 0;
    }
    return difference;
  }

  void advance(std::int32_t difference) {
    times_[last_] = static_cast<std::int64_t>(static_cast<std::uint64_t>(times_[last_]) +
                                              static_cast<std::uint64_t>(std::int64_t{difference}));
  }

  /// A time that is far from all others.
  void begin_sequence(decoder& in) {
    newest_ = (newest_ + 1) & 3;
    const auto high = static_cast<std::uint32_t>(
        integers_.decode(in, static_cast<std::int32_t>(times_[last_] >> 32), 8));
    times_[newest_] = static_cast<std::int64_t>(std::uint64_t{high} << 32 | in.bits(32));
    last_ = newest_;
    differences_[last_] = 0;
    extremes_[last_] = 0;
  }

  void change(int by) { last_ = (last_ + static_cast<std::size_t>(by)) & 3; }

  std::array<std::int64_t, 4> times_{};
  std::array<std::int32_t, 4> differences_{}, extremes_{};
  std::size_t last_ = 0, newest_ = 0;
  bool can_repeat_;
  symbol_model without_, multiples_;
  integer_model integers_{32, 9};
};

}  // namespace cilantro::laz
