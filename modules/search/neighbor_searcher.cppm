// SPDX-License-Identifier: MIT
export module cilantro.search:neighbor_searcher;

import cilantro.standard;
import cilantro.core;
import :neighborhood;

namespace cilantro {

/// Finds the neighbours of a query among the points that it was built from.
///
/// Semantics: `find(query, spec, out)` clears `out` and writes the neighbours by ascending
/// distance, and by ascending index where points are equally far (compared before a square root
/// rounds): at most `spec.max_count()` of them, at a distance of at most `spec.max_distance()`,
/// inclusive. A query with a non-finite coordinate has no neighbours, and a point with one is never
/// found. `find` is const, depends on nothing but its arguments, and is called from several threads
/// at once. A search for a small neighbourhood is expected to take less than O(N). Models:
/// `kd_tree`, `brute_force_searcher`; `check_neighbor_searcher` tests yours.
export template <class T>
concept NeighborSearcher =
    requires(const T& searcher,
             typename points_view<typename T::scalar, T::static_dimension>::point_type query,
             neighborhood_spec spec, std::vector<neighbor<typename T::scalar>>& out) {
      requires Scalar<typename T::scalar>;
      { searcher.size() } -> std::convertible_to<index_t>;
      { searcher.dimension() } -> std::convertible_to<index_t>;
      { searcher.find(query, spec, out) } -> std::same_as<void>;
    };

}  // namespace cilantro
