// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import cilantro.search;
import :ranks;
import :running;
import :survey;
import :survey_around;
import :tile_sums;

namespace cilantro {
namespace {

constexpr double nowhere = std::numeric_limits<double>::infinity();

/// Writes the distances of some of the `places` to the nearest points around their square.
template <Scalar S, int D>
void find_distances(const survey_around<S, D>& target, const tile_key& square,
                    const point_matrix<double, D>& places, const index_list& indices,
                    std::vector<double>& distances, const std::stop_token& stop) {
  const auto near = target.around(square, stop);
  if (near.empty()) return;
  const kd_tree<double, D> tree{near.points.template cast<double>().eval()};
  point_matrix<double, D> queries(D, std::ssize(indices));
  for (index_t q = 0; q < queries.cols(); ++q) queries.col(q) = places.col(indices[q]);
  const auto found = tree.find_all(queries, knn_in_radius{1, target.distance()});
  for (index_t q = 0; q < queries.cols(); ++q)
    if (const auto nearest = found[q].distances(); !nearest.empty())
      distances[indices[q]] = nearest.front();
}

/// The distance of each point, infinite where there is nothing near.
template <Scalar S, int D>
std::vector<double> distances_of(const survey_around<S, D>& target, const point_cloud<S, D>& cloud,
                                 const std::stop_token& stop) {
  const auto places = target.places_of(cloud);
  std::vector<double> distances(cloud.size(), nowhere);
  for (const auto& [square, indices] : target.by_square(places))
    find_distances(target, square, places, indices, distances, stop);
  return distances;
}

struct distance_sums {
  index_t points = 0, pairs = 0;
  exact_sum sum, squares;
  double most = 0;

  void add(double distance) {
    ++points;
    if (distance == nowhere) return;
    ++pairs;
    sum += distance;
    squares.add_product(distance, distance);
    most = std::max(most, distance);
  }
  distance_sums& operator+=(const distance_sums& other) {
    points += other.points;
    pairs += other.pairs;
    sum += other.sum;
    squares += other.squares;
    most = std::max(most, other.most);
    return *this;
  }
  [[nodiscard]] comparison result() const {
    if (pairs == 0) return {.points = points};
    const double n = double(pairs);
    return {points, pairs, n / double(points), sum.value() / n, std::sqrt(squares.value() / n),
            most};
  }
};

}  // namespace

template <Scalar S, int D>
comparison compare(const tiled_cloud<S, D>& survey, const tiled_cloud<S, D>& target,
                   const compare_options& options) {
  const auto monitor =
      in_passes(options.monitor, 1 + passes_of_limits(survey) + passes_of_limits(target));
  std::optional<survey_around<S, D>> near;
  // Each rank decides the limits of a target that is not on ranks: no other must wait if it fails.
  on_all_ranks(survey.ranks().get(), [&] {
    near.emplace(target, survey.edge(), options.max_distance, "compare", monitor);
  });
  const auto from = with_decided_steps(survey, monitor);
  const auto sums = sum_over_tiles(
      from, std::vector<distance_sums>(1),
      [&](index_t t) { return near->memory_around(from, from.tiles()[t]); }, monitor,
      [&](const point_cloud<S, D>& points, std::vector<distance_sums>& found) {
        for (const double distance : distances_of(*near, points, monitor.stop))
          found.front().add(distance);
      });
  return sums.front().result();
}

template <Scalar S, int D>
comparison compare(const point_cloud<S, D>& cloud, const tiled_cloud<S, D>& target,
                   const compare_options& options) {
  const auto monitor = in_passes(options.monitor, 1 + passes_of_limits(target));
  const survey_around<S, D> near{target, target.edge(), options.max_distance, "compare", monitor};
  const auto places = near.places_of(cloud);
  std::vector<double> distances(cloud.size(), nowhere);
  auto sums = sum_over_squares(
      near, near.by_square(places), std::vector<distance_sums>(1), monitor, 0,
      [&](const tile_key& square, const index_list& indices, std::vector<distance_sums>& found) {
        find_distances(near, square, places, indices, distances, monitor.stop);
        for (const auto i : indices)
          if (distances[i] < nowhere) found.front().add(distances[i]);
      });
  sums.front().points = cloud.size() - count_non_finite(cloud.points);
  return sums.front().result();
}

template <Scalar S, int D>
point_cloud<S, D> distances_to_step<S, D>::operator()(point_cloud<S, D> cloud) const {
  std::vector<S> values;
  for (const double distance : distances_of(*near, cloud, stop))
    values.push_back(static_cast<S>(std::min(distance, near->distance())));
  for (index_t i = 0; i < cloud.size(); ++i)
    if (!is_finite(cloud.points.col(i))) values[i] = std::numeric_limits<S>::quiet_NaN();
  cloud.set_attribute(attribute, attribute_values{std::move(values)});
  return cloud;
}

template <Scalar S, int D>
std::string distances_to_step<S, D>::about() const {
  return "(up to " + in_digits(near->distance()) + ", as " + attribute + ", of " + target + ")";
}

template <Scalar S, int D>
std::uint64_t distances_to_step<S, D>::more_memory(const std::optional<tile_area>& area) const {
  return near->memory_around(area);
}

template <Scalar S, int D>
distances_to_step<S, D> distances_to(const tiled_cloud<S, D>& target,
                                     const distances_to_options& options) {
  const auto monitor = in_passes(options.monitor, std::max(1, passes_of_limits(target)));
  distances_to_step<S, D> step{
      .near = std::make_shared<const survey_around<S, D>>(
          target, target.edge(), options.max_distance, "distances_to", monitor),
      .attribute = options.attribute,
      .stop = options.monitor.stop,
      .target = description_of(target.survey()->files) + description_of(target.steps())};
  if (options.monitor.progress) options.monitor.progress(1);
  return step;
}

#define CILANTRO_INSTANTIATE(S, D)                                                \
  template comparison compare(const tiled_cloud<S, D>&, const tiled_cloud<S, D>&, \
                              const compare_options&);                            \
  template comparison compare(const point_cloud<S, D>&, const tiled_cloud<S, D>&, \
                              const compare_options&);                            \
  template struct distances_to_step<S, D>;                                        \
  template distances_to_step<S, D> distances_to(const tiled_cloud<S, D>&,         \
                                                const distances_to_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
