// SPDX-License-Identifier: MIT
export module cilantro.registration:normal_equations;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A least-squares problem with a few unknowns δ. Sums over the pairs are divided by the sum of
/// their weights, each times the largest squared gradient of its residuals, which is 1 for
/// residuals that are distances.
export struct normal_equations {
  Eigen::MatrixXd information;  ///< Σ w JᵀJ.
  Eigen::VectorXd gradient;     ///< Σ w Jᵀr.
  Eigen::MatrixXd motion;       ///< The mean squared displacement of the points, δᵀ motion δ.
};

/// The solution of normal equations, and how far it is determined; `directions`, `eigenvalues` and
/// `undetermined` are as in `alignment_fit`.
export struct normal_solution {
  Eigen::VectorXd step;  ///< The unknowns; zero along directions that are not determined.
  Eigen::MatrixXd directions;
  Eigen::VectorXd eigenvalues;  ///< Ascending.
  index_t undetermined = 0;
};

/// Solves normal equations. Pure. Models: `truncated_solver`; a function of yours, for example with
/// damping.
export template <class T>
concept NormalEquationSolver = requires(const T& solver, const normal_equations& equations) {
  { solver(equations) } -> std::same_as<normal_solution>;
};

/// Takes the Gauss–Newton step in the directions that the residuals determine, and no step in the
/// others.
///
/// Solves information · v = λ motion · v: λ is the mean squared change of the residuals when the
/// points move by one unit, root mean square. For residuals that are distances, λ is from 0 to 1,
/// whatever the units, the origin or the number of points. Directions with λ below the limit are
/// left out. Source: Gelfand et al. 2003, "Geometrically stable sampling for the ICP algorithm",
/// for the idea; Zhang, Kaess & Singh 2016, "On degeneracy of optimization-based state estimation
/// problems", for leaving directions out.
export struct truncated_solver {
  /// A direction with a smaller eigenvalue counts as undetermined. A plane whose normals deviate by
  /// 0.045 rad reaches 0.002 for sliding along itself; scans of rooms and streets reach 0.1 for
  /// their least determined direction.
  double min_eigenvalue = 2e-3;

  [[nodiscard]] normal_solution operator()(const normal_equations& equations) const;
};

}  // namespace cilantro
