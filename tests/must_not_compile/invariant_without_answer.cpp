// SPDX-License-Identifier: MIT
// message: an invariant is called as invariant(a, b, all), with two putative_pair
import cilantro;

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const cilantro::correspondences<float> pairs;
  (void)cilantro::align_globally(
      points, points, pairs,
      {.max_distance = 0.05, .solver = cilantro::pair_graph{[](int a, int b) { return a == b; }}});
}
