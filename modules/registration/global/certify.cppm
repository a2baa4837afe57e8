// SPDX-License-Identifier: MIT
export module cilantro.registration:certify;

import cilantro.standard;
import cilantro.core;
import :align_globally;

namespace cilantro {

/// What `certify` has proved.
export struct pair_certificate {
  index_t pairs = 0;  ///< The pairs that were looked at: those of finite points.
  /// Those that agree with the transform, to `max_distance`.
  index_t agreeing = 0;
  /// No rigid transform has more pairs that agree with it.
  index_t most = 0;

  /// Whether no transform has more pairs that agree with it than this one.
  [[nodiscard]] bool is_optimal() const { return agreeing >= most; }
  /// The share of the best possible number that this transform is sure to have, in [0, 1].
  [[nodiscard]] double share_of_best() const {
    return most > 0 ? double(agreeing) / double(most) : 1;
  }
};
/// Prints one line.
export std::ostream& operator<<(std::ostream& out, const pair_certificate& certificate);

template <Scalar S, int D>
pair_certificate closed_certify(const affine_parts<double, dynamic>& transform,
                                points_view<S, D> source, points_view<S, D> target,
                                const index_list& sources, const index_list& targets,
                                double max_distance, const execution& how);

/// Options of `certify`.
export struct certify_options {
  double max_distance = 0;  ///< Of a pair that agrees with a transform. Required.
  int threads = 0;
  task_monitor monitor = {};
};

/// Proves how good a transform is: how many pairs agree with it, and how many can agree with any
/// rigid transform at all.
///
/// Pairs that agree with one transform have lengths that differ by at most twice `max_distance`
/// between source and target. In the graph of all pairs of which that holds, they are a clique, in
/// which each two share all others; edges that share too few are dropped until none is left that a
/// larger clique could have. What remains is bounded by a colouring. It needs no transform to be
/// tried, so the bound holds for all of them; where many pairs are compatible by chance, it is
/// loose.
///
/// `certify(found.transform, source, target, pairs, {.max_distance = 0.03})`: in two or three
/// dimensions, for up to `most_graph_pairs` pairs. Throws `invalid_input` for more, for an index
/// that is not one of a point, and without a `max_distance`; `cancelled`. O(E N / 64) for E edges,
/// a few times; N²/8 bytes.
/// Source: cliques as maxima of consensus Enqvist, Josephson & Kahl 2009, "Optimal correspondences
/// from pairwise constraints"; trusses Cohen 2008.
export template <AffineMap T, PointsSource A, PointsSource B, RangeOfPairs R>
  requires std::same_as<points_view_of<A>, points_view_of<B>>
[[nodiscard]] pair_certificate certify(const T& transform, const A& source, const B& target,
                                       const R& pairs, const certify_options& options) {
  using S = scalar_of<A>;
  constexpr int C = closed_dimension<dimension_of<A>>;
  expect_same_origin(source, target, "certify");
  const auto [sources, targets] =
      pair_indices_of(pairs, "certify: a pair has an index that is not one of a point");
  const affine_parts<double, dynamic> map{transform.linear().template cast<double>(),
                                          transform.translation().template cast<double>()};
  return closed_certify<S, C>(map, points_in(source), points_in(target), sources, targets,
                              options.max_distance, {options.threads, options.monitor});
}

}  // namespace cilantro
