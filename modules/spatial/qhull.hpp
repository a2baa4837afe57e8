// SPDX-License-Identifier: MIT
//
// The seam between the library and the one unit that knows Qhull. Internal.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cilantro::detail {

/// Lists of numbers one after the other: list i is `values` from begins[i] up to begins[i + 1].
struct index_lists {
  std::vector<std::int32_t> begins{0};
  std::vector<std::int32_t> values;

  void close() { begins.push_back(static_cast<std::int32_t>(values.size())); }
};

/// The facets of a convex hull, in Qhull's order.
struct qhull_facets {
  index_lists vertices;   ///< Indices of points, in no order.
  index_lists neighbors;  ///< Facets that share a ridge, in no order; none in up to 3 dimensions.
  /// `dimension` numbers per facet: its outward normal, of unit length.
  std::vector<double> normals;
  std::string error;  ///< Empty if all went well; otherwise what Qhull says.
};

/// The convex hull of `count` finite points of `dimension` coordinates, packed, at least 2, which
/// must not lie in a hyperplane. Facets that are within `merged` of one plane become one; 0 stands
/// for what Qhull's own rounding asks for. Writes nothing anywhere and never ends the process.
/// Throws `std::bad_alloc` alone.
qhull_facets run_qhull(const double* points, int count, int dimension, double merged = 0);

}  // namespace cilantro::detail
