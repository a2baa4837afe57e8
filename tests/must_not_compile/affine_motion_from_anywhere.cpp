// SPDX-License-Identifier: MIT
// message: finds rigid transforms, or similarities from pairs; for any other motion, start
import cilantro;

int main() {
  const cilantro::point_cloud<float, 3> source, target;
  const cilantro::correspondences<float> pairs;
  (void)cilantro::align_globally<cilantro::affine_motion>(source, target, pairs,
                                                          {.max_distance = 0.05});
}
