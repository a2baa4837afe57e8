// SPDX-License-Identifier: MIT
export module cilantro.embedding:multidimensional_scaling;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Whether a matrix holds distances, `plain`, or their squares, `squared`.
export enum class distance_form { plain, squared };

/// Options of `multidimensional_scaling` and `isomap`.
export struct embedding_options {
  /// The number of coordinates. By default, as many as `explained` requires; if that is not given
  /// either, up to the largest gap between consecutive eigenvalues.
  std::optional<index_t> dimension = {};
  /// If given, and `dimension` is not: the fewest coordinates that preserve this share of the
  /// squared scalar products, in (0, 1].
  std::optional<double> explained = {};
  index_t max_dimension = 10;  ///< The most coordinates if `dimension` is not given.
  int max_restarts = 1000;     ///< Of the eigensolver, for more than a few hundred points.
  double tolerance = 1e-10;    ///< Of the eigensolver, relative.
  int threads = 0;
  task_monitor monitor = {};
};

/// Points that preserve distances, and how well they do.
export struct embedding_result {
  /// One column per point, centred at 0; one row per coordinate, in descending order of variance.
  /// The entry of largest magnitude in each row is positive.
  Eigen::MatrixXd points;
  /// The eigenvalues of the matrix of scalar products, descending, including those that are not
  /// embedded: all of them for up to 300 points, otherwise the leading ones.
  Eigen::VectorXd eigenvalues;
  /// The smallest of all eigenvalues, if it could be computed. If it is clearly below 0, no points
  /// of any dimension have exactly these distances.
  std::optional<double> smallest_eigenvalue;
  /// The share of the squared scalar products that the coordinates preserve: Σ λ² of the embedded
  /// eigenvalues, divided by that of all. 1 if all points are equal.
  double explained = 1;
  /// False if the eigensolver did not converge: then no point has coordinates.
  bool converged = true;
};

/// Classical multidimensional scaling: points whose distances are the given ones, as far as their
/// dimension allows. Their coordinates come from the leading eigenvectors of the matrix of scalar
/// products that the distances imply. Only positive eigenvalues are embedded; if there are fewer of
/// them than coordinates requested, there are fewer coordinates. The same for any number of
/// threads. O(N² · dimension) and 8 N² bytes.
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
