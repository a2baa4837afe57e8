// SPDX-License-Identifier: MIT
//
// A field of motions of your own: each node of a `deformation_graph` turns, shifts and grows, as
// a fruit does. With a `MotionModel`, a `warp_estimator` works for it with every metric and
// searcher.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <numbers>
#include <utility>

import cilantro;
using namespace cilantro;

/// The unknowns of `rigid_motion`, then the logarithm of the scale.
struct growing_motion {
  template <Scalar S, int D>
  using transform = affine_transform<S, D>;

  static constexpr index_t unknowns(index_t d) { return rigid_motion::unknowns(d) + 1; }
  template <class V>
  static void pull_back(const V& y, const V& g, double* row) {
    rigid_motion::pull_back(y, g, row);
    row[unknowns(y.size()) - 1] = y.dot(g);
  }
  static motion_step step(const Eigen::VectorXd& unknowns, index_t d) {
    auto rigid = rigid_motion::step(unknowns.head(unknowns.size() - 1), d);
    rigid.linear *= std::exp(unknowns[unknowns.size() - 1]);
    return rigid;
  }
};
static_assert(MotionModel<growing_motion>);

/// A fruit with bumps, of as many points as you like, evenly spread.
Eigen::Matrix3Xd fruit(index_t count) {
  Eigen::Matrix3Xd points(3, count);
  for (index_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * double(i) + 1) / double(count);
    const double angle = std::numbers::pi * (3 - std::sqrt(5.0)) * double(i);
    const double radius = 1 + 0.05 * std::sin(4 * angle) * (1 - z * z) + 0.05 * std::cos(6 * z);
    const double across = std::sqrt(1 - z * z);
    points.col(i) << radius * across * std::cos(angle), radius * across * std::sin(angle),
        radius * z;
  }
  return points;
}

/// Growth without shear, by a different factor everywhere: an inversion and a reflection.
constexpr double far = 20;
double growth_at(const Eigen::Vector3d& p) {
  return far * far / (p + far * Eigen::Vector3d::UnitX()).squaredNorm();
}
Eigen::Vector3d grown(const Eigen::Vector3d& p) {
  Eigen::Vector3d q = growth_at(p) * (p + far * Eigen::Vector3d::UnitX());
  q.x() = far - q.x();
  return q;
}

int main() {
  const auto violations = check_motion_model(growing_motion{}, 3);
  for (const auto& violation : violations) std::cout << violation << '\n';

  const Eigen::Matrix3Xd source = fruit(3000);
  Eigen::Matrix3Xd target = source;
  for (auto p : target.colwise()) p = grown(p);

  // Every fifth point is a mark that was found again.
  correspondences<double> marks;
  for (std::int32_t i = 0; i < source.cols(); i += 5) marks.push_back({i, i, 0});
  const known_pairs_searcher searcher{source, target, marks};
  const deformation_graph graph{source, {.spacing = 0.4}};
  const auto bend = [&](const char* name, auto motion) {
    const warp_estimator estimator{source, target, graph, point_to_point{}, {.stiffness = 0.01},
                                   motion};
    auto found = icp(searcher, estimator, {.max_iterations = 50, .tolerance = 1e-6});
    double sum = 0;
    for (index_t i = 0; i < source.cols(); ++i)
      sum += (found.transform(i, source.col(i)) - target.col(i)).squaredNorm();
    const double error = std::sqrt(sum / double(source.cols()));
    std::cout << name << ": " << found.status << " after " << found.iterations
              << " iterations, off by " << error << '\n';
    return std::pair{std::move(found), error};
  };
  const auto [rigid, rigid_error] = bend("rigid nodes", rigid_motion{});
  const auto [found, error] = bend("nodes that grow", growing_motion{});

  double worst = 0;
  for (index_t k = 0; k < graph.nodes().size(); ++k) {
    const double scale = std::cbrt(found.transform.at_node(k).linear().determinant());
    worst = std::max(worst, std::abs(scale - growth_at(graph.nodes()[k])));
  }
  std::cout << graph.nodes().size()
            << " nodes grow by factors from 0.9 to 1.1; the worst is off by " << worst << '\n';
  return violations.empty() && found.converged() && error < rigid_error / 3 && worst < 0.02 ? 0 : 1;
}
