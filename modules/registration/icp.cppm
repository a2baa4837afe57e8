// SPDX-License-Identifier: MIT
export module cilantro.registration:icp;

import cilantro.standard;
import cilantro.core;
import :concepts;

namespace cilantro {

/// Why a registration ended.
export enum class icp_status {
  converged,        ///< The tolerance was met, and the pairs determine enough of the transform.
  iteration_limit,  ///< The transform was still changing after the last iteration.
  too_few_pairs,    ///< There were too few pairs to go by, for example without any overlap.
  /// The tolerance was met, but the pairs do not determine the transform along some directions.
  degenerate,
  cancelled,  ///< A stop was requested.
};
export [[nodiscard]] std::string_view to_string(icp_status status);
export std::ostream& operator<<(std::ostream& out, icp_status status);

/// One iteration, as it is passed to an observer.
export template <class T>
struct icp_iteration {
  int number;               ///< Counted from 1.
  const T& transform;       ///< After the iteration.
  transform_change change;  ///< How far the iteration moved the transform.
  /// Of the transform before the iteration, with the pairs that it used.
  const alignment_fit& fit;
};

/// When `icp` stops: at the first of these conditions that is met.
export template <class T>
struct icp_options {
  int max_iterations = 30;  ///< At 0, only the initial transform is evaluated.
  /// Before that many iterations, nothing counts as converged, such as while an observer still
  /// changes the weights of the estimator.
  int min_iterations = 0;
  /// The transform has converged when an iteration changes it by at most this, in radians and in
  /// the units of the points, or by no more than its rounding error.
  double tolerance = 1e-5;
  std::optional<double> rotation_tolerance = {};     ///< In radians, in place of `tolerance`.
  std::optional<double> translation_tolerance = {};  ///< In units, in place of `tolerance`.
  /// If positive, also stops once the residual changes by at most this share from one iteration to
  /// the next.
  double residual_tolerance = 0;
  index_t min_pairs = 1;  ///< With fewer pairs, or none, the status is `too_few_pairs`.
  /// A result counts as converged if the pairs leave at most this share of the unknowns
  /// undetermined. By default 0; for a field of transforms, which has a size, 1, since the target
  /// may not contain all of the source.
  double max_undetermined = requires(const T& t) { index_t(t.size()); } ? 1 : 0;
  std::function<void(const icp_iteration<T>&)> observer = {};  ///< Called after each iteration.
  task_monitor monitor = {};
};

/// The result of a registration. The figures are those of the returned transform.
export template <class T>
struct icp_result : alignment_fit {
  T transform;                                      ///< From the source to the target.
  icp_status status = icp_status::iteration_limit;  ///< Why the registration ended.
  int iterations = 0;                               ///< The number of iterations.
  transform_change last_change;  ///< How far the last iteration moved the transform.

  /// Whether the status is `converged`.
  [[nodiscard]] bool converged() const { return status == icp_status::converged; }
};
void print_figures(std::ostream& out, icp_status status, int iterations, const alignment_fit& fit);
/// Prints one line with the status and the figures, without the transform.
export template <class T>
std::ostream& operator<<(std::ostream& out, const icp_result<T>& result) {
  print_figures(out, result.status, result.iterations, result);
  return out;
}

/// Iterative closest point: finds pairs, improves the transform, and repeats (Besl & McKay 1992).
///
/// Works for every type of transform that searcher and estimator both support: rigid, affine, or a
/// field of transforms. Returns the transform that was reached and why the iteration stopped. The
/// status is never `converged` without pairs, or while more than `max_undetermined` of the unknowns
/// is undetermined; these stay as they are in `initial`. Throws `invalid_input` for options that
/// are negative or NaN, and what searcher and estimator throw, except `cancelled`, which becomes a
/// status. There is one search more than iterations, for the figures of the result.
export template <class Searcher, class E>
  requires CorrespondenceSearcher<Searcher, typename E::transform_type> &&
           TransformEstimator<E, pairs_of<Searcher, typename E::transform_type>>
[[nodiscard]] auto icp(const Searcher& searcher, const E& estimator,
                       typename E::transform_type initial,
                       const icp_options<typename E::transform_type>& options = {})
    -> icp_result<typename E::transform_type> {
  const double most_rotation = options.rotation_tolerance.value_or(options.tolerance);
  const double most_translation = options.translation_tolerance.value_or(options.tolerance);
  expect_from(0, options.max_iterations, "icp: max_iterations");
  expect_between(0, options.min_iterations, options.max_iterations, "icp: min_iterations");
  expect_from(0, double(options.min_pairs), "icp: min_pairs");
  expect_from(0, most_rotation, "icp: the tolerance of rotations");
  expect_from(0, most_translation, "icp: the tolerance of translations");
  expect_from(0, options.residual_tolerance, "icp: residual_tolerance");
  expect_between(0, options.max_undetermined, 1, "icp: max_undetermined");
  if constexpr (AffineMap<typename E::transform_type>)
    expects(is_finite(initial.linear().reshaped()) && is_finite(initial.translation()),
            "icp: the initial transform must be finite");

  icp_result<typename E::transform_type> result;
  result.transform = std::move(initial);
  pairs_of<Searcher, typename E::transform_type> pairs;
  repeated_memory<Searcher> memory{};
  repeated_memory<E> estimator_memory{};
  const auto end_with = [&](icp_status status) {
    if (options.monitor.progress && status != icp_status::cancelled) options.monitor.progress(1);
    result.status = status;
    return result;
  };
  // The last transform whose figures are known, which is returned after a stop.
  auto looked_at = result;
  bool settled = false;
  try {
    while (true) {
      if (options.monitor.stop.stop_requested()) throw cancelled{};
      find_with_memory(searcher, result.transform, memory, pairs);
      auto step = estimate_with_memory(estimator, result.transform, pairs, estimator_memory);
      const double before = result.residual;
      static_cast<alignment_fit&>(result) = std::move(step.fit);
      looked_at = result;
      if (result.pairs < std::max<index_t>(options.min_pairs, 1))
        return end_with(icp_status::too_few_pairs);
      if (result.iterations > 0 && options.residual_tolerance > 0)
        settled =
            settled || std::abs(before - result.residual) <= options.residual_tolerance * before;
      if (settled && result.iterations >= options.min_iterations)
        return end_with(result.undetermined_share() <= options.max_undetermined
                            ? icp_status::converged
                            : icp_status::degenerate);
      if (result.iterations == options.max_iterations) return end_with(icp_status::iteration_limit);

      result.transform = std::move(step.transform);
      result.last_change = step.change;
      ++result.iterations;
      settled = step.change.rotation <= most_rotation &&
                step.change.translation <= std::max(most_translation, step.change.rounding);
      if (options.observer)
        options.observer({result.iterations, result.transform, result.last_change, result});
      if (options.monitor.progress && result.iterations < options.max_iterations)
        options.monitor.progress(double(result.iterations) / double(options.max_iterations));
    }
  } catch (const cancelled&) {
    result = std::move(looked_at);
    return end_with(icp_status::cancelled);
  }
}
/// As above, starting from the identity.
export template <class Searcher, class E>
  requires CorrespondenceSearcher<Searcher, typename E::transform_type> &&
           TransformEstimator<E, pairs_of<Searcher, typename E::transform_type>> &&
           requires(const E& estimator) {
             { estimator.identity() } -> std::same_as<typename E::transform_type>;
           }
[[nodiscard]] auto icp(const Searcher& searcher, const E& estimator,
                       const icp_options<typename E::transform_type>& options = {}) {
  return icp(searcher, estimator, estimator.identity(), options);
}

}  // namespace cilantro
