// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import :loading;
import :lonely_points;
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
  const double spacing = spacing_of(survey, tile);
  double coarsest = spacing;
  for (const auto& step : steps) {
    const auto& reach = step.reach;
    if (step.chosen) coarsest = std::max(coarsest, spacing * std::sqrt(step.chosen->thinning));
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
    auto loaded =
        load_region<S, D>(survey_, region_before(0), stop_, [this](point_matrix<S, D> points) {
          return foresee({.points = std::move(points), .origin = survey_.origin});
        });
    while (!pass(loaded)) loaded = load_region<S, D>(survey_, region_before(0), stop_);
    return std::move(loaded.cloud);
  }

 private:
  /// How far around the tile points have to be known before step number `s`, or after all of them.
  [[nodiscard]] double margin_before(std::size_t s) const {
    double margin = halo_;
    for (std::size_t i = s; i < margins_.size(); ++i) margin += margins_[i];
    return margin;
  }
  /// All that has to be known then.
  [[nodiscard]] tile_region<D> region_before(std::size_t s) const {
    tile_region<D> region{tile_, survey_.edge, margin_before(s), survey_.bounds};
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
    double known = margin_before(0);
    bool may_have_moved = false;
    for (std::size_t s = 0; s < steps_.size(); ++s) {
      if (stop_.stop_requested()) throw cancelled{};
      if (steps_[s].reach.neighbors > 0 && !knows_neighbors(cloud, s)) return false;
      if (places_from_ == s && gives_places(s))
        set_places_by_cell(cloud, survey_, *steps_[s].order.cells);
      cloud = steps_[s].apply(std::move(cloud));
      may_have_moved = may_have_moved || steps_[s].moves_points;
      if (s < end_of_looking && !steps_[s].order.is_known && !may_have_moved && wanted_.empty())
        expect_unmoved(cloud, known, steps_[s].name);
      if (s + 1 == end_of_choosing && !keeps_places) drop_places(cloud);
      if (s + 1 == end_of_looking)
        keep_result(cloud);
      else if (s + 1 < end_of_looking && looks_around(steps_[s].reach)) {
        keep_region(cloud, region_before(s + 1));
        known = margin_before(s + 1);
      }
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
  /// A step of the user's that moves points is seen where one of them leaves what was known: it
  /// would be lost, or missing where others look.
  void expect_unmoved(const point_cloud<S, D>& cloud, double margin,
                      const std::string& step) const {
    const auto area = area_of(tile_, survey_.edge, margin);
    const double tolerance = 4 * survey_.template slack<S>() + 1e-6 * survey_.edge;
    for (index_t i = 0; i < cloud.size(); ++i) {
      const auto place = place_of(cloud, i);
      for (int d = 0; d < 2; ++d)
        if (place[d] < std::max(area.lower[d], survey_.bounds.lower[d]) - tolerance ||
            place[d] > std::min(area.upper[d], survey_.bounds.upper[d]) + tolerance)
          throw invalid_input{"the step " + step +
                              " has moved points, which on tiles only transform may: write its "
                              "result, without steps that look around, and open that"};
    }
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
  /// alone, as far as the points before all steps tell, and returns that, if there is any. That
  /// saves doing the steps before it twice.
  std::optional<tile_region<D>> foresee(const point_cloud<S, D>& cloud) {
    const auto looks = std::ranges::find_if(
        steps_, [](const tile_step<S, D>& step) { return step.reach.neighbors > 0; });
    if (looks == steps_.end() || cloud.empty()) return std::nullopt;
    const auto s = static_cast<std::size_t>(looks - steps_.begin());
    double coarsest = 0;
    for (const auto& step : steps_.first(s)) coarsest = std::max(coarsest, step.reach.distance);
    const auto unknown = unknown_around(cloud, s, [&](double distance) {
      // With fewer points, the nearest ones are farther away.
      return coarsest > 0 ? 1.02 * distance + 2 * coarsest : distance;
    });
    if (!unknown || unknown->empty()) return std::nullopt;
    for (const auto& ball : *unknown) wanted_.push_back({s, ball});
    return region_before(0).balls();
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
    const auto distances = farthest_of_nearest<S, D>(cloud.points, doubtful, needed);
    for (std::size_t i = 0; i < doubtful.size(); ++i) {
      const auto place = place_of(cloud, doubtful[i]);
      const double distance =
          enough(double(distances[i]) * (1 + more_than_rounding) + survey_.template slack<S>());
      if (distance > known.margin_of(place)) unknown.push_back({place, distance});
    }
    merge(unknown);
    return unknown;
  }

  /// The points of the region `after` of which it is not certain that `needed` points are so near
  /// that no other point, outside of what is known, can be nearer. `margin` is how much is known
  /// around each of them at least.
  [[nodiscard]] index_list doubtful_points(const point_cloud<S, D>& cloud,
                                           const tile_region<D>& known, const tile_region<D>& after,
                                           double margin, index_t needed) const {
    return lonely_points<S, D>(cloud.points, margin, needed, [&](std::int32_t i) {
      const auto place = place_of(cloud, i);
      if (!after.contains(place)) return -1.0;
      return std::max(
          0.0, (known.margin_of(place) - survey_.template slack<S>()) / (1 + more_than_rounding));
    });
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
double likely_border(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
                     std::size_t first) {
  // Points are farther apart once some of them are gone.
  constexpr double thinner = 1.25;
  double border = 0;
  const auto margins = first_margins<S, D>(survey, steps, {});
  for (std::size_t s = first; s < margins.size(); ++s) border += thinner * margins[s];
  return border;
}

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
  template double likely_border(const tile_survey<D>&, std::span<const tile_step<S, D>>,       \
                                std::size_t);                                                  \
  template std::uint64_t memory_of(const tile_survey<D>&, std::span<const tile_step<S, D>>,    \
                                   const tile_info&, double);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
