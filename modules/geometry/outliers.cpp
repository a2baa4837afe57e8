// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

/// A number for each point from the distances to its nearest others, or NaN if it is not finite.
template <Scalar S, int D, class F>
std::vector<double> from_others(points_view<S, D> points, const knn_in_radius& spec,
                                const execution& how, F f) {
  const kd_tree<S, D> tree{points, {.threads = how.threads}};
  std::vector<double> all(static_cast<std::size_t>(points.size()),
                          std::numeric_limits<double>::quiet_NaN());
  // One more than asked for: the point itself is found, too, as one that is at no distance.
  const knn_in_radius with_self{spec.k + 1, spec.distance};
  visit_neighborhoods(tree, points, with_self,
                      [&](const neighborhood_block<S>& block) {
                        for (index_t i = 0; i < block.size(); ++i)
                          if (const auto found = block[i].distances(); !found.empty())
                            all[block.query(i)] = f(found.subspan(1));
                      },
                      {.threads = how.threads, .monitor = how.monitor});
  return all;
}

template <class Keep>
selection select_by(const std::vector<double>& values, Keep keep) {
  selection found;
  for (std::size_t i = 0; i < values.size(); ++i)
    (keep(values[i]) ? found.kept : found.removed).push_back(static_cast<std::int32_t>(i));
  return found;
}

/// The doubles that add up to a sum: it, rounded, what was lost by that, rounded, and so on. A few.
std::vector<double> expansion_of(exact_sum sum) {
  std::vector<double> terms;
  while (sum.value() != 0) {
    terms.push_back(sum.value());
    sum += -terms.back();
  }
  return terms;
}

}  // namespace

void distance_statistics::add(double distance) {
  if (std::isnan(distance)) return;
  sum += distance;
  squares.add_product(distance, distance);
  ++count;
}

distance_statistics& distance_statistics::operator+=(const distance_statistics& other) {
  sum += other.sum;
  squares += other.squares;
  count += other.count;
  return *this;
}

double distance_statistics::limit(double deviations, double epsilon) const {
  if (count == 0) return 0;
  const double n = double(count), mean = sum.value() / n;
  double deviation = 0;
  if (count > 1 && deviations > 0) {
    if (!std::isfinite(squares.value())) return std::numeric_limits<double>::infinity();
    // n Σm² - (Σm)² without rounding: nothing is lost where all are nearly the same.
    exact_sum variance;
    for (const double square : expansion_of(squares)) variance.add_product(n, square);
    const auto terms = expansion_of(sum);
    for (const double a : terms)
      for (const double b : terms) variance.add_product(-a, b);
    deviation = std::sqrt(variance.value() / n / (n - 1));
  }
  return mean + deviations * deviation + mean * 8 * epsilon;
}

distance_statistics statistics_of(std::span<const double> distances, const execution& how) {
  distance_statistics all;
  std::mutex one_at_a_time;
  // Since sums are exact, blocks may be added in any order.
  parallel_blocks(std::ssize(distances), index_t{1} << 16, how,
                  [&](index_t, index_t begin, index_t end) {
                    distance_statistics block;
                    for (index_t i = begin; i < end; ++i)
                      block.add(distances[static_cast<std::size_t>(i)]);
                    const std::lock_guard lock{one_at_a_time};
                    all += block;
                  });
  return all;
}

template <Scalar S, int D>
std::vector<double> closed_mean_distances(points_view<S, D> points, index_t neighbors,
                                          const execution& how) {
  expect_from(1, double(neighbors), "mean_neighbor_distances: neighbors");
  const knn_in_radius others{std::min(neighbors, points.size()),
                             std::numeric_limits<double>::infinity()};
  return from_others(points, others, how, [](std::span<const S> distances) {
    double sum = 0;
    for (const S d : distances) sum += double(d);
    return distances.empty() ? 0 : sum / double(distances.size());
  });
}

template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const statistical_outlier_options& options) {
  expect_from(1, double(options.neighbors), "statistical_outliers: neighbors");
  expect_from(0, options.deviations, "statistical_outliers: deviations");
  const auto means =
      closed_mean_distances(points, options.neighbors, {options.threads, options.monitor});
  const double limit = statistics_of(means, {.threads = options.threads})
                           .limit(options.deviations, double(std::numeric_limits<S>::epsilon()));
  return select_by(means, [&](double m) { return m <= limit; });
}

template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const radius_outlier_options& options) {
  expect_from(0, double(options.min_neighbors), "radius_outliers: min_neighbors");
  expect_from(0, options.radius, "radius_outliers: radius");
  // No more neighbours are looked for than are needed.
  const knn_in_radius needed{std::min(options.min_neighbors, points.size()), options.radius};
  const auto counts = from_others(points, needed, {options.threads, options.monitor},
                                  [](std::span<const S> found) { return double(found.size()); });
  return select_by(counts, [&](double n) { return n >= double(options.min_neighbors); });
}

#define CILANTRO_INSTANTIATE(S, D)                                                                 \
  template std::vector<double> closed_mean_distances<S, D>(points_view<S, D>, index_t,             \
                                                           const execution&);                      \
  template selection closed_outliers<S, D>(points_view<S, D>, const statistical_outlier_options&); \
  template selection closed_outliers<S, D>(points_view<S, D>, const radius_outlier_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
