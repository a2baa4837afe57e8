// SPDX-License-Identifier: MIT
module cilantro.core;

namespace cilantro {

exact_sum& exact_sum::add_special(double x) {
  ++limbs_[std::isnan(x) ? nans : x > 0 ? infinities : negative_infinities];
  return *this;
}

void exact_sum::pass_carries() {
  // The last limb keeps the sign, and what no other can hold.
  for (std::size_t i = 0; i + 1 < number_limbs; ++i) {
    limbs_[i + 1] += limbs_[i] >> 32;
    limbs_[i] &= static_cast<std::int64_t>(low);
  }
  room_ = most_room;
}

exact_sum& exact_sum::operator+=(const exact_sum& other) {
  const int used = most_room - room_, used_by_other = most_room - other.room_;
  if (used + used_by_other >= most_room) {
    exact_sum reduced = other;
    reduced.pass_carries();
    pass_carries();
    return *this += reduced;
  }
  for (std::size_t i = 0; i < limb_count; ++i) limbs_[i] += other.limbs_[i];
  // One for what carries had left in both.
  room_ = most_room - (used + used_by_other + 1);
  return *this;
}

std::span<std::int64_t, exact_sum::limb_count> exact_sum::limbs() {
  pass_carries();
  // What is written there may be a sum of many.
  room_ = 0;
  return limbs_;
}

bool exact_sum::operator==(const exact_sum& other) const {
  exact_sum a = *this, b = other;
  a.pass_carries();
  b.pass_carries();
  return a.limbs_ == b.limbs_;
}

double exact_sum::value() const {
  if (limbs_[nans] > 0 || (limbs_[infinities] > 0 && limbs_[negative_infinities] > 0))
    return std::numeric_limits<double>::quiet_NaN();
  if (limbs_[infinities] > 0) return std::numeric_limits<double>::infinity();
  if (limbs_[negative_infinities] > 0) return -std::numeric_limits<double>::infinity();

  exact_sum magnitude = *this;
  magnitude.pass_carries();
  const bool negative = magnitude.limbs_[number_limbs - 1] < 0;
  if (negative) {
    for (std::int64_t& limb : magnitude.limbs_) limb = -limb;
    magnitude.pass_carries();
  }
  const auto limbs = std::span{magnitude.limbs_}.first(number_limbs);
  auto top = static_cast<std::ptrdiff_t>(number_limbs) - 1;
  while (top >= 0 && limbs[static_cast<std::size_t>(top)] == 0) --top;
  if (top < 0) return 0;

  // The three highest limbs, which have more bits than a double, and whether anything is below.
  const auto limb = [&](std::ptrdiff_t i) {
    return static_cast<unsigned __int128>(i < 0 ? 0 : limbs[static_cast<std::size_t>(i)]);
  };
  const unsigned __int128 highest = limb(top) << 64 | limb(top - 1) << 32 | limb(top - 2);
  const int bits = 64 + static_cast<int>(std::bit_width(static_cast<std::uint64_t>(limb(top))));
  const int exponent = 32 * static_cast<int>(top - 2) - 2 * static_cast<int>(one_factor);
  // The last place of the result has the weight of that of subnormal numbers, or more.
  const int last_place = std::max(exponent + bits - 53, -static_cast<int>(one_factor));
  const int dropped = last_place - exponent;
  if (dropped > bits) return negative ? -0.0 : 0.0;
  const unsigned __int128 one = 1, rest = highest & ((one << dropped) - 1),
                          half = one << (dropped - 1);
  auto kept = static_cast<std::uint64_t>(highest >> dropped);
  const bool below = top > 2 && std::ranges::any_of(limbs.first(static_cast<std::size_t>(top - 2)),
                                                    [](std::int64_t limb) { return limb != 0; });
  if (rest > half || (rest == half && (below || kept % 2 == 1))) ++kept;
  const double size = std::ldexp(static_cast<double>(kept), last_place);
  return negative ? -size : size;
}

}  // namespace cilantro
