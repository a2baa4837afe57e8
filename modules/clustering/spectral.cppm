// SPDX-License-Identifier: MIT
export module cilantro.clustering:spectral;

import cilantro.standard;
import cilantro.core;
import cilantro.numeric;
import cilantro.search;
import :clusters;

namespace cilantro {

/// Which Laplacian of a graph with affinities W and degrees D = diag(Σⱼ wᵢⱼ).
export enum class laplacian {
  unnormalized,  ///< D − W: clusters of similar size are cut.
  symmetric,     ///< I − D^−½ W D^−½, with rows of the embedding brought to unit length.
  random_walk,   ///< I − D⁻¹ W: clusters that a random walk seldom leaves. Usually the best.
};

export struct spectral_options {
  /// If left out, where the eigenvalues leave the largest gap behind them, up to `max_clusters`.
  std::optional<index_t> clusters = {};
  index_t max_clusters = 10;
  laplacian matrix = laplacian::random_walk;
  int kmeans_restarts = 10;         ///< In the embedding.
  int max_solver_restarts = 1000;   ///< Of the eigensolver, for graphs that are not small.
  double solver_tolerance = 1e-10;  ///< Of the eigensolver, relative.
  std::uint64_t seed = 0;
  int threads = 0;
  task_monitor monitor = {};
};

export struct spectral_result : clusters {
  /// The smallest eigenvalues of the Laplacian, ascending: one more than clusters were sought, or
  /// all there are.
  Eigen::VectorXd eigenvalues;
  /// A column for each point, whose coordinates k-means has clustered; no columns where the
  /// components of the graph are the clusters.
  Eigen::MatrixXd embedding;
  index_t components = 0;  ///< Of the graph: the multiplicity of the eigenvalue 0.
  /// False if the eigensolver gave up: then no point is in a cluster.
  bool converged = true;
};

/// Clusters the nodes of a graph so that they have much affinity within and little across: by
/// k-means of the first eigenvectors of a Laplacian.
///
/// Each connected component is decomposed by itself, which makes the multiplicity of 0 exact. Where
/// there are at least as many components as clusters sought, the largest components are the
/// clusters, and the other nodes are in none; a node without affinities is such a component. A
/// stored entry on the diagonal counts to the degree. The same for any number of threads.
///
/// Throws `invalid_input` unless the matrix is square, symmetric (up to rounding of 1e-9 of its
/// largest entry), and finite, with no entry negative, for a number of clusters below 1 or above
/// that of the nodes, and for options that are negative; `cancelled`.
/// Source: von Luxburg 2007, "A tutorial on spectral clustering", sections 3, 4 and 8.3; Shi &
/// Malik 2000; Ng, Jordan & Weiss 2002.
export [[nodiscard]] spectral_result spectral_clustering(const sparse_matrix& affinity,
                                                         const spectral_options& options = {});
/// As above, of a dense matrix; zeros are no edges.
export [[nodiscard]] spectral_result spectral_clustering(const Eigen::MatrixXd& affinity,
                                                         const spectral_options& options = {});
/// As above, of what `pair_matrix` gives for points in float.
export [[nodiscard]] spectral_result spectral_clustering(const graph_matrix<float>& affinity,
                                                         const spectral_options& options = {});

}  // namespace cilantro
