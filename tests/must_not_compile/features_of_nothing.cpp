// SPDX-License-Identifier: MIT
// message: 'FeatureSpace<
import cilantro;

struct no_features {
  Eigen::Matrix3Xf features;
  cilantro::points_view<float, 3> target() const { return cilantro::as_points(features); }
};

int main() {
  const cilantro::feature_searcher searcher{no_features{}};
  cilantro::correspondences<float> pairs;
  searcher.find(Eigen::Isometry3f::Identity(), pairs);
  return int(pairs.size());
}
