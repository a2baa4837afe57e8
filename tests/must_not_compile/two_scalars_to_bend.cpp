// SPDX-License-Identifier: MIT
// message: align_non_rigid: source and target must have the same scalar and dimension
import cilantro;

int main() {
  const cilantro::point_cloud<float, 3> source;
  const cilantro::point_cloud<double, 3> target;
  cilantro::align_non_rigid(source, target, cilantro::non_rigid_options{.spacing = 1});
}
