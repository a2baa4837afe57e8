// SPDX-License-Identifier: MIT
//
// Tests whether a similarity or a kernel of yours does what its concept says, beyond what a
// compiler can check. Each check returns a sentence for each rule that is broken; if there is none,
// the type can be used.
export module cilantro.clustering:contract;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :kernel;

namespace cilantro {

/// Tests a similarity function of yours on the pairs of a graph: that the answer for (i, j) is the
/// same again, and the same as for (j, i).
export template <Scalar S, SimilarityFunction<S> F>
[[nodiscard]] std::vector<std::string> check_similarity_function(const F& similar,
                                                                 const neighborhoods<S>& graph) {
  violation_list violations;
  for (index_t i = 0; i < graph.size(); ++i)
    for (const auto& [j, distance] : graph[i]) {
      const bool there = evaluate_pair(similar, i, j, distance);
      violations.expect(there == evaluate_pair(similar, i, j, distance),
                        "two answers for the same pair differ");
      violations.expect(there == evaluate_pair(similar, j, i, distance),
                        "the answer for (i, j) is not that for (j, i)");
    }
  return violations.take();
}

/// Tests a kernel of yours at many distances: that it is finite, not negative, not increasing,
/// positive at 0, and 0 beyond its support.
export template <Kernel K>
[[nodiscard]] std::vector<std::string> check_kernel(const K& kernel) {
  violation_list violations;
  const double support = double(kernel.support);
  const double end = std::isfinite(support) ? 1.5 * support : 10;
  violations.expect(support > 0, "the support is not positive");
  violations.expect(double(kernel(0.0)) > 0, "the kernel is not positive at 0");
  double before = std::numeric_limits<double>::infinity();
  for (int step = 0; step <= 3000; ++step) {
    const double u = end * step / 3000;
    const double value = kernel(u);
    violations.expect(std::isfinite(value) && value >= 0, "a value is negative or not finite");
    violations.expect(value <= before, "the kernel increases with the distance");
    violations.expect(u <= support || value == 0, "the kernel is not 0 beyond its support");
    before = value;
  }
  return violations.take();
}

}  // namespace cilantro
