// SPDX-License-Identifier: MIT
// message: 'CorrespondenceSearcher<
import cilantro;

struct no_searcher {
  int find(const Eigen::Isometry3f&) const { return 0; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const cilantro::point_to_point_estimator estimator{points, points};
  return cilantro::icp(no_searcher{}, estimator, Eigen::Isometry3f::Identity(), {}).iterations;
}
