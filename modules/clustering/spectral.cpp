// SPDX-License-Identifier: MIT
module cilantro.clustering;

import cilantro.numeric;

namespace cilantro {
namespace {

constexpr double rounding = 1e-9;

/// Calls `f(i, j, value)` for each stored entry.
template <class F>
void for_each_entry(const sparse_matrix& matrix, F&& f) {
  for (index_t i = 0; i < matrix.rows(); ++i)
    for (auto k = matrix.outerIndexPtr()[i]; k < matrix.outerIndexPtr()[i + 1]; ++k)
      f(i, index_t{matrix.innerIndexPtr()[k]}, matrix.valuePtr()[k]);
}

void expect_affinities(const sparse_matrix& w) {
  expects(w.rows() == w.cols(), "spectral_clustering: the matrix must be square");
  expects(w.isCompressed(), "spectral_clustering: the matrix must be compressed");
  double largest = 0;
  for_each_entry(w, [&](index_t, index_t, double value) {
    expects(value >= 0 && std::isfinite(value),
            "spectral_clustering: affinities must be finite and not negative");
    largest = std::max(largest, value);
  });
  const sparse_matrix difference = w - sparse_matrix{w.transpose()};
  for_each_entry(difference, [&](index_t, index_t, double value) {
    expects(std::abs(value) <= rounding * largest,
            "spectral_clustering: the matrix must be symmetric");
  });
}

/// The Laplacian of one component, turned so that what is sought is largest: shift − eigenvalue.
struct component_problem {
  sparse_matrix matrix;
  double shift;
};

component_problem problem_of(const sparse_matrix& w, std::span<const std::int32_t> nodes,
                             std::span<const std::int32_t> place, const Eigen::VectorXd& degree,
                             laplacian kind) {
  const bool plain = kind == laplacian::unnormalized;
  // Gershgorin: no eigenvalue of D − W is above twice the largest degree, none of the others above
  // 2. Larger than that by a little, zero eigenvalues of the turned matrix cannot be wanted ones.
  double shift = 2;
  if (plain) {
    shift = 0;
    for (const auto i : nodes) shift = std::max(shift, 2 * degree[i]);
  }
  const auto m = static_cast<std::int32_t>(nodes.size());
  sparse_matrix turned(m, m);
  for (std::int32_t row = 0; row < m; ++row) {
    const auto i = nodes[row];
    const double diagonal = plain ? shift - degree[i] : shift - 1;
    turned.startVec(row);
    bool is_stored = false;
    const auto store_diagonal = [&](double w_ii) {
      turned.insertBackByOuterInner(row, row) = diagonal + w_ii;
      is_stored = true;
    };
    for (auto k = w.outerIndexPtr()[i]; k < w.outerIndexPtr()[i + 1]; ++k) {
      const auto j = w.innerIndexPtr()[k];
      const double value =
          plain ? w.valuePtr()[k] : w.valuePtr()[k] / std::sqrt(degree[i] * degree[j]);
      if (!(w.valuePtr()[k] > 0)) continue;
      if (j >= i && !is_stored && j != i) store_diagonal(0);
      if (j == i)
        store_diagonal(value);
      else
        turned.insertBackByOuterInner(row, place[j]) = value;
    }
    if (!is_stored) store_diagonal(0);
  }
  turned.finalize();
  return {turned, shift};
}

/// An eigenpair of one of the components.
struct mode {
  double eigenvalue;
  index_t component, column;
};

index_t largest_gap(const Eigen::VectorXd& ascending, index_t most) {
  index_t best = 1;
  for (index_t k = 1; k < ascending.size() && k <= most; ++k)
    if (ascending[k] - ascending[k - 1] > ascending[best] - ascending[best - 1]) best = k;
  return best;
}

}  // namespace

spectral_result spectral_clustering(const sparse_matrix& affinity,
                                    const spectral_options& options) {
  expect_affinities(affinity);
  const index_t n = affinity.rows();
  const index_t most = options.clusters.value_or(std::min(options.max_clusters, n));
  expects(most >= (n > 0) && most <= n,
          "spectral_clustering: there must be between 1 and N clusters");
  expect_from(1, options.kmeans_restarts, "spectral_clustering: kmeans_restarts");
  expect_from(0, options.max_solver_restarts, "spectral_clustering: max_solver_restarts");
  expect_from(0, options.solver_tolerance, "spectral_clustering: solver_tolerance");
  spectral_result result;
  if (n == 0) return result;

  Eigen::VectorXd degree = Eigen::VectorXd::Zero(n);
  disjoint_sets sets{n};
  for_each_entry(affinity, [&](index_t i, index_t j, double value) {
    degree[i] += value;
    if (value > 0) sets.join(i, j);
  });
  const clusters components = components_of(sets, {}, {});
  result.components = components.size();
  const auto labels_up_to = [&](index_t k) {
    std::vector<clusters::label> labels(components.labels().begin(), components.labels().end());
    for (auto& l : labels)
      if (l >= k) l = clusters::none;
    return labels;
  };
  if (options.clusters && components.size() >= *options.clusters) {
    result.eigenvalues = Eigen::VectorXd::Zero(std::min(components.size(), most + 1));
    static_cast<clusters&>(result) = clusters{labels_up_to(most)};
    return result;
  }

  std::vector<std::int32_t> place(n);
  for (const auto nodes : components)
    for (std::size_t p = 0; p < nodes.size(); ++p) place[nodes[p]] = static_cast<std::int32_t>(p);
  const eigenpair_options how{.max_restarts = options.max_solver_restarts,
                              .tolerance = options.solver_tolerance,
                              .threads = options.threads,
                              .monitor = options.monitor};
  std::vector<mode> modes;
  std::vector<Eigen::MatrixXd> vectors;
  for (index_t c = 0; c < components.size(); ++c) {
    // Of all components together, no more than one eigenvalue above 0 a sought cluster can matter.
    const index_t wanted = std::min<index_t>(most + 1, std::ssize(components[c]));
    const auto [matrix, shift] = problem_of(affinity, components[c], place, degree, options.matrix);
    auto found = largest_eigenpairs(matrix, wanted, how);
    if (!found.converged) {
      result.converged = false;
      static_cast<clusters&>(result) =
          clusters{std::vector<clusters::label>(static_cast<std::size_t>(n), clusters::none)};
      return result;
    }
    for (index_t k = 0; k < wanted; ++k)
      modes.push_back({k == 0 ? 0 : std::max(0.0, shift - found.values[k]), c, k});
    vectors.push_back(std::move(found.vectors));
  }
  std::ranges::sort(modes, [](const mode& a, const mode& b) {
    return std::tie(a.eigenvalue, a.component, a.column) <
           std::tie(b.eigenvalue, b.component, b.column);
  });
  modes.resize(std::min(modes.size(), static_cast<std::size_t>(most) + 1));
  result.eigenvalues.resize(std::ssize(modes));
  for (index_t k = 0; k < std::ssize(modes); ++k) result.eigenvalues[k] = modes[k].eigenvalue;

  const index_t k = options.clusters ? most : largest_gap(result.eigenvalues, most);
  if (components.size() >= k) {
    static_cast<clusters&>(result) = clusters{labels_up_to(k)};
    return result;
  }
  result.embedding = Eigen::MatrixXd::Zero(k, n);
  for (index_t row = 0; row < k; ++row) {
    const auto& [value, c, column] = modes[row];
    for (std::size_t p = 0; p < components[c].size(); ++p) {
      const auto i = components[c][p];
      double entry = vectors[c](index_t(p), column);
      if (options.matrix == laplacian::random_walk && degree[i] > 0) entry /= std::sqrt(degree[i]);
      result.embedding(row, i) = entry;
    }
  }
  if (options.matrix == laplacian::symmetric)
    for (auto column : result.embedding.colwise())
      if (const double length = column.norm(); length > 0) column /= length;
  static_cast<clusters&>(result) = kmeans(result.embedding, k,
                                          {.restarts = options.kmeans_restarts,
                                           .max_iterations = 300,
                                           .seed = options.seed,
                                           .threads = options.threads,
                                           .monitor = {{}, options.monitor.stop}});
  return result;
}

spectral_result spectral_clustering(const Eigen::MatrixXd& affinity,
                                    const spectral_options& options) {
  expects(affinity.rows() == affinity.cols() && affinity.allFinite(),
          "spectral_clustering: the matrix must be square, and affinities finite");
  return spectral_clustering(sparse_matrix{affinity.sparseView(0.0)}, options);
}

spectral_result spectral_clustering(const graph_matrix<float>& affinity,
                                    const spectral_options& options) {
  return spectral_clustering(sparse_matrix{affinity.cast<double>()}, options);
}

}  // namespace cilantro
