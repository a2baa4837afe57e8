// SPDX-License-Identifier: MIT
export module cilantro.registration:unit_normals;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

namespace detail {
/// Throws `invalid_input`, naming the set, if a normal does not have unit length, to one part in a
/// hundred: residuals along it would be in another unit. Normals that are zero or not finite are
/// unknown, and allowed.
export template <Scalar S, int D>
void expect_unit_normals(points_view<S, D> normals, const char* whose) {
  for (index_t i = 0; i < normals.size(); ++i) {
    const double square = normals[i].template cast<double>().squaredNorm();
    if (square != 0 && std::isfinite(square) && !(square > 0.98 && square < 1.02))
      throw invalid_input{"registration: normals must have unit length, and normal " +
                          std::to_string(i) + " of the " + whose + " has a length of " +
                          in_digits(std::sqrt(square))};
  }
}
}  // namespace detail
using detail::expect_unit_normals;

}  // namespace cilantro
