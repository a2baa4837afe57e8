// message: MutablePoints
#include <vector>

import cilantro;

void turn(const std::vector<Eigen::Vector3f>& normals, const Eigen::Matrix3Xf& points) {
  cilantro::orient_to_viewpoint(normals, points, {0, 0, 1});
}
