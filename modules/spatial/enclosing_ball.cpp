// SPDX-License-Identifier: MIT
module cilantro.spatial;

namespace cilantro {
namespace {

/// Balls by the points on their surface.
class ball_search {
 public:
  explicit ball_search(points_view<double, dynamic> points) : points_{points} {}

  enclosing_ball run() {
    // Each round the support gains the point that is farthest outside, and loses those that the
    // ball of the others contains; the radius grows, so that no support comes twice.
    enclosing_ball best = through({0});
    for (index_t round = 0;; ++round) {
      if (round == 1000)
        throw std::runtime_error{"minimum_enclosing_ball: no ball was found that holds"};
      index_t farthest = 0;
      double distance = -1;
      for (index_t i = 0; i < points_.size(); ++i)
        if (const double d = (points_[i] - best.center).squaredNorm(); d > distance) {
          distance = d;
          farthest = i;
        }
      if (std::sqrt(distance) <= best.radius * (1 + 1e-14)) break;
      std::vector<std::int32_t> some{static_cast<std::int32_t>(farthest)};
      some.insert(some.end(), best.support.begin(), best.support.end());
      enclosing_ball larger = ball_of(some, some.size(), {});
      if (!(larger.radius > best.radius)) break;
      best = std::move(larger);
    }
    std::ranges::sort(best.support);
    best.radius = 0;
    for (index_t i = 0; i < points_.size(); ++i)
      best.radius = std::max(best.radius, (points_[i] - best.center).norm());
    return best;
  }

 private:
  /// The smallest ball about the first `count` of `some` that has `on` on its surface (Welzl).
  enclosing_ball ball_of(const std::vector<std::int32_t>& some, std::size_t count,
                         const std::vector<std::int32_t>& on) {
    enclosing_ball found = through(on);
    if (std::ssize(on) == points_.dimension() + 1) return found;
    for (std::size_t i = 0; i < count; ++i) {
      if (found.radius >= 0 &&
          (points_[some[i]] - found.center).norm() <= found.radius * (1 + 1e-14))
        continue;
      std::vector<std::int32_t> more = on;
      more.push_back(some[i]);
      found = ball_of(some, i, more);
    }
    return found;
  }

  /// The smallest ball through a few points: its centre is in their affine hull. Without points, a
  /// ball that contains none.
  [[nodiscard]] enclosing_ball through(const std::vector<std::int32_t>& on) const {
    enclosing_ball ball{Eigen::VectorXd::Zero(points_.dimension()), -1, {on.begin(), on.end()}};
    if (on.empty()) return ball;
    const Eigen::VectorXd first = points_[on[0]];
    Eigen::MatrixXd arms(points_.dimension(), std::ssize(on) - 1);
    for (index_t k = 0; k < arms.cols(); ++k) arms.col(k) = points_[on[k + 1]] - first;
    ball.center = first;
    if (arms.cols() > 0) {
      const Eigen::MatrixXd gram = 2 * arms.transpose() * arms;
      ball.center += arms * solve_symmetric(gram, arms.colwise().squaredNorm().transpose());
    }
    ball.radius = (first - ball.center).norm();
    return ball;
  }

  points_view<double, dynamic> points_;
};

}  // namespace

std::optional<enclosing_ball> smallest_ball(points_view<double, dynamic> points) {
  if (points.empty()) return {};
  return ball_search{points}.run();
}

}  // namespace cilantro
