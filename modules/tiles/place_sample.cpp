// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <bit>
#include <compare>
#include <cstdint>
#include <iterator>
#include <mutex>
#include <vector>
module cilantro.tiles;

import cilantro.eigen;
import :place_sample;
import :ranks;
import :tile_sums;

namespace cilantro {
namespace {

template <Scalar S, int D>
struct hashed_place {
  std::uint64_t hash = 0;
  std::array<S, D> place{};

  auto operator<=>(const hashed_place&) const = default;
};

template <Scalar S, int D, class P>
hashed_place<S, D> hashed(const P& point, std::uint64_t seed) {
  hashed_place<S, D> next{seed, {}};
  for (int d = 0; d < D; ++d) {
    const S coordinate = point[d] + S(0);  // −0 is where 0 is.
    next.place[d] = coordinate;
    next.hash = random_stream{next.hash, std::bit_cast<std::uint64_t>(double(coordinate))}();
  }
  return next;
}

/// Keeps the `count` least, each once.
template <class T>
void keep_least(std::vector<T>& all, index_t count) {
  std::ranges::sort(all, [](const T& a, const T& b) { return a < b; });
  all.erase(std::unique(all.begin(), all.end()), all.end());
  if (std::ssize(all) > count) all.resize(count);
}

/// The `count` least of two that are sorted, each once.
template <class T>
std::vector<T> least_of(const std::vector<T>& a, const std::vector<T>& b, index_t count) {
  std::vector<T> all;
  all.reserve(a.size() + b.size());
  std::ranges::set_union(a, b, std::back_inserter(all));
  if (std::ssize(all) > count) all.resize(count);
  return all;
}

}  // namespace

template <Scalar S, int D>
place_sample<S, D> sample_places(const tiled_cloud<S, D>& cloud, index_t count, std::uint64_t seed,
                                 const task_monitor& monitor) {
  using entry = hashed_place<S, D>;
  std::vector<entry> least;
  std::mutex mutex;
  const auto points = sum_over_tiles(cloud, std::vector<index_t>{0}, monitor,
                                     [&](point_cloud<S, D> tile, std::vector<index_t>& sum) {
                                       relate_to(cloud.origin(), tile);
                                       std::uint64_t highest = ~std::uint64_t{0};
                                       {
                                         const std::scoped_lock lock{mutex};
                                         if (std::ssize(least) == count)
                                           highest = least.back().hash;
                                       }
                                       std::vector<entry> found;
                                       for (index_t i = 0; i < tile.size(); ++i) {
                                         if (!is_finite(tile.points.col(i))) continue;
                                         ++sum[0];
                                         const auto next = hashed<S, D>(tile.points.col(i), seed);
                                         if (next.hash <= highest) found.push_back(next);
                                       }
                                       keep_least(found, count);
                                       const std::scoped_lock lock{mutex};
                                       least = least_of(least, found, count);
                                     });
  least = gather_all(cloud.ranks().get(), least);
  keep_least(least, count);
  place_sample<S, D> sample{points[0], point_matrix<S, D>(D, std::ssize(least))};
  for (index_t i = 0; i < std::ssize(least); ++i)
    for (int d = 0; d < D; ++d) sample.places(d, i) = least[i].place[d];
  return sample;
}

#define CILANTRO_INSTANTIATE(S, D)                                                            \
  template place_sample<S, D> sample_places(const tiled_cloud<S, D>&, index_t, std::uint64_t, \
                                            const task_monitor&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
