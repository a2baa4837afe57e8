// message: invalid operands to binary expression
#include <vector>

import cilantro;

auto prepare(std::vector<cilantro::point_cloud<float, 3>>& frames) {
  return frames | (cilantro::remove_invalid() | cilantro::take(2));
}
