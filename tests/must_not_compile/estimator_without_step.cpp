// SPDX-License-Identifier: MIT
// message: 'TransformEstimator<
import cilantro;

struct no_estimator {
  using transform_type = Eigen::Isometry3f;
  bool estimate(const Eigen::Isometry3f&, const cilantro::correspondences<float>&) const {
    return true;
  }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const cilantro::nearest_neighbor_searcher searcher{points, points};
  return cilantro::icp(searcher, no_estimator{}, Eigen::Isometry3f::Identity(), {}).iterations;
}
