// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>
module cilantro.tiles;

import cilantro.eigen;
import cilantro.search;
import :loading;
import :places;
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

/// The points among the `wanted` ones of which it is not certain that `needed` points are at most
/// `distance` away: cells are so small that all points of one and of those around it are.
template <Scalar S, int D, class F>
index_list alone(const point_matrix<S, D>& points, double distance, index_t needed, F wanted) {
  const voxel_grid grid{points, voxel_size{0.999 * distance / (2 * std::sqrt(double(D)))}};
  using cell_type = std::array<std::int64_t, D>;
  std::vector<cell_type> cells;  // In the order of the grid.
  cells.reserve(grid.size());
  for (index_t c = 0; c < grid.size(); ++c) {
    const auto cell = grid.cell(c);
    std::ranges::copy(cell, cells.emplace_back().begin());
  }
  constexpr int around = D == 2 ? 9 : 27;
  index_list found;
  for (index_t c = 0; c < grid.size(); ++c) {
    const auto members = grid[c];
    index_t count = std::ssize(members);
    if (count >= needed || std::ranges::none_of(members, wanted)) continue;
    for (int n = 0; n < around && count < needed; ++n) {
      auto neighbor = cells[c];
      for (int d = 0, rest = n; d < D; ++d, rest /= 3) neighbor[d] += rest % 3 - 1;
      if (neighbor == cells[c]) continue;
      const auto at = std::ranges::lower_bound(cells, neighbor);
      if (at != cells.end() && *at == neighbor) count += std::ssize(grid[at - cells.begin()]);
    }
    if (count < needed) std::ranges::copy_if(members, std::back_inserter(found), wanted);
  }
  return found;
}

/// How far the points of a tile are apart, if they lie on a surface that fills it; in a tile at the
/// rim, or of a few stray points, as far as in others. To guess too little costs another look, and
/// too much costs memory.
template <int D>
double spacing_of(const tile_survey<D>& survey, const tile_info& tile) {
  const double usual = double(survey.points) / double(survey.tiles.size());
  const auto& bounds = survey.bounds;
  const double size =
      std::max(bounds.upper[0] - bounds.lower[0], bounds.upper[1] - bounds.lower[1]);
  const double edge = size > 0 ? std::min(survey.edge, size) : survey.edge;
  return edge / std::sqrt(std::max({1.0, double(tile.points), usual}));
}

/// How much more each step needs to know than it gives; where it looks at nearest points, a guess.
template <Scalar S, int D>
std::vector<double> first_margins(const tile_survey<D>& survey,
                                  std::span<const tile_step<S, D>> steps, const tile_info& tile) {
  std::vector<double> margins;
  double coarsest = spacing_of(survey, tile);
  for (const auto& step : steps) {
    const auto& reach = step.reach;
    // Of what comes later, no more is known than that it is not denser.
    coarsest = std::max(coarsest, reach.distance);
    double margin = looks_around(reach)
                        ? reach.distance * (1 + more_than_rounding) + survey.template slack<S>()
                        : 0;
    if (reach.neighbors > 0) margin += 2 * coarsest * std::sqrt(double(reach.neighbors + 1));
    margins.push_back(margin);
  }
  return margins;
}

template <Scalar S, int D>
class tile_run {
 public:
  tile_run(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
           const tile_info& tile, double halo, const std::stop_token& stop, place_notes places)
      : survey_{survey}, steps_{steps}, tile_{tile}, halo_{halo}, stop_{stop} {
    margins_ = first_margins<S, D>(survey, steps, tile);
    if (places == place_notes::kept) places_from_ = first_with_places(survey, steps);
  }

  point_cloud<S, D> operator()() {
    auto known = region_before(0);
    auto loaded = load_region<S, D>(survey_, known, stop_);
    if (foresee(loaded.cloud)) {
      const auto more = load_region<S, D>(survey_, region_before(0).balls(), stop_, &known);
      loaded = merged(std::move(loaded), more);
    }
    while (!pass(loaded)) loaded = load_region<S, D>(survey_, region_before(0), stop_);
    return std::move(loaded.cloud);
  }

