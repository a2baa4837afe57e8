// SPDX-License-Identifier: MIT
module;
#include <vector>
module ground;

cilantro::point_cloud<float, 3> without_ground(const cilantro::point_cloud<float, 3>& scan) {
  std::vector<cilantro::index_t> above;
  for (cilantro::index_t i = 0; i < scan.size(); ++i)
    if (scan.points(2, i) > 0.1f) above.push_back(i);
  return cilantro::select(scan, above);
}
