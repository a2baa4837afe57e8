// SPDX-License-Identifier: MIT
export module cilantro.search:product_search;

import cilantro.standard;
import cilantro.core;
import :neighborhood;
import :visit;

namespace cilantro {

/// From this dimension on, `brute_force_searcher` compares many queries with all points by products
/// of matrices.
inline constexpr index_t least_product_dimension = 8;

/// What `brute_force_searcher` finds for many queries, by ‖p − q‖² = ‖p‖² − 2 q·p + ‖q‖²: the
/// products of all pairs are computed in blocks that stay in the cache, and only the pairs that
/// rounding leaves in doubt are compared as one query alone would be.
template <Scalar S>
void visit_by_products(points_view<S, dynamic> points, points_view<S, dynamic> queries,
                       const neighborhood_spec& spec, const neighborhood_visitor<S>& visit,
                       const visit_options& options);

extern template void visit_by_products(points_view<float, dynamic>, points_view<float, dynamic>,
                                       const neighborhood_spec&, const neighborhood_visitor<float>&,
                                       const visit_options&);
extern template void visit_by_products(points_view<double, dynamic>, points_view<double, dynamic>,
                                       const neighborhood_spec&,
                                       const neighborhood_visitor<double>&, const visit_options&);

}  // namespace cilantro
