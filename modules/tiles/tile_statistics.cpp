// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import :exact_moments;
import :survey;
import :tile_sums;

namespace cilantro {
namespace {

/// A box that grows by boxes.
template <int D>
struct extent_sum : extent<D> {
  extent_sum& operator+=(const extent_sum& other) {
    this->add(static_cast<const extent<D>&>(other));
    return *this;
  }
};

struct value_sums : moment_sums<1> {
  double least = std::numeric_limits<double>::infinity(),
         most = -std::numeric_limits<double>::infinity();

  void add(double value) {
    moment_sums::add(std::array{value});
    least = std::min(least, value);
    most = std::max(most, value);
  }
  value_sums& operator+=(const value_sums& other) {
    moment_sums::operator+=(other);
    least = std::min(least, other.least);
    most = std::max(most, other.most);
    return *this;
  }
};

}  // namespace

template <Scalar S, int D>
std::optional<moments<S, D>> mean_and_covariance(const tiled_cloud<S, D>& cloud,
                                                 const reduce_tiles_options& options) {
  const auto all = reduce_tiles(
      cloud, halo{0}, moment_sums<D>{},
      [origin = cloud.origin()](tile<S, D>& t, moment_sums<D>& sums) {
        relate_to(origin, t.cloud);
        for (const index_t i : t.inside) sums.add(t.cloud.points.col(i));
      },
      options);
  if (all.count == 0) return std::nullopt;
  return moments<S, D>{all.count, all.mean().template cast<S>(), all.covariance()};
}

template <Scalar S, int D>
std::optional<box> bounds_of(const tiled_cloud<S, D>& cloud, const reduce_tiles_options& options) {
  const auto all = reduce_tiles(
      cloud, halo{0}, extent_sum<D>{},
      [](const tile<S, D>& t, extent_sum<D>& sum) {
        const auto origin = t.cloud.full_origin();
        for (const index_t i : t.inside) sum.add(world_of<S, D>(t.cloud.points.col(i), origin));
      },
      options);
  if (all.empty()) return std::nullopt;
  return box{all.lower, all.upper};
}

template <Scalar S, int D>
std::optional<attribute_statistics> statistics_of(const tiled_cloud<S, D>& cloud,
                                                  std::string_view attribute,
                                                  const reduce_tiles_options& options) {
  const auto all = reduce_tiles(
      cloud, halo{0}, value_sums{},
      [&](const tile<S, D>& t, value_sums& sums) {
        const auto values = t.cloud.template attribute_to<double>(attribute);
        for (const index_t i : t.inside)
          if (std::isfinite(values[i])) sums.add(values[i]);
      },
      options);
  if (all.count == 0) return std::nullopt;
  return attribute_statistics{all.count, all.least, all.most, all.mean()[0],
                              std::sqrt(all.covariance()(0, 0))};
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template std::optional<moments<S, D>> mean_and_covariance(const tiled_cloud<S, D>&,           \
                                                            const reduce_tiles_options&);       \
  template std::optional<box> bounds_of(const tiled_cloud<S, D>&, const reduce_tiles_options&); \
  template std::optional<attribute_statistics> statistics_of(                                   \
      const tiled_cloud<S, D>&, std::string_view, const reduce_tiles_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
