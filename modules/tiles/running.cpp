// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>
module cilantro.tiles;

import cilantro.eigen;
import cilantro.search;
import :loading;
import :region;
import :running;
import :survey;

namespace cilantro {
namespace {

/// Distances in S may be rounded down to what a step still looks at.
constexpr double more_than_rounding = 1e-5;

bool looks_around(const step_reach& reach) {
  return reach.distance > 0 || reach.neighbors > 0;
}

/// A place whose nearest points were not all known to step number `needed_by`.
template <int D>
struct wanted_ball {
  std::size_t needed_by;
  typename tile_region<D>::ball ball;
};

template <Scalar S, int D>
class tile_run {
 public:
  tile_run(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
           const tile_info& tile, double halo, const std::stop_token& stop)
      : survey_{survey}, steps_{steps}, tile_{tile}, halo_{halo}, stop_{stop} {
    for (const auto& step : steps) margins_.push_back(first_margin(step.reach));
  }

  point_cloud<S, D> operator()() {
    for (;;) {
      auto cloud = load_region<S, D>(survey_, region_before(0), stop_);
      if (pass(cloud)) return cloud;
    }
  }

 private:
  /// How far the points of a tile are apart, if they lie on a surface.
  [[nodiscard]] double spacing() const {
    return survey_.edge / std::sqrt(double(std::max<std::uint64_t>(1, tile_.points)));
  }

  double first_margin(const step_reach& reach) {
    if (!looks_around(reach)) return 0;
    // Of what comes later, no more is known than that it is not denser.
    coarsest_ = std::max(coarsest_, reach.distance);
    double margin = reach.distance * (1 + more_than_rounding) + survey_.slack();
    if (reach.neighbors > 0)
      margin += 3 * std::max(spacing(), coarsest_) * std::sqrt(double(reach.neighbors + 1));
    return margin;
  }

  /// What has to be known before step number `s`, or after all of them.
  [[nodiscard]] tile_region<D> region_before(std::size_t s) const {
    double margin = halo_;
    for (std::size_t i = s; i < margins_.size(); ++i) margin += margins_[i];
    tile_region<D> region{tile_, survey_.edge, margin, survey_.bounds};
    for (const auto& wanted : wanted_) {
      if (wanted.needed_by < s) continue;
      auto ball = wanted.ball;
      for (std::size_t i = s; i < wanted.needed_by; ++i) ball.radius += margins_[i];
      region.add(ball);
    }
    return region;
  }

  /// Sends the cloud through the steps; false if it turns out that more points have to be known.
  bool pass(point_cloud<S, D>& cloud) {
    std::size_t end_of_looking = 0;
    for (std::size_t s = 0; s < steps_.size(); ++s)
      if (looks_around(steps_[s].reach)) end_of_looking = s + 1;
    if (end_of_looking == 0) keep_result(cloud);
    for (std::size_t s = 0; s < steps_.size(); ++s) {
      if (stop_.stop_requested()) throw cancelled{};
      if (steps_[s].reach.neighbors > 0 && !knows_neighbors(cloud, s)) return false;
      cloud = steps_[s].apply(std::move(cloud));
      if (s + 1 == end_of_looking)
        keep_result(cloud);
      else if (s + 1 < end_of_looking && looks_around(steps_[s].reach))
        keep_region(cloud, region_before(s + 1));
    }
    return true;
  }

  template <class F>
  void keep_if(point_cloud<S, D>& cloud, F wanted) {
    index_list kept;
    for (index_t i = 0; i < cloud.size(); ++i)
      if (wanted(i)) kept.push_back(static_cast<std::int32_t>(i));
    if (std::ssize(kept) < cloud.size()) cloud = select(std::move(cloud), kept);
  }
  void keep_region(point_cloud<S, D>& cloud, const tile_region<D>& region) {
    keep_if(cloud, [&](index_t i) { return region.contains(place_of(cloud, i)); });
  }
  void keep_result(point_cloud<S, D>& cloud) {
    if (halo_ > 0)
      keep_region(cloud, tile_region<D>{tile_, survey_.edge, halo_, survey_.bounds});
    else
      keep_if(cloud, [&](index_t i) { return is_in_tile(cloud, i, tile_, survey_.edge); });
  }
  [[nodiscard]] static point_vector<double, D> place_of(const point_cloud<S, D>& cloud, index_t i) {
    return world_of<S, D>(cloud.points.col(i), cloud.origin);
  }

