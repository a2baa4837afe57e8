// SPDX-License-Identifier: MIT
export module cilantro.clustering:mean_shift;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.cloud;
import :clusters;
import :kernel;
import :kmeans;

namespace cilantro {

export struct mean_shift_options {
  /// Where two seeds end up this near to each other, in the units of the points, they have found
  /// the same mode; also through others between them. Half a bandwidth if it is left out.
  std::optional<double> merge_distance = {};
  double tolerance = 1e-4;  ///< A seed rests once a step is below this many bandwidths.
  int max_iterations = 300;
  int threads = 0;
  task_monitor monitor = {};
};

export template <Scalar S, int D>
struct mean_shift_result : clusters {
  /// `Dim × size()`: column c is the densest place that was found for cluster c.
  point_matrix<S, D> modes;
  std::vector<double> densities;  ///< The sum of the kernel over all points, at each mode.
  index_t unconverged = 0;        ///< Seeds that were still moving after the last iteration.
};

/// Where one seed has come to.
template <Scalar S, int D>
struct shifted_seed {
  point_vector<S, D> place;
  double density = 0;  ///< 0 if there is no point around.
  bool is_at_rest = false;
};

/// Moves a seed to the weighted mean of the points around it, again and again.
template <NeighborSearcher T, Kernel K>
[[nodiscard]] auto shift_seed(const T& searcher,
                              points_view<typename T::scalar, T::static_dimension> points,
                              index_t dimension, const typename T::scalar* seed, double bandwidth,
                              const K& kernel, const mean_shift_options& options,
                              std::vector<neighbor<typename T::scalar>>& near) {
  using S = typename T::scalar;
  constexpr int D = T::static_dimension;
  shifted_seed<S, D> now{Eigen::Map<const point_vector<S, D>>{seed, dimension}};
  for (int step = 0; !now.is_at_rest; ++step) {
    searcher.find(now.place, radius{bandwidth * kernel_support<K>()}, near);
    now.density = 0;
    // Around the place itself, so that far from the origin nothing is lost.
    point_vector<double, D> sum = point_vector<double, D>::Zero(dimension);
    const point_vector<double, D> place = now.place.template cast<double>();
    for (const auto& [i, distance] : near) {
      const double weight = kernel(double(distance) / bandwidth);
      now.density += weight;
      sum += weight * (points[i].template cast<double>() - place);
    }
    if (!(now.density > 0) || step == options.max_iterations) return now;
    const point_vector<double, D> shift = sum / now.density;
    now.is_at_rest = shift.norm() <= options.tolerance * bandwidth;
    if (!now.is_at_rest) now.place = (place + shift).template cast<S>();
  }
  return now;
}

/// What the seeds have found, merged: which of `modes` each seed has reached, −1 for none.
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
  expects(points.empty() || seeds.empty() || points.dimension() == seeds.dimension(),
          "mean_shift: seeds and points must have the same dimension");
  mean_shift_result<S, D> result;
  if (points.empty()) return result;
  const points_view<S, C> closed_points{points};
  const kd_tree<S, C> tree{closed_points, {.threads = options.threads}};
  const index_t dimension = points.dimension();
  point_matrix<S, C> places(dimension, seeds.size());
  std::vector<double> densities(static_cast<std::size_t>(seeds.size()));
  std::vector<std::uint8_t> moving(densities.size());
  parallel_blocks(seeds.size(), 32, {options.threads, options.monitor},
                  [&](index_t, index_t begin, index_t end) {
                    std::vector<neighbor<S>> near;
                    for (index_t i = begin; i < end; ++i) {
                      const auto found = shift_seed(tree, closed_points, dimension,
                                                    seeds.data() + i * seeds.stride(), bandwidth,
                                                    kernel, options, near);
                      places.col(i) = found.place;
                      densities[static_cast<std::size_t>(i)] = found.density;
                      moving[static_cast<std::size_t>(i)] = found.density > 0 && !found.is_at_rest;
                    }
                  });
  for (const auto is_moving : moving) result.unconverged += is_moving;
  const auto merged =
      merge_modes<S, C>(as_points(places), densities,
                        options.merge_distance.value_or(bandwidth / 2), options.threads);
  const auto labels = seeds_are_points
                          ? merged.reached
                          : closed_nearest<S, C, euclidean>(as_points(merged.modes), closed_points,
                                                            {.threads = options.threads});
  static_cast<clusters&>(result) = clusters{labels};
  result.modes.resize(dimension, result.size());
  for (index_t c = 0; c < result.size(); ++c) {
    const auto mode = labels[static_cast<std::size_t>(result[c].front())];
    result.modes.col(c) = merged.modes.col(mode);
    result.densities.push_back(merged.densities[static_cast<std::size_t>(mode)]);
  }
  return result;
}

/// Clusters of the points from which one climbs to the same mode of their density, which is
/// estimated with a kernel of the given bandwidth, in the units of the points. The number of
/// clusters follows. Points that are not finite are in none. The same for any number of threads.
/// O(N · iterations · neighbours). Throws `invalid_input` for options that are negative;
/// `cancelled`.
/// Source: Fukunaga & Hostetler 1975; Comaniciu & Meer 2002, "Mean shift: a robust approach toward
/// feature space analysis", equation 20, of which the kernel here is G.
export template <PointsOrCloud P, Kernel K = gaussian_kernel>
[[nodiscard]] auto mean_shift(const P& points, positive bandwidth, const K& kernel = {},
                              const mean_shift_options& options = {}) {
  const auto view = places_in(points);
  return shift_all(view, view, true, bandwidth, kernel, options);
}

/// As above from some seeds only, which may lie anywhere; each point is then in the cluster of the
/// nearest mode, and a mode that is nearest to none is left out.
export template <PointsOrCloud P, PointsSource Q, Kernel K = gaussian_kernel>
  requires std::same_as<scalar_of<Q>, typename places_view_of<P>::scalar>
[[nodiscard]] auto mean_shift(const P& points, const Q& seeds, positive bandwidth,
                              const K& kernel = {}, const mean_shift_options& options = {}) {
  const places_view_of<P> view = places_in(points);
  return shift_all(view, places_view_of<P>{points_in(seeds)}, false, bandwidth, kernel, options);
}

}  // namespace cilantro
