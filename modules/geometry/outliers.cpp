// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

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

struct counted_sum {
  double sum = 0;
  index_t count = 0;
  counted_sum& operator+=(const counted_sum& other) {
    sum += other.sum;
    count += other.count;
    return *this;
  }
};

}  // namespace

template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const statistical_outlier_options& options) {
  expect_from(1, double(options.neighbors), "statistical_outliers: neighbors");
  expect_from(0, options.deviations, "statistical_outliers: deviations");
  const knn_in_radius others{std::min(options.neighbors, points.size()),
                             std::numeric_limits<double>::infinity()};
  const auto means = from_others(points, others, {options.threads, options.monitor},
                                 [](std::span<const S> distances) {
                                   double sum = 0;
                                   for (const S d : distances) sum += double(d);
                                   return distances.empty() ? 0 : sum / double(distances.size());
                                 });
  const auto sum_of = [&](auto term) {
    return ordered_sum(std::ssize(means), {.threads = options.threads}, counted_sum{},
                       [&](counted_sum& sum, index_t i) {
                         const double mean = means[i];
                         if (std::isnan(mean)) return;
                         sum.sum += term(mean);
                         ++sum.count;
                       });
  };
  const auto total = sum_of([](double m) { return m; });
  const double mean = total.count > 0 ? total.sum / double(total.count) : 0;
  const auto squares = sum_of([&](double m) { return (m - mean) * (m - mean); });
  const double deviation = total.count > 1 ? std::sqrt(squares.sum / double(total.count - 1)) : 0;
  // Points that are all equally far from theirs differ by rounding, which removes none.
  const double limit =
      mean + options.deviations * deviation + mean * 8 * double(std::numeric_limits<S>::epsilon());
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
  template selection closed_outliers<S, D>(points_view<S, D>, const statistical_outlier_options&); \
  template selection closed_outliers<S, D>(points_view<S, D>, const radius_outlier_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
