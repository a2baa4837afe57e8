// SPDX-License-Identifier: MIT
export module cilantro.empty;

import cilantro.core;

namespace cilantro {

/// How many of the points are finite, and that zlib is there: its checksum of nothing is 0.
export [[nodiscard]] index_t count_finite_points(points_view<float, 3> points);

}  // namespace cilantro
