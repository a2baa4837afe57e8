// message: invalid operands to binary expression
#include <vector>

import cilantro;

auto sizes(std::vector<cilantro::point_cloud<float, 3>>& frames) {
  return frames | cilantro::each([](int number) { return number; });
}
