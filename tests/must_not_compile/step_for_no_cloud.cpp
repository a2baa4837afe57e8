// SPDX-License-Identifier: MIT
// message: 'StepFor<
import cilantro;

int main() {
  const cilantro::point_cloud<float, 3> cloud;
  return cloud | cilantro::step{[](int i) { return i; }};
}
