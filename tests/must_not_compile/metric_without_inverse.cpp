// SPDX-License-Identifier: MIT
// message: 'CoordinateMetric<my_metric, float>' evaluated to false
import cilantro;

struct my_metric {
  static float term(float difference, cilantro::index_t) { return difference; }
  static float distance(float sum) { return sum; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const cilantro::kd_tree<float, 3, my_metric> tree{points};
  return static_cast<int>(tree.size());
}