 private:
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
  bool pass(loaded_points<S, D>& loaded) {
    auto& cloud = loaded.cloud;
    const bool keeps_places = places_from_ && !gives_places(*places_from_);
    std::size_t end_of_looking = 0, end_of_choosing = 0;
    for (std::size_t s = 0; s < steps_.size(); ++s) {
      if (looks_around(steps_[s].reach)) end_of_looking = s + 1;
      if (steps_[s].chosen) end_of_choosing = s + 1;
    }
    if (keeps_places || end_of_choosing > 0) set_places(cloud, std::move(loaded.order));
    loaded.order = {};
    if (end_of_looking == 0) keep_result(cloud);
    for (std::size_t s = 0; s < steps_.size(); ++s) {
      if (stop_.stop_requested()) throw cancelled{};
      if (steps_[s].reach.neighbors > 0 && !knows_neighbors(cloud, s)) return false;
      if (places_from_ == s && gives_places(s))
        set_places_by_cell(cloud, survey_, *steps_[s].order.cells);
      cloud = steps_[s].apply(std::move(cloud));
      if (s + 1 == end_of_choosing && !keeps_places) drop_places(cloud);
      if (s + 1 == end_of_looking)
        keep_result(cloud);
      else if (s + 1 < end_of_looking && looks_around(steps_[s].reach))
        keep_region(cloud, region_before(s + 1));
    }
    return true;
  }

  [[nodiscard]] bool gives_places(std::size_t s) const { return bool(steps_[s].order.cells); }
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

  /// Asks for what the first step that looks at nearest points will need around points that are
  /// alone, as far as the points before all steps tell; whether there is any. That saves doing the
  /// steps before it twice.
  bool foresee(const point_cloud<S, D>& cloud) {
    const auto looks = std::ranges::find_if(
        steps_, [](const tile_step<S, D>& step) { return step.reach.neighbors > 0; });
    if (looks == steps_.end() || cloud.empty()) return false;
    const auto s = static_cast<std::size_t>(looks - steps_.begin());
    double coarsest = 0;
    for (const auto& step : steps_.first(s)) coarsest = std::max(coarsest, step.reach.distance);
    const auto unknown = unknown_around(cloud, s, [&](double distance) {
      // With fewer points, the nearest ones are farther away.
      return coarsest > 0 ? 1.02 * distance + 2 * coarsest : distance;
    });
    if (!unknown || unknown->empty()) return false;
    for (const auto& ball : *unknown) wanted_.push_back({s, ball});
    return true;
  }

  /// Whether, of all points that step `s` must get right, the nearest ones are known, and not just
  /// some of those that are. If not, more is asked for.
  bool knows_neighbors(const point_cloud<S, D>& cloud, std::size_t s) {
    if (cloud.empty()) return true;
    const auto unknown = unknown_around(cloud, s, [](double distance) { return distance; });
    constexpr std::ptrdiff_t many = 64;
    if (!unknown || std::ssize(*unknown) > many)
      margins_[s] *= 2;
    else
      for (const auto& ball : *unknown) wanted_.push_back({s, ball});
    return unknown && unknown->empty();
  }

  /// What else step `s` needs to know to get its points right: balls around some of them, as large
  /// as `enough` makes the distance of those that are known. Nothing if there are too few points to
  /// tell.
  template <class F>
  std::optional<std::vector<typename tile_region<D>::ball>> unknown_around(
      const point_cloud<S, D>& cloud, std::size_t s, F enough) {
    std::vector<typename tile_region<D>::ball> unknown;
    const auto known = region_before(s);
    if (known.is_everything()) return unknown;
    // A step may count the point itself, or not.
    const index_t needed = steps_[s].reach.neighbors + 1;
    const auto doubtful = doubtful_points(cloud, known, region_before(s + 1), margins_[s], needed);
    if (doubtful.empty()) return unknown;
    if (cloud.size() < needed) return std::nullopt;
    const auto distances = farthest_of_nearest(cloud, doubtful, needed);
    for (std::size_t i = 0; i < doubtful.size(); ++i) {
      const auto place = place_of(cloud, doubtful[i]);
      const double distance =
          enough(double(distances[i]) * (1 + more_than_rounding) + survey_.template slack<S>());
      if (distance > known.margin_of(place)) unknown.push_back({place, distance});
    }
    merge(unknown);
    return unknown;
  }

