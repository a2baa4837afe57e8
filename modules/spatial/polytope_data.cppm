// SPDX-License-Identifier: MIT
//
// What a convex polytope consists of, whatever its dimension. Internal.
export module cilantro.spatial:polytope_data;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;

namespace cilantro {

/// Lists of indices one after the other: list i is `values` from begins[i] up to begins[i + 1].
struct lists_of_indices {
  std::vector<std::int32_t> begins{0};
  std::vector<std::int32_t> values;

  // What is defined in a module is inline only where it says so.
  [[nodiscard]] inline index_t size() const { return std::ssize(begins) - 1; }
  [[nodiscard]] inline std::span<const std::int32_t> operator[](index_t i) const {
    return std::span{values}.subspan(begins[i], begins[i + 1] - begins[i]);
  }
  [[nodiscard]] inline std::span<std::int32_t> operator[](index_t i) {
    return std::span{values}.subspan(begins[i], begins[i + 1] - begins[i]);
  }
  inline void close() { begins.push_back(static_cast<std::int32_t>(values.size())); }
};

struct polytope_data {
  index_t dimension = 0;
  index_t affine_dimension = -1;
  bool bounded = true;
  double tolerance = 0;
  index_t non_finite = 0;

  Eigen::MatrixXd vertices, rays;
  index_list indices;
  /// One per facet; then two for each direction in which the set does not extend.
  Eigen::MatrixXd normals;
  Eigen::VectorXd offsets;
  lists_of_indices facets, neighbors;
  /// The boundary as simplices, `affine_dimension` vertices each; empty if it is unbounded.
  index_list simplices;
  double measure = 0, area = 0;
  Eigen::VectorXd centroid;
};

/// How `convex_hull` works.
export struct hull_options {
  /// Points that lie this near to a line or plane through some of them count as lying in it, and
  /// the hull as flat. In the unit of the points; 0 stands for what their rounding asks for.
  double tolerance = 0;
  /// Whether facets of more vertices than needed are cut into simplices.
  bool simplicial = false;
  /// Whether points that are inside the hull of some extreme ones are put aside first, in two and
  /// three dimensions. The result is the same.
  bool cull = true;
  int threads = 0;
  task_monitor monitor = {};
};

/// The hull of points of any dimension, to which `origin` is added.
template <Scalar S>
std::shared_ptr<const polytope_data> make_hull(points_view<S, dynamic> points,
                                               const Eigen::VectorXd& origin,
                                               const hull_options& how);
/// The set of all x with normal · x <= offset for each column of normals.
std::shared_ptr<const polytope_data> make_intersection(const Eigen::MatrixXd& normals,
                                                       const Eigen::VectorXd& offsets,
                                                       double tolerance);
/// The set of no point.
std::shared_ptr<const polytope_data> make_empty(index_t dimension);

}  // namespace cilantro
