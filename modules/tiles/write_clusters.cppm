// SPDX-License-Identifier: MIT
export module cilantro.tiles:write_clusters;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.cloud;
import cilantro.clustering;
import :tiled_cloud;
import :write_tiles;

namespace cilantro {

/// Points that are joined where they are close: what both kinds of clusters need.
struct cluster_rule {
  double radius = 0;
  index_t min_points = 1;  ///< How many points around one make it a core; 1: all are.
  index_t least = 1, most = std::numeric_limits<index_t>::max();  ///< Sizes of clusters.
};

template <Scalar S, int D>
tiled_cloud<S, D> write_clusters_by(const tiled_cloud<S, D>& cloud,
                                    const std::filesystem::path& folder, const cluster_rule& rule,
                                    const write_tiles_options& options);
cluster_rule rule_of(radius distance, const components_options& components);
cluster_rule rule_of(const dbscan_options& dbscan);

/// As `write_tiles`, with the number of the connected component of each point in the attribute
/// "cluster": points at most `distance` apart are joined, also across tiles. The numbers are those
/// that `connected_components` gives for all points at once: the largest cluster is 0; −1 for
/// points of components that are smaller or larger than the options allow. After steps, the order
/// of tiles decides where otherwise that of the points does: among equally large clusters.
///
/// Memory beside that for tiles: about 60 bytes for each cluster of a tile, and for each point at
/// most 2 · `distance` from the border of one. On disk, the points once more and 8 bytes for each.
/// Throws as `write_tiles` does, and `invalid_input` for seeds, and for a distance that is not
/// positive and finite. Labels are made again when a run is resumed.
export template <Scalar S, int D>
tiled_cloud<S, D> write_clusters(const tiled_cloud<S, D>& cloud,
                                 const std::filesystem::path& folder, radius distance,
                                 const components_options& components = {},
                                 const write_tiles_options& options = {}) {
  return write_clusters_by(cloud, folder, rule_of(distance, components), options);
}
/// As above, with the clusters that `dbscan` finds.
export template <Scalar S, int D>
tiled_cloud<S, D> write_clusters(const tiled_cloud<S, D>& cloud,
                                 const std::filesystem::path& folder, const dbscan_options& dbscan,
                                 const write_tiles_options& options = {}) {
  return write_clusters_by(cloud, folder, rule_of(dbscan), options);
}

/// What `write_clusters(folder, …)` returns, to stand behind `|`.
export struct write_clusters_sink {
  std::filesystem::path folder;  ///< Where the tiles go.
  cluster_rule rule;             ///< Which points form clusters.
  write_tiles_options options;   ///< How the tiles are written.

  /// Writes the tiles of `cloud`, with the clusters.
  template <Scalar S, int D>
  tiled_cloud<S, D> take(const tiled_cloud<S, D>& cloud) const {
    return write_clusters_by(cloud, folder, rule, options);
  }
};
/// `cloud | write_clusters(folder, radius{0.5})` is `write_clusters(cloud, folder, radius{0.5})`.
export [[nodiscard]] inline auto write_clusters(std::filesystem::path folder, radius distance,
                                                const components_options& components = {},
                                                write_tiles_options options = {}) {
  return write_clusters_sink{std::move(folder), rule_of(distance, components), std::move(options)};
}
export [[nodiscard]] inline auto write_clusters(std::filesystem::path folder,
                                                const dbscan_options& dbscan,
                                                write_tiles_options options = {}) {
  return write_clusters_sink{std::move(folder), rule_of(dbscan), std::move(options)};
}
export template <Scalar S, int D>
tiled_cloud<S, D> operator|(const tiled_cloud<S, D>& cloud, const write_clusters_sink& sink) {
  return sink.take(cloud);
}

}  // namespace cilantro
