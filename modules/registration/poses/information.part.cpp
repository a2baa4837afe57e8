// SPDX-License-Identifier: MIT
//
// What edges must be, and how much they say.
module cilantro.registration:information;

import cilantro.standard;
import cilantro.core;
import :pose_edge;

namespace cilantro {

/// How much an information matrix says.
struct information_content {
  int rank = 0;                  ///< The number of directions that are measured.
  double log_determinant = 0;    ///< In these directions.
  bool is_semidefinite = false;  ///< Whether it is one at all: symmetric, and nowhere below 0.
};

/// By Cholesky's method with pivots, of the matrix scaled to ones on the diagonal, since its
/// unknowns are radians and lengths.
template <int D>
[[nodiscard]] information_content content_of(const pose_information<D>& information) {
  constexpr int u = pose_unknowns<D>;
  constexpr double rounding = 1e-6, negligible = 1e-12;
  information_content content;
  if (!information.allFinite()) return content;
  const Eigen::Matrix<double, pose_unknowns<D>, 1> scale =
      information.diagonal().unaryExpr([](double x) { return x > 0 ? 1 / std::sqrt(x) : 1.0; });
  pose_information<D> rest = scale.asDiagonal() * information * scale.asDiagonal();
  if ((rest - rest.transpose()).cwiseAbs().maxCoeff() > rounding) return content;
  for (; content.rank < u; ++content.rank) {
    int pivot = 0;
    const double largest = rest.diagonal().maxCoeff(&pivot);
    if (largest <= negligible) break;
    content.log_determinant += std::log(largest) - 2 * std::log(scale[pivot]);
    const Eigen::Matrix<double, pose_unknowns<D>, 1> column = rest.col(pivot) / largest;
    rest -= column * rest.row(pivot);
    rest.col(pivot).setZero();
    rest.row(pivot).setZero();
  }
  content.is_semidefinite = rest.cwiseAbs().maxCoeff() <= rounding;
  return content;
}

/// Whether a transform is finite and its linear part a rotation, to float's precision.
template <int D>
[[nodiscard]] bool is_rigid(const rigid_transform<double, D>& t) {
  return t.matrix().allFinite() && (t.linear() * t.linear().transpose()).isIdentity(1e-3) &&
         t.linear().determinant() > 0;
}

/// Throws `invalid_input` unless edge number `number` is one of a graph with so many nodes;
/// otherwise returns how much it says.
template <int D>
information_content expect_edge(const pose_edge<D>& edge, index_t number, index_t nodes) {
  const auto complain = [&](const std::string& what) {
    throw invalid_input{"pose graph: edge " + std::to_string(number) + " (from node " +
                        std::to_string(edge.source) + " to node " + std::to_string(edge.target) +
                        ") " + what};
  };
  if (!(0 <= edge.source && edge.source < nodes && 0 <= edge.target && edge.target < nodes))
    complain("names a node that there is not; there are " + std::to_string(nodes));
  if (edge.source == edge.target) complain("connects a node with itself");
  if (!is_rigid<D>(edge.transform))
    complain("has a transform that is not finite, or not a rotation and a translation");
  const auto content = content_of<D>(edge.information);
  if (!content.is_semidefinite)
    complain("has an information matrix that is not finite, symmetric and positive semidefinite");
  return content;
}

}  // namespace cilantro
