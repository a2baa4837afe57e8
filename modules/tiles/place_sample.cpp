// SPDX-License-Identifier: MIT
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

/// The `count` least, each once and in order.
template <class T>
std::vector<T> least_of(std::vector<T> all, index_t count) {
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
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
  const auto highest_of_interest = [&] {
    const std::scoped_lock lock{mutex};
    return std::ssize(least) == count ? least.back().hash : ~std::uint64_t{0};
  };
  const auto points = sum_over_tiles(cloud, std::vector<index_t>{0}, monitor,
                                     [&](point_cloud<S, D> tile, std::vector<index_t>& sum) {
                                       relate_to(cloud.origin(), tile);
                                       const auto highest = highest_of_interest();
                                       std::vector<entry> found;
                                       for (index_t i = 0; i < tile.size(); ++i) {
                                         if (!is_finite(tile.points.col(i))) continue;
                                         ++sum[0];
                                         const auto next = hashed<S, D>(tile.points.col(i), seed);
                                         if (next.hash <= highest) found.push_back(next);
                                       }
                                       found = least_of(std::move(found), count);
                                       const std::scoped_lock lock{mutex};
                                       least.insert(least.end(), found.begin(), found.end());
                                       least = least_of(std::move(least), count);
                                     });
  least = least_of(gather_all(cloud.ranks().get(), least), count);
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
