// SPDX-License-Identifier: MIT
// message: 'Metric<
import cilantro;

struct by_name {
  float operator()(const char*, const char*) const { return 0; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const cilantro::brute_force_searcher<float, 3, by_name> searcher{points, by_name{}};
  return static_cast<int>(searcher.size());
}
