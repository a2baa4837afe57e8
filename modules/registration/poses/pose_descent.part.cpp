// SPDX-License-Identifier: MIT
//
// The way from the start of a pose graph to its minimum, with or without a robust kernel.
module cilantro.registration:pose_descent;

import cilantro.standard;
import cilantro.core;
import :edge_kernel;
import :optimize_poses;
import :pose_edge;
import :pose_equations;

namespace cilantro {

template <int D>
class pose_descent {
 public:
  pose_descent(std::span<const pose_edge<D>> edges, const edge_kernel& kernel,
               const pose_graph_options& options, const std::vector<bool>& is_fixed)
      : edges_{edges},
        kernel_{kernel},
        options_{options},
        how_{.threads = options.threads},
        equations_{edges, is_fixed, how_} {}

  /// The number of iterations so far.
  [[nodiscard]] int iterations() const { return iterations_; }

  [[nodiscard]] std::vector<double> chi_squares(const std::vector<pose<D>>& poses) const {
    std::vector<double> all(edges_.size());
    parallel_for(std::ssize(edges_), how_,
                 [&](index_t e) { all[e] = chi_square_of<D>(edges_[e], poses); });
    return all;
  }

  /// The weights of edges with these chi-squares, with the kernel made wider by a factor.
  [[nodiscard]] std::vector<double> weights(const std::vector<double>& chi_squares,
                                            double wider) const {
    std::vector<double> all(edges_.size(), 1.0);
    for (std::size_t e = 0; e < edges_.size(); ++e)
      if (!edges_[e].trusted) all[e] = kernel_.weight(std::sqrt(chi_squares[e]) / wider);
    return all;
  }

  [[nodiscard]] double cost(const std::vector<double>& chi_squares) const {
    double sum = 0;
    for (std::size_t e = 0; e < edges_.size(); ++e)
      sum += edges_[e].trusted ? chi_squares[e] : kernel_.cost(chi_squares[e]);
    return sum;
  }

  /// First with a kernel so wide that every edge has half of its weight or more, then with ever
  /// narrower ones. The cost may end above that of the start.
  void graduate(std::vector<pose<D>>& poses) {
    constexpr double narrower = 1.5;
    constexpr int iterations_each = 3;
    const double half = kernel_.reach(0.5);
    double worst = 0;
    const auto at_start = chi_squares(poses);
    for (std::size_t e = 0; e < edges_.size(); ++e)
      if (!edges_[e].trusted) worst = std::max(worst, at_start[e]);
    double wider = std::sqrt(worst) / half;
    while (wider > 1) {
      const auto w = weights(chi_squares(poses), wider);
      for (int i = 0; i < iterations_each && iterations_ < options_.max_iterations; ++i)
        if (improve(poses, w)) break;
      wider /= narrower;
    }
  }

  /// With the kernel itself, which never raises the cost. Returns whether the poses have converged.
  bool settle(std::vector<pose<D>>& poses) {
    auto w = weights(chi_squares(poses), 1);
    while (iterations_ < options_.max_iterations) {
      bool settled = improve(poses, w);
      auto next = weights(chi_squares(poses), 1);
      for (std::size_t e = 0; e < w.size(); ++e) settled &= (w[e] > 0) == (next[e] > 0);
      if (settled) return true;
      w = std::move(next);
    }
    return false;
  }

  /// How many directions are not determined at these poses, with these weights.
  [[nodiscard]] index_t undetermined(const std::vector<pose<D>>& poses,
                                     const std::vector<double>& weights) {
    equations_.linearize(poses, weights);
    return equations_.undetermined();
  }

 private:
  /// One iteration with these weights. Returns whether the poses have converged: they have hardly
  /// moved, or could not be seen to become better.
  bool improve(std::vector<pose<D>>& poses, const std::vector<double>& weights) {
    constexpr double least_damping = 1e-10, most_damping = 1e10, visible = 1e-13;
    const auto sum = [&](const std::vector<pose<D>>& at) {
      const auto all = chi_squares(at);
      double total = 0;
      for (std::size_t e = 0; e < all.size(); ++e) total += weights[e] * all[e];
      return total;
    };
    ++iterations_;
    if (options_.monitor.progress)
      options_.monitor.progress(std::min(1.0, iterations_ / (options_.max_iterations + 1.0)));
    const double before = sum(poses);
    equations_.linearize(poses, weights);
    while (true) {
      if (options_.monitor.stop.stop_requested()) throw cancelled{};
      auto [moved, change] = equations_.step(poses, damping_);
      const double after = sum(moved);
      const bool is_small =
          change.rotation <= options_.tolerance && change.translation <= options_.tolerance;
      if (after <= before) {
        poses = std::move(moved);
        damping_ = std::max(least_damping, damping_ / 10);
        return is_small || before - after <= visible * before;
      }
      if (is_small || damping_ > most_damping) return true;
      damping_ *= 10;
    }
  }

  std::span<const pose_edge<D>> edges_;
  const edge_kernel& kernel_;
  const pose_graph_options& options_;
  execution how_;
  pose_equations<D> equations_;
  double damping_ = 1e-6;
  int iterations_ = 0;
};

}  // namespace cilantro
