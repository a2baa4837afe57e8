// SPDX-License-Identifier: MIT
module;
#include <algorithm>
module cilantro.geometry;

namespace cilantro {

void descending_axes(const Eigen::MatrixXd& covariance, Eigen::VectorXd& eigenvalues,
                     Eigen::MatrixXd& axes) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver{covariance};
  eigenvalues = solver.eigenvalues().reverse().cwiseMax(0);
  axes = solver.eigenvectors().rowwise().reverse();
  // The same axes for the same points, whatever signs the solver chose.
  for (index_t k = 0; k < axes.cols(); ++k) {
    index_t largest = 0;
    axes.col(k).cwiseAbs().maxCoeff(&largest);
    if (axes(largest, k) < 0) axes.col(k) = -axes.col(k);
  }
  if (axes.cols() > 0 && axes.determinant() < 0) axes.rightCols(1) = -axes.rightCols(1);
}

}  // namespace cilantro
