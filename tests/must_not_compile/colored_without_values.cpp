// SPDX-License-Identifier: MIT
// message: align: colored is chosen in the options, as in align(source, target, {.metric =
import cilantro;

int main() {
  const cilantro::point_cloud<float, 3> cloud;
  cilantro::align(cloud, cloud, cilantro::colored{}, {.max_distance = 1});
}
