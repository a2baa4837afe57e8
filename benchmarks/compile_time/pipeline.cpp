// SPDX-License-Identifier: MIT
import cilantro;
using namespace cilantro;

index_t unit() {
  const auto cloud = read_ply<float>("scan.ply") | remove_invalid() | voxel_downsample(0.005) |
                     estimate_normals(radius{0.02}) | write_ply("out.ply");
  return cloud.size();
}
