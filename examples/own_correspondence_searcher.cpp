// SPDX-License-Identifier: MIT
//
// A correspondence searcher of your own: nearest neighbours, but only among points with the same
// label, such as floor to floor and wall to wall. One function makes it fit for `icp`.
#include <cstdint>
#include <iostream>
#include <map>
#include <span>
#include <vector>

import cilantro;
import simulated_room;
using namespace cilantro;

class label_searcher {
 public:
  label_searcher(const point_cloud<double, 3>& source, const point_cloud<double, 3>& target,
                 double max_distance)
      : source_{source.points},
        source_labels_{source.attribute_as<std::int32_t>("label")},
        max_distance_{max_distance} {
    const auto labels = target.attribute_as<std::int32_t>("label");
    for (index_t i = 0; i < target.size(); ++i)
      members_[labels[std::size_t(i)]].push_back(std::int32_t(i));
    for (const auto& [label, members] : members_)
      trees_.emplace(label, kd_tree{select(target, members).points});
  }

  void find(const Eigen::Isometry3d& transform, correspondences<double>& out) const {
    out.clear();
    for (std::int32_t s = 0; s < source_.cols(); ++s) {
      const auto tree = trees_.find(source_labels_[std::size_t(s)]);
      if (tree == trees_.end()) continue;
      const auto near = tree->second.nearest_two(transform * source_.col(s), max_distance_)[0];
      if (near.index < 0) continue;
      const auto& members = members_.at(tree->first);
      out.push_back({s, members[std::size_t(near.index)], near.distance});
    }
  }

 private:
  const Eigen::Matrix3Xd& source_;
  std::span<const std::int32_t> source_labels_;
  double max_distance_;
  std::map<std::int32_t, std::vector<std::int32_t>> members_;
  std::map<std::int32_t, kd_tree<double, 3>> trees_;
};
static_assert(CorrespondenceSearcher<label_searcher, Eigen::Isometry3d>);

int main() {
  const auto scan_of = [](int step) {
    const auto frame = simulate(step, {.width = 160, .height = 120});
    point_cloud<double, 3> cloud{.points = frame.points, .normals = frame.normals};
    cloud.set_attribute("label", frame.objects);
    return transform(cloud, frame.camera.to_world.inverse());
  };
  const auto target = scan_of(0), source = scan_of(2);
  const label_searcher searcher{source, target, 0.3};
  const auto violations = check_correspondence_searcher(searcher, source, target,
                                                        std::vector{Eigen::Isometry3d::Identity()});
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto found = icp(searcher, least_squares_estimator{source, target},
                         Eigen::Isometry3d::Identity(), {.max_iterations = 50});
  const auto truth = simulated_camera(0, {}).to_world.inverse() * simulated_camera(2, {}).to_world;
  const double error = (found.transform.translation() - truth.translation()).norm();
  std::cout << found.status << " after " << found.iterations << " iterations, " << 1000 * error
            << " mm from the truth\n";
  return violations.empty() && found.converged() && error < 0.003 ? 0 : 1;
}
