// SPDX-License-Identifier: MIT
export module cilantro.clustering:dbscan;

import cilantro.standard;
import cilantro.core;
import cilantro.numeric;
import cilantro.search;
import :clusters;
import :connected_components;

namespace cilantro {

/// Options of `dbscan`.
export struct dbscan_options {
  positive radius;  ///< In the units of the points, inclusive.
  /// A point with at least this many points within the radius, itself included, is a core of a
  /// cluster.
  index_t min_points = 5;
  int threads = 0;
  task_monitor monitor = {};
};

/// The clusters, and which points are their cores.
export struct dbscan_result : clusters {
  std::vector<std::uint8_t> is_core;  ///< One entry per point: 1 for cores, else 0.
};

/// Density-based clusters: cores that are connected through cores within the radius of each other,
/// and the other points within the radius of a core. Such a border point joins the nearest core,
/// and of equally near ones that with the smallest index (the published algorithm takes whichever
/// comes first). All other points, and those that are not finite, are noise, in no cluster. The
/// same for any number of threads. Two searches per point; memory is O(N), since no neighbourhoods
/// are kept. Throws `invalid_input` for `min_points` below 1, and if searcher and points differ in
/// size; `cancelled`.
/// Source: Ester, Kriegel, Sander & Xu 1996, "A density-based algorithm for discovering clusters";
/// the components are those of definition 5.
export template <NeighborSearcher T, PointsSource P>
[[nodiscard]] dbscan_result dbscan(const T& searcher, const P& points,
                                   const dbscan_options& options) {
  using S = typename T::scalar;
  const points_view<S, T::static_dimension> view = points_in(points);
  const index_t n = view.size();
  expects(n == index_t(searcher.size()), "dbscan: searcher and points must have the same size");
  expect_from(1, double(options.min_points), "dbscan: min_points");
  const double reach = options.radius;
  std::vector<std::uint8_t> is_core(n);
  const auto core = [&](index_t i) -> std::uint8_t& { return is_core[i]; };
  // Three passes, of which the second looks at whole neighbourhoods.
  const auto for_each = [&](double begin_share, double end_share, neighborhood_spec spec,
                            visit_options how, const auto& visit) {
    how.threads = options.threads;
    how.monitor.stop = options.monitor.stop;
    if (options.monitor.progress)
      how.monitor.progress = [&](double share) {
        options.monitor.progress(begin_share + share * (end_share - begin_share));
      };
    const auto visit_block = [&](const neighborhood_block<S>& block) {
      for (index_t q = 0; q < block.size(); ++q) visit(block.query(q), block[q]);
    };
    visit_neighborhoods(searcher, view, spec, visit_block, how);
  };

  for_each(0, 0.2, knn_in_radius{options.min_points, reach}, {.ascending = false},
           [&](index_t i, const auto& near) { core(i) = std::ssize(near) == options.min_points; });
  disjoint_sets sets{n};
  for_each(0.2, 0.9, radius{reach}, {.wanted = is_core, .ascending = false},
           [&](index_t i, const auto& near) {
             join_similar<S>(sets, i, near, [&](index_t, index_t j, S) { return bool(core(j)); });
           });
  std::vector<clusters::label> labels(static_cast<std::size_t>(n), clusters::none);
  std::vector<std::uint8_t> is_other(is_core.size());
  for (std::size_t i = 0; i < is_core.size(); ++i) is_other[i] = !is_core[i];
  for_each(0.9, 1, radius{reach}, {.wanted = is_other}, [&](index_t i, const auto& near) {
    const auto nearest =
        std::ranges::find_if(near, [&](const auto& found) { return core(found.index); });
    if (nearest != near.end())
      labels[i] = static_cast<clusters::label>(sets.find((*nearest).index));
  });
  for (index_t i = 0; i < n; ++i)
    if (core(i)) labels[i] = static_cast<clusters::label>(sets.find(i));
  return {clusters{std::move(labels)}, std::move(is_core)};
}

/// As above, through a kd-tree.
export template <PointsSource P>
[[nodiscard]] dbscan_result dbscan(const P& points, const dbscan_options& options) {
  const auto view = points_in(points);
  if (view.empty()) return {};
  return dbscan(kd_tree{view, {.threads = options.threads}}, view, options);
}

}  // namespace cilantro
