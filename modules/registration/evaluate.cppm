// SPDX-License-Identifier: MIT
export module cilantro.registration:evaluate;

import cilantro.standard;
import cilantro.core;
import :concepts;

namespace cilantro {

/// How well the source lies on the target under a transform, with the searcher's pairs and by the
/// estimator's measure: the figures that `icp` returns for its result.
export template <class Searcher, class E>
  requires CorrespondenceSearcher<Searcher, typename E::transform_type> &&
           TransformEstimator<E, pairs_of<Searcher, typename E::transform_type>>
[[nodiscard]] alignment_fit evaluate(const Searcher& searcher, const E& estimator,
                                     const typename E::transform_type& transform) {
  pairs_of<Searcher, typename E::transform_type> pairs;
  searcher.find(transform, pairs);
  return estimator.estimate(transform, pairs).fit;
}

/// The `pairs` of a search, and the residual of each.
export template <class Pairs>
struct pair_residuals {
  Pairs pairs;
  Eigen::VectorXd values;  ///< One residual per pair, unweighted; see the estimator's `residuals`.
};

/// The residuals of the pairs that the searcher finds under a transform.
export template <class Searcher, class E>
  requires CorrespondenceSearcher<Searcher, typename E::transform_type>
[[nodiscard]] auto residuals(const Searcher& searcher, const E& estimator,
                             const typename E::transform_type& transform) {
  pair_residuals<pairs_of<Searcher, typename E::transform_type>> result;
  searcher.find(transform, result.pairs);
  result.values = estimator.residuals(transform, result.pairs);
  return result;
}

}  // namespace cilantro
