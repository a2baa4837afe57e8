// SPDX-License-Identifier: MIT
export module cilantro.clustering:mean_shift;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :clusters;
import :kernel;
import :kmeans;

namespace cilantro {

/// Options of `mean_shift`.
export struct mean_shift_options {
  /// Seeds that end up at most this far apart, in the units of the points, directly or through a
  /// chain of others, have found the same mode. By default, half a bandwidth.
  std::optional<double> merge_distance = {};
  double tolerance = 1e-4;   ///< A seed stops once a step is at most this many bandwidths.
  int max_iterations = 300;  ///< The most steps of a seed.
  int threads = 0;
  task_monitor monitor = {};
};

/// The clusters, and the modes of the density that they belong to.
export template <Scalar S, int D>
struct mean_shift_result : clusters {
  /// `Dim × size()`: column c is the mode of cluster c, the densest place that was found for it.
  point_matrix<S, D> modes;
  std::vector<double> densities;  ///< The sum of the kernel over all points, at each mode.
  index_t unconverged = 0;        ///< How many seeds were still moving after the last iteration.
};

/// Where seeds have moved to.
template <Scalar S, int D>
struct shifted_seeds {
  point_matrix<S, D> places;
  std::vector<double> densities;  ///< 0 if there is no point near the seed.
  std::vector<index_t> moving;
};

/// Sums over the points around a place.
template <int D>
struct kernel_sum {
  /// Around the place itself, so that far from the origin nothing is lost.
  point_vector<double, D> shift;
  double density = 0;
};

/// Moves each seed to the weighted mean of the points around it, repeatedly. `sum_around(places,
/// f)` calls `f(k, sum)` for each place k that has points around it.
template <Scalar S, int D, class SumAround>
[[nodiscard]] shifted_seeds<S, D> shift_seeds(points_view<S, D> seeds, double bandwidth,
                                              const mean_shift_options& options,
                                              SumAround sum_around) {
  const auto n = static_cast<std::size_t>(seeds.size());
  shifted_seeds<S, D> all{seeds.matrix(), std::vector<double>(n), std::vector<index_t>(n)};
  std::ranges::copy(std::views::iota(index_t{0}, seeds.size()), all.moving.begin());
  point_matrix<S, D> places;
  std::vector<std::uint8_t> goes_on;
  for (int step = 0; !all.moving.empty(); ++step) {
    places.resize(seeds.dimension(), std::ssize(all.moving));
    for (index_t k = 0; k < places.cols(); ++k) {
      const auto seed = all.moving[k];
      places.col(k) = all.places.col(seed);
      all.densities[seed] = 0;
    }
    goes_on.assign(all.moving.size(), 0);
    sum_around(as_points(places), [&](index_t k, const kernel_sum<D>& sum) {
      const auto seed = all.moving[k];
      all.densities[seed] = sum.density;
      if (!(sum.density > 0)) return;
      const point_vector<double, D> shift = sum.shift / sum.density;
      const bool is_at_rest = shift.norm() <= options.tolerance * bandwidth;
      if (is_at_rest) return;
      goes_on[k] = 1;
      if (step < options.max_iterations)
        all.places.col(seed) = (places.col(k).template cast<double>() + shift).template cast<S>();
    });
    std::size_t left = 0;
    for (std::size_t k = 0; k < goes_on.size(); ++k)
      if (goes_on[k]) all.moving[left++] = all.moving[k];
    all.moving.resize(left);
    if (options.monitor.progress) options.monitor.progress(double(n - left) / double(n));
    if (step >= options.max_iterations) break;
  }
  if (options.monitor.progress && !all.moving.empty()) options.monitor.progress(1);
  return all;
}

/// The sums around places: of neighbours in blocks, in the order in which they are found, or, for a
/// kernel with infinite support, of all points.
template <Scalar S, int D, Kernel K>
[[nodiscard]] auto kernel_sums(const kd_tree<S, D>& tree, points_view<S, D> points,
                               double bandwidth, const K& kernel,
                               const mean_shift_options& options) {
  return [&, points, bandwidth](points_view<S, D> places, auto f) {
    const auto sum_of = [&](index_t k, auto&& indices, auto distance_of) {
      const point_vector<double, D> place = places[k].template cast<double>();
      kernel_sum<D> sum{point_vector<double, D>::Zero(place.size())};
      double least = 0;
      for (std::size_t m = 0; m < indices.size(); ++m) {
        const point_vector<double, D> apart = points[indices[m]].template cast<double>() - place;
        const double weight = kernel(distance_of(m, apart) / bandwidth);
        least = std::min(least, weight);
        sum.density += weight;
        sum.shift += weight * apart;
      }
      expects(least == 0 && std::isfinite(sum.density),
              "mean_shift: the kernel must return finite numbers of 0 or more");
      f(k, sum);
    };
    const task_monitor stop_only{{}, options.monitor.stop};
    if (std::isfinite(double(kernel.support))) {
      visit_neighborhoods(
          tree, places, radius{bandwidth * double(kernel.support)},
          [&](const neighborhood_block<S>& block) {
            for (index_t i = 0; i < block.size(); ++i)
              sum_of(block.query(i), block[i].indices(),
                     [&](std::size_t m, const auto&) { return double(block[i].distances()[m]); });
          },
          {.ascending = false, .threads = options.threads, .monitor = stop_only});
    } else {
      std::vector<index_t> finite;
      for (index_t i = 0; i < points.size(); ++i)
        if (is_finite(points[i])) finite.push_back(i);
      parallel_blocks(
          places.size(), 1, {options.threads, stop_only}, [&](index_t k, index_t, index_t) {
            if (is_finite(places[k]))
              sum_of(k, finite, [](std::size_t, const auto& apart) { return apart.norm(); });
          });
    }
  };
}

/// The modes that the seeds have found, merged, and which of `modes` each seed has reached, −1 for
/// none.
template <Scalar S, int D>
struct merged_modes {
  std::vector<clusters::label> reached;
  point_matrix<S, D> modes;
  std::vector<double> densities;
};
template <Scalar S, int D>
merged_modes<S, D> merge_modes(points_view<S, D> places, std::span<const double> densities,
                               double distance, int threads);

void expect_sensible(const mean_shift_options& options);

template <Scalar S, int D, Kernel K>
[[nodiscard]] mean_shift_result<S, D> shift_all(points_view<S, D> points, points_view<S, D> seeds,
                                                bool seeds_are_points, double bandwidth,
                                                const K& kernel,
                                                const mean_shift_options& options) {
  constexpr int C = closed_dimension<D>;
  expect_sensible(options);
  expects(double(kernel.support) > 0, "mean_shift: the support of the kernel must be positive");
  expects(points.empty() || seeds.empty() || points.dimension() == seeds.dimension(),
          "mean_shift: seeds and points must have the same dimension");
  mean_shift_result<S, D> result;
  if (points.empty()) return result;
  const points_view<S, C> closed_points{points};
  const kd_tree<S, C> tree{closed_points, {.threads = options.threads}};
  const auto shifted =
      shift_seeds<S, C>(points_view<S, C>{seeds}, bandwidth, options,
                        kernel_sums<S, C>(tree, closed_points, bandwidth, kernel, options));
  result.unconverged = std::ssize(shifted.moving);
  const auto merged =
      merge_modes<S, C>(as_points(shifted.places), shifted.densities,
                        options.merge_distance.value_or(bandwidth / 2), options.threads);
  const auto labels = seeds_are_points
                          ? merged.reached
                          : closed_nearest<S, C, euclidean>(as_points(merged.modes), closed_points,
                                                            {.threads = options.threads});
  static_cast<clusters&>(result) = clusters{labels};
  result.modes.resize(points.dimension(), result.size());
  for (index_t c = 0; c < result.size(); ++c) {
    const auto mode = labels[result[c].front()];
    result.modes.col(c) = merged.modes.col(mode);
    result.densities.push_back(merged.densities[mode]);
  }
  return result;
}

/// Estimates the density of the points with a kernel of the given bandwidth, in the units of the
/// points, and lets each point climb to a mode of it: points that reach the same mode form a
/// cluster. The number of clusters need not be known. Points that are not finite are in no cluster.
/// The same for any number of threads. O(N · iterations · neighbours). Throws `invalid_input` for
/// options that are negative; `cancelled`.
/// Source: Fukunaga & Hostetler 1975; Comaniciu & Meer 2002, "Mean shift: a robust approach toward
/// feature space analysis", equation 20, of which the kernel here is G.
export template <PointsSource P, Kernel K = gaussian_kernel>
[[nodiscard]] auto mean_shift(const P& points, positive bandwidth, const K& kernel = {},
                              const mean_shift_options& options = {}) {
  const auto view = points_in(points);
  return shift_all(view, view, true, bandwidth, kernel, options);
}

/// As above, from given seeds only, which may lie anywhere. Each point then joins the cluster of
/// the nearest mode; a mode that is not nearest to any point is dropped.
export template <PointsSource P, PointsSource Q, Kernel K = gaussian_kernel>
  requires std::same_as<scalar_of<Q>, scalar_of<P>>
[[nodiscard]] auto mean_shift(const P& points, const Q& seeds, positive bandwidth,
                              const K& kernel = {}, const mean_shift_options& options = {}) {
  const points_view_of<P> view = points_in(points);
  return shift_all(view, points_view_of<P>{points_in(seeds)}, false, bandwidth, kernel, options);
}

}  // namespace cilantro
