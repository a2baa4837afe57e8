// SPDX-License-Identifier: MIT
module;
#include <zlib.h>
module cilantro.empty;

namespace cilantro {

index_t count_finite_points(points_view<float, 3> points) {
  index_t count = 0;
  for (const auto& p : points) count += is_finite(p);
  return count + index_t(crc32(0, nullptr, 0));
}

}  // namespace cilantro
