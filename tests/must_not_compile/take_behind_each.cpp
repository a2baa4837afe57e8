// message: invalid operands to binary expression
#include <vector>

import cilantro;
using namespace cilantro;

void build(std::vector<point_cloud<float, 3>>& frames, point_cloud<float, 3>& map) {
  frames | each(remove_invalid()) | take(2) | accumulate_into(map);
}
