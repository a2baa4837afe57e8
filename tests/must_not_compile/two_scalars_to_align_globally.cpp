// SPDX-License-Identifier: MIT
// message: source and target must have the same scalar and dimension; cast one of them
import cilantro;

int main() {
  const cilantro::point_cloud<float, 3> source;
  const cilantro::point_cloud<double, 3> target;
  (void)cilantro::align_globally(source, target, {.voxel = 0.05});
}
