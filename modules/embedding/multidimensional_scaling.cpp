// SPDX-License-Identifier: MIT
module cilantro.embedding;

import cilantro.numeric;

namespace cilantro {
namespace {

constexpr double rounding = 1e-9;
/// Up to here all eigenvalues are wanted, since they cost no more than a few.
constexpr index_t small = 300;

void expect_distances(const Eigen::MatrixXd& d) {
  expects(d.rows() == d.cols() && d.allFinite(),
          "multidimensional_scaling: the distances must be a square matrix, and finite");
  if (d.size() == 0) return;
  const double largest = d.maxCoeff();
  expects(d.minCoeff() >= 0, "multidimensional_scaling: a distance is negative");
  expects(d.diagonal().maxCoeff() <= rounding * largest,
          "multidimensional_scaling: a point is not at distance 0 from itself");
  for (index_t j = 0; j < d.cols(); ++j)
    for (index_t i = 0; i < j; ++i)
      expects(std::abs(d(i, j) - d(j, i)) <= rounding * largest,
              "multidimensional_scaling: the distances must be symmetric");
}

void expect_sensible(const embedding_options& options) {
  expect_from(1, double(options.dimension.value_or(1)), "multidimensional_scaling: dimension");
  expect_from(1, double(options.max_dimension), "multidimensional_scaling: max_dimension");
  expects(!options.explained || (*options.explained > 0 && *options.explained <= 1),
          "multidimensional_scaling: explained must be above 0, and at most 1");
  expect_from(0, options.max_restarts, "multidimensional_scaling: max_restarts");
  expect_from(0, options.tolerance, "multidimensional_scaling: tolerance");
}

/// From distances to the scalar products of points around their mean, in place.
void to_products(Eigen::MatrixXd& d, distance_form form, const execution& how) {
  const index_t n = d.rows();
  parallel_blocks(n, 16, how, [&](index_t, index_t begin, index_t end) {
    for (index_t j = begin; j < end; ++j) {
      if (form == distance_form::plain) d.col(j) = d.col(j).cwiseAbs2();
      d.col(j) *= -0.5;
    }
  });
  Eigen::VectorXd means(n);
  parallel_blocks(n, 16, how, [&](index_t, index_t begin, index_t end) {
    for (index_t j = begin; j < end; ++j) means[j] = d.col(j).mean();
  });
  const double mean = means.mean();
  parallel_blocks(n, 16, how, [&](index_t, index_t begin, index_t end) {
    for (index_t j = begin; j < end; ++j) d.col(j).array() += mean - means.array() - means[j];
  });
}

index_t chosen_dimension(const Eigen::VectorXd& eigenvalues, double total,
                         const embedding_options& options) {
  const index_t positive =
      (eigenvalues.array() > rounding * std::max(0.0, eigenvalues.size() ? eigenvalues[0] : 0.0))
          .count();
  if (options.dimension) return std::min(*options.dimension, positive);
  const index_t most = std::min(options.max_dimension, positive);
  if (options.explained) {
    double sum = 0;
    for (index_t k = 0; k < most; ++k) {
      sum += eigenvalues[k] * eigenvalues[k];
      if (sum >= *options.explained * total) return k + 1;
    }
    return most;
  }
  index_t best = std::min<index_t>(1, most);
  const auto gap = [&](index_t k) {
    const double next = k < eigenvalues.size() ? std::max(0.0, eigenvalues[k]) : 0;
    return eigenvalues[k - 1] - next;
  };
  for (index_t k = 2; k <= most; ++k)
    if (gap(k) > gap(best)) best = k;
  return best;
}

}  // namespace

embedding_result multidimensional_scaling(Eigen::MatrixXd distances,
                                          const embedding_options& options, distance_form form) {
  expect_distances(distances);
  expect_sensible(options);
  embedding_result result;
  const index_t n = distances.rows();
  if (n == 0) return result;
  const execution how{options.threads, {{}, options.monitor.stop}};
  to_products(distances, form, how);

  const index_t wanted =
      n <= small ? n : std::min(n, options.dimension.value_or(options.max_dimension) + 1);
  eigenpair_options solver{.max_restarts = options.max_restarts,
                           .tolerance = options.tolerance,
                           .threads = options.threads,
                           .monitor = how.monitor};
  const auto leading = largest_eigenpairs(distances, wanted, solver);
  result.converged = leading.converged;
  if (!leading.converged) return result;
  result.eigenvalues = leading.values;
  const double total = distances.squaredNorm();
  if (wanted == n) {
    result.smallest_eigenvalue = leading.values[n - 1];
  } else {
    // A hint only: not worth many restarts.
    solver.max_restarts = std::min(solver.max_restarts, 50);
    solver.tolerance = std::max(solver.tolerance, 1e-6);
    distances *= -1;
    const auto least = largest_eigenpairs(distances, 1, solver);
    if (least.converged) result.smallest_eigenvalue = -least.values[0];
  }
  const index_t k = chosen_dimension(result.eigenvalues, total, options);
  result.points =
      leading.values.head(k).cwiseSqrt().asDiagonal() * leading.vectors.leftCols(k).transpose();
  if (total > 0) result.explained = result.eigenvalues.head(k).squaredNorm() / total;
  return result;
}

}  // namespace cilantro
