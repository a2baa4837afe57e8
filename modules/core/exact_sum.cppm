// SPDX-License-Identifier: MIT
export module cilantro.core:exact_sum;

import cilantro.standard;

namespace cilantro {

/// A sum of doubles, and of products of two, without any rounding: the same bits in whatever order
/// they are added, and however they are split between threads, files and machines.
///
/// Exact for all finite numbers, subnormal ones included, for up to 2⁵⁹ of them. Infinities and NaN
/// are counted apart, and make the value what IEEE 754 says of a sum that has them; an infinity
/// times zero is NaN.
///
/// A fixed-point number of 4,224 bits and a sign, in limbs that overlap: each holds 32 bits, and
/// room for 2,047 additions before carries are passed on. About 1.1 kB, so have one for many
/// numbers, not many for one each. An addition is O(1); `value`, `==` and adding sums are O(limbs).
/// Source: Neal 2015, "Fast exact summation using small and large superaccumulators", section 3,
/// with limbs for products, too.
export class exact_sum {
 public:
  /// How many integers `limbs` gives.
  static constexpr std::size_t limb_count = 135;

  /// Adds a number.
  inline exact_sum& operator+=(double x) {
    const parts of = parts_of(x);
    if (of.special) return add_special(x);
    make_room();
    const std::uint64_t position = of.position + one_factor, shift = position % 32;
    std::int64_t* const limb = limbs_.data() + position / 32;
    add(limb[0], of.mantissa << shift & low, of.sign);
    add(limb[1], of.mantissa >> (32 - shift), of.sign);
    return *this;
  }

  /// Adds a · b without rounding or underflow.
  inline exact_sum& add_product(double a, double b) {
    const parts of_a = parts_of(a), of_b = parts_of(b);
    if (of_a.special || of_b.special) return add_special(a * b);
    make_room();
    const auto product = static_cast<unsigned __int128>(of_a.mantissa) * of_b.mantissa;
    const std::uint64_t position = of_a.position + of_b.position, shift = position % 32;
    const std::int64_t sign = of_a.sign ^ of_b.sign;
    std::int64_t* const limb = limbs_.data() + position / 32;
    const auto rest = static_cast<unsigned __int128>(product >> (32 - shift));
    add(limb[0], static_cast<std::uint64_t>(product) << shift & low, sign);
    add(limb[1], static_cast<std::uint64_t>(rest) & low, sign);
    add(limb[2], static_cast<std::uint64_t>(rest >> 32) & low, sign);
    add(limb[3], static_cast<std::uint64_t>(rest >> 64), sign);
    return *this;
  }

  /// Adds another sum.
  exact_sum& operator+=(const exact_sum& other);

  /// The sum, rounded once: to the nearest double, of two to the even one. Infinite where it is too
  /// large for a double. 0 is +0.
  [[nodiscard]] double value() const;

  /// The sum as integers: those of two sums, added one by one, are those of the sum of both. So
  /// ranks add theirs with what adds integers, in any order, up to 2³⁰ sums at once, and write the
  /// result here before the sum is used again. As given, the limbs of equal sums are equal.
  [[nodiscard]] std::span<std::int64_t, limb_count> limbs();

  /// Whether both are the same number, and count the same infinities and NaNs.
  [[nodiscard]] bool operator==(const exact_sum& other) const;

 private:
  // After those of the number: how many infinities, negative ones and NaNs there were.
  static constexpr std::size_t number_limbs = 132, infinities = 132, negative_infinities = 133,
                               nans = 134;
  // What an addition adds to a limb is below 2⁵², and what carries leave there below 2³².
  static constexpr int most_room = 2047;
  static constexpr std::uint64_t low = 0xffffffff;
  // Bit 0 stands for 2⁻²¹⁴⁸, the least product; the least double is 2⁻¹⁰⁷⁴.
  static constexpr std::uint64_t one_factor = 1074;

  struct parts {
    std::uint64_t mantissa, position;  // The number is ± mantissa · 2^(position - 1074).
    std::int64_t sign;                 // 0 or -1.
    bool special;                      // Infinite or NaN.
  };
  static inline parts parts_of(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const std::uint64_t exponent = bits >> 52 & 0x7ff;
    // Subnormal numbers weigh as those of exponent 1, without the leading bit.
    const std::uint64_t leading = exponent != 0;
    return {(bits & 0xfffffffffffff) | leading << 52, exponent - leading,
            static_cast<std::int64_t>(bits) >> 63, exponent == 0x7ff};
  }
  static inline void add(std::int64_t& limb, std::uint64_t amount, std::int64_t sign) {
    limb += (static_cast<std::int64_t>(amount) ^ sign) - sign;
  }
  inline void make_room() {
    if (room_ == 0) pass_carries();
    --room_;
  }

  exact_sum& add_special(double x);
  void pass_carries();

  std::array<std::int64_t, limb_count> limbs_{};
  int room_ = most_room;  // How many more additions no limb can overflow by.
};

}  // namespace cilantro
