// SPDX-License-Identifier: MIT
export module cilantro.clustering:spectral;

import cilantro.standard;
import cilantro.core;
import cilantro.numeric;
import cilantro.search;
import :clusters;

namespace cilantro {

/// The Laplacians of a graph with affinities W and degrees D = diag(Σⱼ wᵢⱼ).
export enum class laplacian {
  unnormalized,  ///< D − W: favours clusters of similar size.
  symmetric,     ///< I − D^−½ W D^−½; each point of the embedding is scaled to unit length.
  /// I − D⁻¹ W: finds clusters that a random walk seldom leaves. Usually the best choice.
  random_walk,
};

/// Options of `spectral_clustering`.
export struct spectral_options {
  /// The number of clusters. By default, where the largest gap between consecutive eigenvalues is,
  /// up to `max_clusters`.
  std::optional<index_t> clusters = {};
  index_t max_clusters = 10;                  ///< If `clusters` is not given.
  laplacian matrix = laplacian::random_walk;  ///< Which Laplacian is decomposed.
  int kmeans_restarts = 10;                   ///< Starts of k-means in the embedding.
  int max_solver_restarts = 1000;   ///< Of the eigensolver, for graphs that are not small.
  double solver_tolerance = 1e-10;  ///< Of the eigensolver, relative.
  std::uint64_t seed = 0;           ///< Determines the starts of k-means.
  int threads = 0;
  task_monitor monitor = {};
};

/// The clusters, and the decomposition that they come from.
export struct spectral_result : clusters {
  /// The smallest eigenvalues of the Laplacian, ascending: one more than the number of clusters, or
  /// all if there are fewer.
  Eigen::VectorXd eigenvalues;
  /// One column per point, whose coordinates k-means has clustered; no columns if the components of
  /// the graph are the clusters.
  Eigen::MatrixXd embedding;
  /// Connected components of the graph: the multiplicity of the eigenvalue 0.
  index_t components = 0;
  /// False if the eigensolver did not converge: then no point is in a cluster.
  bool converged = true;
};

/// Clusters the nodes of a graph so that affinities are high within clusters and low between them,
/// by k-means on the first eigenvectors of a Laplacian.
///
/// Each connected component is decomposed by itself, which makes the multiplicity of the eigenvalue
/// 0 exact. If there are at least as many components as clusters wanted, the largest components are
/// the clusters, and the other nodes are in none; a node without affinities is a component of its
/// own. Stored entries on the diagonal count towards the degree. The same for any number of
/// threads.
///
/// Throws `invalid_input` unless the matrix is square, symmetric (up to rounding of 1e-9 of its
/// largest entry), and finite, with no entry negative, for a number of clusters below 1 or above
/// that of the nodes, and for options that are negative; `cancelled`.
/// Source: von Luxburg 2007, "A tutorial on spectral clustering", sections 3, 4 and 8.3; Shi &
/// Malik 2000; Ng, Jordan & Weiss 2002.
export [[nodiscard]] spectral_result spectral_clustering(const sparse_matrix& affinity,
                                                         const spectral_options& options = {});
/// As above, for a dense matrix, in which zeros are not edges.
export [[nodiscard]] spectral_result spectral_clustering(const Eigen::MatrixXd& affinity,
                                                         const spectral_options& options = {});
/// As above, for a matrix that `pair_matrix` returns for points in float.
export [[nodiscard]] spectral_result spectral_clustering(const graph_matrix<float>& affinity,
                                                         const spectral_options& options = {});

}  // namespace cilantro
