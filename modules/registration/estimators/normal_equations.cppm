// SPDX-License-Identifier: MIT
export module cilantro.registration:normal_equations;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A least-squares problem of a few unknowns δ. Sums over the pairs are divided by the weights,
/// times what each pair sees in the direction in which it sees most: 1 for residuals that are
/// distances.
export struct normal_equations {
  Eigen::MatrixXd information;  ///< Σ w JᵀJ.
  Eigen::VectorXd gradient;     ///< Σ w Jᵀr.
  Eigen::MatrixXd motion;       ///< The mean squared displacement of the points, δᵀ motion δ.
};

/// The answer, and which directions it is an answer in; see `alignment_fit` for the meaning of
/// directions and eigenvalues.
export struct normal_solution {
  Eigen::VectorXd step;  ///< Zero along what is not determined.
  Eigen::MatrixXd directions;
  Eigen::VectorXd eigenvalues;  ///< Ascending.
  index_t undetermined = 0;
};

/// Solves normal equations. Pure. Models: `truncated_solver`; a function of yours, with damping for
/// example.
export template <class T>
concept NormalEquationSolver = requires(const T& solver, const normal_equations& equations) {
  { solver(equations) } -> std::same_as<normal_solution>;
};

/// Gauss–Newton in the directions that the residuals see, and no step in the others.
///
/// Solves information · v = λ motion · v: λ is the mean squared change of the residuals that a
/// motion of the points by one unit, root mean square, makes. Residuals that are distances have λ
/// from 0 to 1, whatever the units, the origin or the number of points. Directions below the limit
/// are left out. Source: Gelfand et al. 2003, "Geometrically stable sampling for the ICP
/// algorithm", for the idea; Zhang, Kaess & Singh 2016, "On degeneracy of optimization-based state
/// estimation problems", for leaving directions out.
export struct truncated_solver {
  /// Below this share of motion seen, a direction counts as undetermined. 0.002 is what a plane
  /// seems to tell about sliding in itself if its normals deviate by 0.045 rad; scans of rooms and
  /// streets tell 0.1 about their least determined direction.
  double min_eigenvalue = 2e-3;

  [[nodiscard]] normal_solution operator()(const normal_equations& equations) const;
};

}  // namespace cilantro
