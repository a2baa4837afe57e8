// SPDX-License-Identifier: MIT
// message: does not satisfy 'Metric'
import cilantro;

struct my_metric {
  static float term(float difference) { return difference; }
  static double term(double difference) { return difference; }
  static float distance(float sum) { return sum; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const cilantro::brute_force_searcher<float, 3, my_metric> searcher{points};
  return static_cast<int>(searcher.size());
}
