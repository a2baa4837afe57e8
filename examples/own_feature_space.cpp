// SPDX-License-Identifier: MIT
//
// A feature space of your own: points are partners if they are near each other and the surface is
// bent alike there. Any descriptor can take the place of the curvature.
#include <iostream>
#include <span>

import cilantro;
import simulated_room;
using namespace cilantro;

/// Vectors (x, y, z, weight · curvature).
class bent_places {
 public:
  bent_places(const point_cloud<double, 3>& source, const point_cloud<double, 3>& target,
              double weight)
      : source_{source.points},
        curvature_{source.attribute_as<double>("curvature")},
        weight_{weight},
        target_(4, target.size()) {
    const auto curvature = target.attribute_as<double>("curvature");
    for (index_t i = 0; i < target.size(); ++i)
      target_.col(i) << target.points.col(i), weight * curvature[std::size_t(i)];
  }

  [[nodiscard]] points_view<double, 4> target() const { return as_points(target_); }
  [[nodiscard]] index_t source_size() const { return source_.cols(); }
  [[nodiscard]] auto moved_by(const Eigen::Isometry3d& transform) const {
    return [this, &transform](index_t i, double* out) {
      Eigen::Map<Eigen::Vector4d>{out} << transform * source_.col(i),
          weight_ * curvature_[std::size_t(i)];
    };
  }

 private:
  const Eigen::Matrix3Xd& source_;
  std::span<const double> curvature_;
  double weight_;
  Eigen::Matrix4Xd target_;
};
static_assert(FeatureSpace<bent_places, Eigen::Isometry3d>);

int main() {
  const auto scan_of = [](int step) {
    const auto frame = simulate(step, {.width = 320, .height = 240});
    return point_cloud<double, 3>{.points = frame.points} |
           transform(frame.camera.to_world.inverse()) | voxel_downsample(0.05) |
           estimate_normals(knn{12});
  };
  const auto target = scan_of(0), source = scan_of(3);
  const bent_places space{source, target, 2};
  const auto violations = check_feature_space(space, Eigen::Isometry3d::Identity());
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto found =
      icp(feature_searcher{space, {.max_distance = 0.4}}, least_squares_estimator{source, target},
          Eigen::Isometry3d::Identity(), {.max_iterations = 60, .tolerance = 1e-4});
  const auto truth = simulated_camera(0, {}).to_world.inverse() * simulated_camera(3, {}).to_world;
  const double error = (found.transform.translation() - truth.translation()).norm();
  std::cout << found.status << " after " << found.iterations << " iterations, " << 1000 * error
            << " mm from the truth\n";
  return violations.empty() && found.converged() && error < 0.02 ? 0 : 1;
}
