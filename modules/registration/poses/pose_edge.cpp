// SPDX-License-Identifier: MIT
module cilantro.registration;

import cilantro.numeric;
import :information;
import :twists;

namespace cilantro {

Eigen::MatrixXd information_of(const alignment_fit& fit, const pose_edge_options& options) {
  const index_t unknowns = fit.information.rows();
  const index_t dimension = unknowns == 3 ? 2 : 3;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  if (fit.pairs == 0) return information;
  // The directions are conjugate, so that each can be taken apart by itself.
  for (index_t k = fit.undetermined; k < fit.directions.cols(); ++k) {
    const Eigen::VectorXd image = fit.information * fit.directions.col(k);
    information += image * image.transpose() / fit.directions.col(k).dot(image);
  }
  double noise = 0;
  if (options.noise) {
    noise = *options.noise;
  } else {
    // A rotation moves a residual by its lever times what a translation does.
    const Eigen::VectorXd diagonal = fit.information.diagonal();
    const double squared_lever =
        diagonal.head(unknowns - dimension).sum() / diagonal.tail(dimension).sum();
    noise = std::max(fit.residual, 1e-6 * std::sqrt(squared_lever));
    expects(noise > 0 && std::isfinite(noise),
            "pose_edge_of: the residuals are 0, so that .noise must be given");
  }
  const double independent = std::min(1.0, options.independent_pairs / double(fit.pairs));
  return information * (independent / (noise * noise));
}

template <int D>
pose_edge<D> reversed(const pose_edge<D>& edge) {
  const pose_information<D> change = adjoint<D>(edge.transform);
  pose_edge<D> other = edge;
  other.source = edge.target;
  other.target = edge.source;
  other.transform = edge.transform.inverse();
  const pose_information<D> information = change.transpose() * edge.information * change;
  other.information = (information + information.transpose()) / 2;
  return other;
}

template <int D>
std::vector<rigid_transform<double, D>> poses_from_edges(index_t nodes,
                                                         const std::vector<pose_edge<D>>& edges) {
  expect_from(0, double(nodes), "poses_from_edges: the number of nodes");
  std::vector<information_content> contents;
  for (index_t e = 0; e < std::ssize(edges); ++e)
    contents.push_back(expect_edge(edges[e], e, nodes));
  std::vector<index_t> order(edges.size());
  std::iota(order.begin(), order.end(), index_t(0));
  std::ranges::sort(order, std::ranges::greater{}, [&](index_t e) {
    return std::tuple{edges[e].trusted, contents[e].rank, contents[e].log_determinant, -e};
  });
  disjoint_sets trees{nodes};
  std::vector<std::vector<index_t>> followed(static_cast<std::size_t>(nodes));
  for (const index_t e : order)
    if (contents[e].rank > 0 && trees.join(edges[e].source, edges[e].target)) {
      followed[edges[e].source].push_back(e);
      followed[edges[e].target].push_back(e);
    }

  std::vector<rigid_transform<double, D>> poses(static_cast<std::size_t>(nodes),
                                                rigid_transform<double, D>::Identity());
  std::vector<bool> is_reached(static_cast<std::size_t>(nodes));
  std::vector<index_t> front;
  for (index_t start = 0; start < nodes; ++start) {
    if (is_reached[start]) continue;
    is_reached[start] = true;
    front.push_back(start);
    while (!front.empty()) {
      const index_t at = front.back();
      front.pop_back();
      for (const index_t e : followed[at]) {
        const auto& edge = edges[e];
        const index_t next = edge.source == at ? edge.target : edge.source;
        if (is_reached[next]) continue;
        is_reached[next] = true;
        poses[next] = normalized<D>(
            poses[at] * (edge.source == at ? edge.transform.inverse() : edge.transform));
        front.push_back(next);
      }
    }
  }
  return poses;
}

template pose_edge<2> reversed(const pose_edge<2>&);
template pose_edge<3> reversed(const pose_edge<3>&);
template std::vector<rigid_transform<double, 2>> poses_from_edges(index_t,
                                                                  const std::vector<pose_edge<2>>&);
template std::vector<rigid_transform<double, 3>> poses_from_edges(index_t,
                                                                  const std::vector<pose_edge<3>>&);

}  // namespace cilantro