  /// Whether, of all points that step `s` must get right, the nearest ones are known, and not just
  /// some of those that are. If not, more is asked for.
  bool knows_neighbors(const point_cloud<S, D>& cloud, std::size_t s) {
    const auto known = region_before(s);
    if (known.is_everything() || cloud.empty()) return true;
    const auto after = region_before(s + 1);
    // A step may count the point itself, or not.
    const index_t needed = steps_[s].reach.neighbors + 1;
    const index_list doubtful = far_from_enough(cloud, after, margins_[s], needed);
    if (doubtful.empty()) return true;

    point_matrix<S, D> queries(D, std::ssize(doubtful));
    for (index_t q = 0; q < queries.cols(); ++q) queries.col(q) = cloud.points.col(doubtful[q]);
    const kd_tree<S, D> tree{cloud.points};
    const auto near = tree.find_all(queries, knn{needed});
    std::vector<typename tile_region<D>::ball> unknown;
    bool is_thin = false;
    for (index_t q = 0; q < queries.cols(); ++q) {
      const auto distances = near[q].distances();
      if (std::ssize(distances) < needed) {
        is_thin = true;
        break;
      }
      const auto place = place_of(cloud, doubtful[q]);
      const double distance = double(distances.back()) * (1 + more_than_rounding) + survey_.slack();
      if (distance > known.margin_of(place)) unknown.push_back({place, distance});
    }
    if (!is_thin && unknown.empty()) return true;
    constexpr std::ptrdiff_t many = 64;
    merge(unknown);
    if (is_thin || std::ssize(unknown) > many) {
      margins_[s] *= 2;
    } else {
      for (const auto& ball : unknown) wanted_.push_back({s, ball});
    }
    return false;
  }

  /// The points of a region in whose cell there are fewer than `needed` points, cells being so
  /// small that all points of one are less than `distance` apart.
  static index_list far_from_enough(const point_cloud<S, D>& cloud, const tile_region<D>& region,
                                    double distance, index_t needed) {
    const voxel_grid grid{cloud.points, voxel_size{0.999 * distance / std::sqrt(double(D))}};
    index_list few;
    for (const auto cell : grid)
      if (std::ssize(cell) < needed)
        for (const auto i : cell)
          if (region.contains(place_of(cloud, i))) few.push_back(i);
    return few;
  }

  /// Balls that reach into each other become one, unless that would be much larger.
  static void merge(std::vector<typename tile_region<D>::ball>& balls) {
    std::vector<typename tile_region<D>::ball> merged;
    for (const auto& ball : balls) {
      const auto near = std::ranges::find_if(merged, [&](const auto& other) {
        return (other.center - ball.center).norm() + ball.radius <= 2 * other.radius;
      });
      if (near == merged.end())
        merged.push_back(ball);
      else
        near->radius = std::max(near->radius, (near->center - ball.center).norm() + ball.radius);
    }
    balls = std::move(merged);
  }

  const tile_survey<D>& survey_;
  std::span<const tile_step<S, D>> steps_;
  const tile_info& tile_;
  double halo_;
  const std::stop_token& stop_;
  double coarsest_ = 0;
  std::vector<double> margins_;  ///< How much more each step needs than it gives.
  std::vector<wanted_ball<D>> wanted_;
};

}  // namespace

template <Scalar S, int D>
bool is_in_tile(const point_cloud<S, D>& cloud, index_t i, const tile_info& tile, double edge) {
  const auto place = world_of<S, D>(cloud.points.col(i), cloud.origin);
  return is_finite(place) && key_of(place, edge) == tile_key{tile.x, tile.y};
}

template <Scalar S, int D>
point_cloud<S, D> run_tile(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
                           const tile_info& tile, double halo, const std::stop_token& stop) {
  return tile_run<S, D>{survey, steps, tile, halo, stop}();
}

template <Scalar S, int D>
std::uint64_t memory_of(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
                        const tile_info& tile, double halo) {
  double margin = halo;
  for (const auto& step : steps) margin += step.reach.distance;
  const double edge = survey.edge, with_margin = (edge + 2 * margin) / edge;
  const double points =
      std::min(double(tile.points) * with_margin * with_margin, double(survey.points));
  constexpr double of_readers = 3e6;
  const double bytes = points * bytes_per_point<S, D>(survey.parts) + of_readers;
  expects(bytes <= double(survey.memory),
          "a tile of " + std::to_string(tile.points) + " points may take " +
              std::to_string(std::llround(bytes / 1e6)) +
              " MB with its surroundings, and the memory is " +
              std::to_string(survey.memory / 1'000'000) +
              " MB: open the tiles with a smaller edge, or more memory");
  return static_cast<std::uint64_t>(bytes);
}

#define CILANTRO_INSTANTIATE(S, D)                                                             \
  template bool is_in_tile(const point_cloud<S, D>&, index_t, const tile_info&, double);       \
  template point_cloud<S, D> run_tile(const tile_survey<D>&, std::span<const tile_step<S, D>>, \
                                      const tile_info&, double, const std::stop_token&);       \
  template std::uint64_t memory_of(const tile_survey<D>&, std::span<const tile_step<S, D>>,    \
                                   const tile_info&, double);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
