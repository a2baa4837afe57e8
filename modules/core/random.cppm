// SPDX-License-Identifier: MIT
export module cilantro.core:random;

import cilantro.standard;
import :error;
import :points;

namespace cilantro {

/// A stream of random numbers that is determined by a seed and an index. Give every point, sample
/// or restart its own index, and no result depends on the order or the thread in which the numbers
/// are drawn.
///
/// The numbers are the same with every compiler and on every machine, unlike those of the standard
/// distributions. Also a `std::uniform_random_bit_generator`. Not for cryptography.
/// Source: SplitMix64 (Steele, Lea & Flood 2014), started at a state mixed from seed and index.
export class random_stream {
 public:
  using result_type = std::uint64_t;

  explicit random_stream(std::uint64_t seed, std::uint64_t index = 0)
      : state_{mix(seed + golden) ^ mix(index * golden + 0x632be59bd9b4e019u)} {}

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return std::numeric_limits<result_type>::max(); }
  result_type operator()() { return mix(state_ += golden); }

  /// Uniform in [0, 1), a multiple of 2⁻⁵³.
  double uniform() { return static_cast<double>((*this)() >> 11) * 0x1p-53; }
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Uniform in [0, n), without bias. Throws `invalid_input` unless n > 0.
  /// Source: Lemire 2019, "Fast random integer generation in an interval", algorithm 5.
  index_t below(index_t n) {
    expects(n > 0, "random_stream::below: the bound must be positive");
    const auto range = static_cast<std::uint64_t>(n);
    auto product = static_cast<unsigned __int128>((*this)()) * range;
    if (static_cast<std::uint64_t>(product) < range) {
      const std::uint64_t reject = -range % range;
      while (static_cast<std::uint64_t>(product) < reject)
        product = static_cast<unsigned __int128>((*this)()) * range;
    }
    return static_cast<index_t>(product >> 64);
  }

  /// Approximately normal with mean 0 and variance 1, within ±6: the sum of twelve uniforms. Unlike
  /// the exact methods it needs no logarithm, which differs between standard libraries.
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }

 private:
  static constexpr std::uint64_t golden = 0x9e3779b97f4a7c15u;
  static constexpr std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

/// `count` different indices out of [0, n), increasing; every such set is equally likely. Throws
/// `invalid_input` unless 0 <= count <= n < 2³¹. O(count²) for counts up to 256, O(n) beyond.
/// Source: Floyd's algorithm (Bentley & Floyd 1987).
export [[nodiscard]] inline index_list distinct_sample(index_t n, index_t count,
                                                       random_stream random) {
  expects(0 <= count && count <= n, "distinct_sample: count must be between 0 and n");
  expects(n <= std::numeric_limits<std::int32_t>::max(), "distinct_sample: n must be below 2^31");
  index_list sample;
  sample.reserve(count);
  // For the few indices of a typical sample, a sorted vector is faster than any set.
  if (count > 256) {
    std::vector<bool> taken(n);
    for (index_t j = n - count; j < n; ++j) {
      const index_t i = random.below(j + 1);
      taken[taken[i] ? j : i] = true;
    }
    for (index_t i = 0; i < n; ++i)
      if (taken[i]) sample.push_back(static_cast<std::int32_t>(i));
    return sample;
  }
  for (index_t j = n - count; j < n; ++j) {
    const index_t i = random.below(j + 1);
    const auto place = std::ranges::lower_bound(sample, i);
    if (place == sample.end() || *place != i)
      sample.insert(place, static_cast<std::int32_t>(i));
    else
      sample.push_back(static_cast<std::int32_t>(j));
  }
  return sample;
}

/// Shuffles the elements of `range`, in place; every order is equally likely.
/// Source: Fisher–Yates, as in Knuth's algorithm P.
export template <std::ranges::random_access_range R>
  requires std::permutable<std::ranges::iterator_t<R>>
void shuffle(R&& range, random_stream random) {
  const auto first = std::ranges::begin(range);
  for (index_t i = static_cast<index_t>(std::ranges::distance(range)) - 1; i > 0; --i)
    std::ranges::iter_swap(first + i, first + random.below(i + 1));
}

}  // namespace cilantro
