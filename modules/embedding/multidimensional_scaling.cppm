// SPDX-License-Identifier: MIT
export module cilantro.embedding:multidimensional_scaling;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// What the numbers of a matrix of distances are.
export enum class distance_form { plain, squared };

export struct embedding_options {
  /// The number of coordinates. If left out, as many as `explained` asks for, or without that, up
  /// to where the eigenvalues leave the largest gap behind them.
  std::optional<index_t> dimension = {};
  /// As few coordinates as keep this share of the squared scalar products, in (0, 1].
  std::optional<double> explained = {};
  index_t max_dimension = 10;  ///< For the latter two.
  int max_restarts = 1000;     ///< Of the eigensolver, for more than a few hundred points.
  double tolerance = 1e-10;    ///< Of the eigensolver, relative.
  int threads = 0;
  task_monitor monitor = {};
};

/// Points that keep distances, and how well.
export struct embedding_result {
  /// A column for each point, centred at 0; a row for each coordinate, the widest first. Of each
  /// row, the entry of largest magnitude is positive.
  Eigen::MatrixXd points;
  /// Of the matrix of scalar products, descending: all of them for up to 300 points, otherwise the
  /// leading ones. Those that are not embedded are here, too.
  Eigen::VectorXd eigenvalues;
  /// The smallest eigenvalue of all, where it could be found. Clearly below 0: no points of any
  /// dimension have these distances.
  std::optional<double> smallest_eigenvalue;
  /// The share of the squared scalar products that the coordinates keep: Σ λ² over those that are
  /// embedded, over that of all. 1 if all points are equal.
  double explained = 1;
  /// False if the eigensolver gave up: then no point has coordinates.
  bool converged = true;
};

/// Classical multidimensional scaling: points whose distances are the given ones, as far as their
/// dimension lets them, from the leading eigenvectors of the matrix of scalar products that the
/// distances imply. Only positive eigenvalues are embedded: if there are fewer than coordinates
/// asked for, there are fewer coordinates. The same for any number of threads. O(N² · dimension)
/// and 8 N² bytes.
///
/// Throws `invalid_input` unless the distances are square, symmetric (up to rounding of 1e-9 of the
/// largest), finite, not negative, and 0 on the diagonal, and for options that make no sense;
/// `cancelled`.
/// Source: Torgerson 1952, "Multidimensional scaling: I. Theory and method"; Gower 1966; the share
/// is that of Mardia 1978, "Some properties of classical multi-dimensional scaling".
export [[nodiscard]] embedding_result multidimensional_scaling(
    Eigen::MatrixXd distances, const embedding_options& options = {},
    distance_form form = distance_form::plain);

}  // namespace cilantro