  /// How far each of some points is from the last of the `needed` points that are nearest to it,
  /// itself among them.
  static std::vector<S> farthest_of_nearest(const point_cloud<S, D>& cloud,
                                            const index_list& points, index_t needed) {
    std::vector<S> farthest;
    constexpr std::ptrdiff_t not_worth_a_tree = 32;
    if (std::ssize(points) <= not_worth_a_tree) {
      Eigen::Matrix<S, dynamic, 1> squares;
      for (const auto i : points) {
        squares = (cloud.points.colwise() - cloud.points.col(i)).colwise().squaredNorm();
        std::ranges::nth_element(squares, squares.begin() + (needed - 1));
        farthest.push_back(std::sqrt(squares[needed - 1]));
      }
      return farthest;
    }
    point_matrix<S, D> queries(D, std::ssize(points));
    for (index_t q = 0; q < queries.cols(); ++q) queries.col(q) = cloud.points.col(points[q]);
    const kd_tree<S, D> tree{cloud.points};
    const auto near = tree.find_all(queries, knn{needed});
    for (index_t q = 0; q < queries.cols(); ++q) farthest.push_back(near[q].distances().back());
    return farthest;
  }

  /// The points of the region `after` of which it is not certain that `needed` points are so near
  /// that no other point, outside of what is known, can be nearer. `margin` is how much is known
  /// around each of them at least.
  static index_list doubtful_points(const point_cloud<S, D>& cloud, const tile_region<D>& known,
                                    const tile_region<D>& after, double margin, index_t needed) {
    // Deep inside, more is known, and a look at large cells is enough, which nearly all are full.
    constexpr double deeper = 4;
    index_list at_border;
    std::vector<char> is_deep(static_cast<std::size_t>(cloud.size()));
    for (index_t i = 0; i < cloud.size(); ++i) {
      const double here = known.margin_of(place_of(cloud, i));
      is_deep[i] = here >= deeper * margin ? 1 : 0;
      if (here < (deeper + 1) * margin) at_border.push_back(static_cast<std::int32_t>(i));
    }
    auto doubtful = alone<S, D>(cloud.points, deeper * margin, needed, [&](std::int32_t i) {
      return is_deep[i] != 0 && after.contains(place_of(cloud, i));
    });
    point_matrix<S, D> border(D, std::ssize(at_border));
    for (index_t k = 0; k < border.cols(); ++k) border.col(k) = cloud.points.col(at_border[k]);
    const auto more = alone<S, D>(border, margin, needed, [&](std::int32_t k) {
      const auto i = at_border[k];
      return is_deep[i] == 0 && after.contains(place_of(cloud, i));
    });
    for (const auto k : more) doubtful.push_back(at_border[k]);
    return doubtful;
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
  std::optional<std::size_t> places_from_;
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
                           const tile_info& tile, double halo, const std::stop_token& stop,
                           place_notes places) {
  return tile_run<S, D>{survey, steps, tile, halo, stop, places}();
}

namespace {

/// How many points tiles have up to `margin` around one of them, if they are spread evenly in each:
/// one with few may be beside one with many.
template <int D>
double points_around(const tile_survey<D>& survey, const tile_info& tile, double margin) {
  constexpr double most_tiles = 16;
  const double edges = margin / survey.edge;
  if (edges > most_tiles) return double(survey.points);
  const auto far = static_cast<std::int64_t>(std::ceil(edges));
  const auto share = [&](std::int64_t from, std::int64_t to) {
    return std::clamp(edges + 1 - double(std::abs(to - from)), 0.0, 1.0);
  };
  double points = 0;
  for (auto x = tile.x - far; x <= tile.x + far; ++x)
    for (auto at = std::ranges::lower_bound(survey.tiles, tile_key{x, tile.y - far}, {},
                                            [](const tile_info& t) { return tile_key{t.x, t.y}; });
         at != survey.tiles.end() && at->x == x && at->y <= tile.y + far; ++at)
      points += double(at->points) * share(tile.x, x) * share(tile.y, at->y);
  return points;
}

}  // namespace

template <Scalar S, int D>
std::uint64_t memory_of(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
                        const tile_info& tile, double halo) {
  double margin = halo;
  for (const double more : first_margins<S, D>(survey, steps, tile)) margin += more;
  const double edge = survey.edge, with_margin = (edge + 2 * margin) / edge;
  const double points = std::min(std::max(double(tile.points) * with_margin * with_margin,
                                          points_around(survey, tile, margin)),
                                 double(survey.points));
  constexpr double of_readers = 3e6;
  double bytes = points * bytes_per_point<S, D>(survey.parts) + of_readers;
  std::optional<tile_area> area{area_of(tile, edge, margin)};
  for (const auto& step : steps) {
    if (step.more_memory) bytes += double(step.more_memory(area));
    if (step.moves_points) area.reset();
  }
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
                                      const tile_info&, double, const std::stop_token&,        \
                                      place_notes);                                            \
  template std::uint64_t memory_of(const tile_survey<D>&, std::span<const tile_step<S, D>>,    \
                                   const tile_info&, double);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
