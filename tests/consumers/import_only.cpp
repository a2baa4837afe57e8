// SPDX-License-Identifier: MIT
//
// Includes nothing: Eigen and the pipeline come from the modules alone.
import cilantro;

using namespace cilantro;

int main(int, char** argv) {
  Eigen::Matrix3Xf points(3, 1600);
  for (index_t i = 0; i < points.cols(); ++i) points.col(i) << float(i % 40), float(i / 40), 0.0f;
  const Eigen::Isometry3f turn{Eigen::AngleAxisf{1.0f, Eigen::Vector3f::UnitX()}};

  const auto cloud = point_cloud<float, 3>{points} | voxel_downsample(2) | transform(turn) |
                     estimate_normals(knn{8}, {.viewpoint = {{0, -9, 9}}}) | write_ply(argv[1]);
  const Eigen::Vector3f normal = turn * Eigen::Vector3f::UnitZ();
  for (index_t i = 0; i < cloud.size(); ++i)
    if ((cloud.normals.col(i) - normal).norm() > 1e-3f) return 1;
  return cloud.size() == 400 && read_ply<float>(argv[1]) == cloud ? 0 : 2;
}
