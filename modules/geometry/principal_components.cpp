// SPDX-License-Identifier: MIT
module cilantro.geometry;

namespace cilantro {

void descending_axes(const Eigen::MatrixXd& covariance, Eigen::VectorXd& eigenvalues,
                     Eigen::MatrixXd& axes) {
  const auto decomposition = decompose_symmetric(covariance);
  eigenvalues = decomposition.values.reverse().cwiseMax(0);
  axes = decomposition.vectors.rowwise().reverse();
  // The same axes for the same points, whatever signs the solver chose.
  for (index_t k = 0; k < axes.cols(); ++k) {
    index_t largest = 0;
    axes.col(k).cwiseAbs().maxCoeff(&largest);
    if (axes(largest, k) < 0) axes.col(k) = -axes.col(k);
  }
  if (axes.cols() > 0 && determinant(axes) < 0) axes.rightCols(1) = -axes.rightCols(1);
}

}  // namespace cilantro
