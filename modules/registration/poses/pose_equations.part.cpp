// SPDX-License-Identifier: MIT
//
// The equations of a pose graph, and their solution.
module cilantro.registration:pose_equations;

import cilantro.standard;
import cilantro.core;
import cilantro.numeric;
import :pose_edge;
import :twists;

namespace cilantro {

template <int D>
using pose = rigid_transform<double, D>;

/// How far an iteration moves the poses, at most.
struct pose_change {
  double rotation = 0, translation = 0;
};

/// What an edge measures less what the poses say: a twist of the target's coordinates.
template <int D>
[[nodiscard]] twist<D> residual_of(const pose_edge<D>& edge, const std::vector<pose<D>>& poses) {
  return logarithm<D>(poses[edge.target].inverse() * poses[edge.source] * edge.transform.inverse());
}

template <int D>
[[nodiscard]] double chi_square_of(const pose_edge<D>& edge, const std::vector<pose<D>>& poses) {
  const twist<D> r = residual_of<D>(edge, poses);
  return std::max(0.0, r.dot(edge.information * r));
}

/// Moves poses to where a weighted sum of chi-squares is smaller, by the method of Levenberg and
/// Marquardt. Steps are twists of each node's own coordinates, so that it does not matter how far
/// away the world's origin is.
template <int D>
class pose_equations {
 public:
  static constexpr int unknowns = pose_unknowns<D>;

  /// `is_fixed` says which nodes do not move.
  pose_equations(std::span<const pose_edge<D>> edges, const std::vector<bool>& is_fixed,
                 const execution& how)
      : edges_{edges}, how_{how}, linear_(edges.size()) {
    for (const bool fixed : is_fixed) {
      number_.push_back(fixed ? -1 : free_);
      free_ += !fixed;
    }
    std::vector<std::pair<std::int32_t, std::int32_t>> links;
    for (const auto& edge : edges)
      if (number_[edge.source] >= 0 && number_[edge.target] >= 0)
        links.emplace_back(number_[edge.source], number_[edge.target]);
    solver_ = block_cholesky{block_pattern{free_, links}, unknowns};
    for (const auto& edge : edges) {
      const auto [low, high] = std::minmax(number_[edge.source], number_[edge.target]);
      slots_.push_back(low >= 0 ? solver_.pattern().slot(high, low) : -1);
    }
  }

  /// Around these poses, with these weights of the edges.
  void linearize(const std::vector<pose<D>>& poses, std::span<const double> weights) {
    parallel_for(std::ssize(edges_), how_, [&](index_t e) {
      const auto& edge = edges_[e];
      auto& l = linear_[e];
      const pose<D> between = poses[edge.target].inverse() * poses[edge.source];
      const twist<D> r = logarithm<D>(between * edge.transform.inverse());
      const block by_target = left_jacobian_inverse<D>(r);
      const block by_source = by_target * adjoint<D>(between);
      const block weighted = weights[e] * edge.information;
      l.target = by_target.transpose() * weighted * by_target;
      l.both = -by_source.transpose() * weighted * by_target;
      l.source = by_source.transpose() * weighted * by_source;
      l.source_gradient = by_source.transpose() * (weighted * r);
      l.target_gradient = -by_target.transpose() * (weighted * r);
    });
    values_.assign(static_cast<std::size_t>(solver_.pattern().blocks() * block_size), 0.0);
    gradient_ = Eigen::VectorXd::Zero(free_ * unknowns);
    for (index_t e = 0; e < std::ssize(edges_); ++e) {
      const auto& l = linear_[e];
      const auto source = number_[edges_[e].source], target = number_[edges_[e].target];
      if (source >= 0) {
        at(solver_.pattern().offsets()[source]) += l.source;
        gradient_.segment<unknowns>(source * unknowns) += l.source_gradient;
      }
      if (target >= 0) {
        at(solver_.pattern().offsets()[target]) += l.target;
        gradient_.segment<unknowns>(target * unknowns) += l.target_gradient;
      }
      if (slots_[e] < 0) continue;
      // The row is that of the larger number.
      if (source > target)
        at(slots_[e]) += l.both;
      else
        at(slots_[e]) += l.both.transpose();
    }
  }

  /// The poses after a step. The damping is relative to what a node's own edges say, and the same
  /// for all rotations and for all translations of a node: it keeps a step at right angles to what
  /// is not determined.
  [[nodiscard]] std::pair<std::vector<pose<D>>, pose_change> step(const std::vector<pose<D>>& poses,
                                                                  double damping) {
    damped_ = values_;
    for (std::int32_t i = 0; i < free_; ++i) {
      Eigen::Map<block> own{damped_.data() + solver_.pattern().offsets()[i] * block_size};
      const double rotation = own.diagonal().template head<turns<D>>().sum() / turns<D>;
      const double translation = own.diagonal().template tail<D>().sum() / D;
      own.diagonal().template head<turns<D>>().array() += damping * rotation;
      own.diagonal().template tail<D>().array() += damping * translation;
    }
    solver_.factorize(damped_, factor_);
    Eigen::VectorXd steps = -gradient_;
    factor_.solve(steps);
    auto moved = poses;
    pose_change change;
    for (std::size_t node = 0; node < poses.size(); ++node) {
      if (number_[node] < 0) continue;
      const twist<D> x = steps.segment<unknowns>(number_[node] * unknowns);
      change.rotation = std::max(change.rotation, x.template head<turns<D>>().norm());
      change.translation = std::max(change.translation, x.template tail<D>().norm());
      moved[node] = normalized<D>(poses[node] * exponential<D>(x));
    }
    return {std::move(moved), change};
  }

  /// How many directions the edges do not determine.
  [[nodiscard]] index_t undetermined() {
    solver_.factorize(values_, factor_);
    return factor_.undetermined();
  }

 private:
  using block = pose_information<D>;
  static constexpr index_t block_size = unknowns * unknowns;

  /// An edge's part of the equations.
  struct linear_edge {
    block source, both, target;
    twist<D> source_gradient, target_gradient;
  };

  Eigen::Map<block> at(index_t slot) {
    return Eigen::Map<block>{values_.data() + slot * block_size};
  }

  std::span<const pose_edge<D>> edges_;
  execution how_;
  std::vector<linear_edge> linear_;
  std::vector<std::int32_t> number_;  // Of each node among those that are free; −1 if it is not.
  std::int32_t free_ = 0;
  block_cholesky solver_{block_pattern{0, {}}, unknowns};
  std::vector<index_t> slots_;
  std::vector<double> values_, damped_;
  Eigen::VectorXd gradient_;
  block_factor factor_;
};

}  // namespace cilantro
