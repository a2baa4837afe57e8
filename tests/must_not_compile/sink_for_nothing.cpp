// message: invalid operands to binary expression
#include <vector>

import cilantro;

struct map {
  void insert(int);
};

void build(std::vector<cilantro::point_cloud<float, 3>>& frames, map& all) {
  frames | cilantro::accumulate_into(all);
}
