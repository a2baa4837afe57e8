// SPDX-License-Identifier: MIT
export module cilantro.geometry:normals;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :covariance;
import :moments;

namespace cilantro {

/// Options of `estimate_normals` and `write_normals`.
export struct normals_options {
  /// Normals are flipped towards this point. Without one, the largest component of each is
  /// positive.
  std::optional<coordinates> viewpoint = {};
  /// Whether neighbours are summed up in the order of their distance also where all within a
  /// radius, or more than 64, are taken. That takes about a third longer. Without it, the last bit
  /// of a result may depend on which other points there are; that is how parts of a cloud are
  /// processed.
  bool ascending = false;
  int threads = 0;
  task_monitor monitor = {};
};

/// Surface normals and curvatures, one per point.
export template <Scalar S, int D>
struct normals_result {
  point_matrix<S, D> normals;              ///< `Dim × N` unit vectors; zero where undetermined.
  Eigen::Matrix<S, dynamic, 1> curvature;  ///< λ₀ / Σλ in [0, 1/Dim]; zero where undetermined.

  /// The number of normals that the neighbours do not determine.
  [[nodiscard]] index_t undetermined() const {
    index_t count = 0;
    for (index_t i = 0; i < normals.cols(); ++i) count += normals.col(i).isZero(0);
    return count;
  }
};

/// Where normals are written to, and curvatures unless `curvature` is null.
template <Scalar S, int D>
struct normals_target {
  mutable_points_view<S, D> normals;
  S* curvature = nullptr;
};

/// `Near` is a specification of neighbourhoods, or neighbourhoods. `estimate` is for the closed
/// dimension of the points.
template <Scalar S, int D, class Near>
void closed_normals(points_view<S, D> points, const Near& near, const normals_options& options,
                    const normals_target<S, D>& out);
template <Scalar S, int D>
using covariance_function =
    std::function<std::optional<moments<S, D>>(points_view<S, D>, std::span<const std::int32_t>)>;
template <Scalar S, int D, class Near>
void closed_normals_by(points_view<S, D> points, const Near& near, const normals_options& options,
                       const covariance_function<S, D>& estimate, const normals_target<S, D>& out);

/// The normals of `points` that `fill(closed points, target)` writes.
template <PointsSource P, class F>
[[nodiscard]] auto normals_filled_by(const P& points, const normals_options& options, F&& fill)
    -> normals_result<scalar_of<P>, dimension_of<P>> {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  if (options.viewpoint) expect_local(points, "estimate_normals");
  const points_view<S, C> view = points_in(points);
  normals_result<S, dimension_of<P>> found;
  found.normals.resize(view.dimension(), view.size());
  found.curvature.resize(view.size());
  fill(view, normals_target<S, C>{mutable_points_in(found.normals), found.curvature.data()});
  return found;
}

/// Throws `invalid_input`, naming the function `who`, unless each normal has unit length, is zero
/// or not finite: what points, given in place of normals, do not have.
template <Scalar S, int D>
void expect_unit_length(points_view<S, D> normals, const char* who);

/// Turns normal i along viewpoint − guides[i], or along guides[i] if there is no viewpoint.
template <Scalar S, int D>
void closed_orient(points_view<S, D> guides, const point_vector<S, D>* viewpoint,
                   mutable_points_view<S, D> normals);

/// The normal of the surface at every point: the direction in which its neighbours, the point
/// itself among them, vary least; and the curvature, the share of the variance in that direction.
///
/// The result is undetermined, with a zero normal and zero curvature, for points that are not
/// finite, that have fewer than Dim neighbours, or whose neighbours lie on a line (in general: vary
/// in fewer than Dim − 1 directions by more than the rounding of their coordinates). Throws
/// `invalid_input` for a viewpoint of another dimension, or one that is not finite, and for a
/// specification of fewer than Dim neighbours, which would never be enough. Builds a kd-tree; O(N
/// (log N + k D²)). The same bits for any number of threads; neighbours within a radius are summed
/// in the order in which they are found. Memory beside the result: the tree, and the neighbourhoods
/// of 256 points per thread. Source: Hoppe et al. 1992, section 3.2; the curvature is the surface
/// variation of Pauly, Gross & Kobbelt 2002, equation 5.
export template <PointsSource P>
[[nodiscard]] auto estimate_normals(const P& points, neighborhood_spec spec,
                                    const normals_options& options = {})
    -> normals_result<scalar_of<P>, dimension_of<P>> {
  return normals_filled_by(points, options, [&](auto view, const auto& out) {
    closed_normals(view, spec, options, out);
  });
}

/// As above, from neighbourhoods that any searcher has found. Throws `invalid_input` unless there
/// is one per point and their indices are within `points`.
export template <PointsSource P>
[[nodiscard]] auto estimate_normals(const P& points, const neighborhoods<scalar_of<P>>& near,
                                    const normals_options& options = {})
    -> normals_result<scalar_of<P>, dimension_of<P>> {
  return normals_filled_by(points, options, [&](auto view, const auto& out) {
    closed_normals(view, near, options, out);
  });
}

/// Whether two sets have memory in common, so that writing to one may change the other. Records
/// that hold a member of each side by side have none.
template <Scalar S, int D>
[[nodiscard]] bool overlap(points_view<S, D> a, points_view<S, D> b) {
  if (a.empty() || b.empty()) return false;
  const auto address = [](const S* p) { return std::bit_cast<std::uintptr_t>(p) / sizeof(S); };
  const auto begin_a = address(a.data()), begin_b = address(b.data());
  const auto length = [](const points_view<S, D>& all) {
    return static_cast<std::uintptr_t>((all.size() - 1) * all.stride() + all.dimension());
  };
  if (begin_a + length(a) <= begin_b || begin_b + length(b) <= begin_a) return false;
  if (a.stride() != b.stride()) return true;
  const auto stride = static_cast<std::uintptr_t>(a.stride());
  const auto shift = (begin_a > begin_b ? begin_a - begin_b : begin_b - begin_a) % stride;
  const auto size = static_cast<std::uintptr_t>(a.dimension());
  return shift < size || stride - shift < size;
}

/// As `estimate_normals`, into memory of yours, without the curvatures: `normals` has one column
/// per point, and must not overlap the points. `near` is a specification, or neighbourhoods. If an
/// exception is thrown after the sizes have been checked, the contents of `normals` are
/// unspecified.
export template <PointsSource P, class Near, MutablePoints N>
  requires std::same_as<points_view_of<N>, points_view_of<P>> &&
           (std::convertible_to<const Near&, neighborhood_spec> ||
            std::same_as<Near, neighborhoods<scalar_of<P>>>)
void write_normals(const P& points, const Near& near, N&& normals,
                   const normals_options& options = {}) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  if (options.viewpoint) expect_local(points, "write_normals");
  const points_view<S, C> view = points_in(points);
  const mutable_points_view<S, C> out = mutable_points_in(normals);
  expects(out.dimension() == view.dimension() && out.size() == view.size(),
          "write_normals: there must be one normal per point");
  expects(!overlap<S, C>(view, out), "write_normals: the normals would overwrite the points");
  if constexpr (std::same_as<Near, neighborhoods<S>>)
    closed_normals(view, near, options, normals_target<S, C>{out});
  else
    closed_normals(view, neighborhood_spec{near}, options, normals_target<S, C>{out});
}

/// The normals from covariances that `estimate` finds.
template <PointsSource P, class Near, class E>
[[nodiscard]] auto normals_by(const P& points, const Near& near, const E& estimate,
                              const normals_options& options)
    -> normals_result<scalar_of<P>, dimension_of<P>> {
  using S = scalar_of<P>;
  constexpr int D = dimension_of<P>, C = closed_dimension<D>;
  const auto given = points_in(points);
  const covariance_function<S, C> by = [&](points_view<S, C>, std::span<const std::int32_t> some) {
    return with_dimension<S, C>(std::optional<moments<S, D>>{estimate(given, some)});
  };
  return normals_filled_by(points, options, [&](auto view, const auto& out) {
    closed_normals_by(view, near, options, by, out);
  });
}

/// As above, from the covariance that an estimator of yours finds for each neighbourhood: robust
/// normals are `estimate_normals(points, knn{30}, minimum_covariance_determinant{})`. Points for
/// which the estimator has no result are undetermined, too.
export template <PointsSource P, CovarianceEstimator<scalar_of<P>, dimension_of<P>> E>
[[nodiscard]] auto estimate_normals(const P& points, neighborhood_spec spec, const E& estimate,
                                    const normals_options& options = {})
    -> normals_result<scalar_of<P>, dimension_of<P>> {
  return normals_by(points, spec, estimate, options);
}

/// As above, from neighbourhoods that any searcher has found.
export template <PointsSource P, CovarianceEstimator<scalar_of<P>, dimension_of<P>> E>
[[nodiscard]] auto estimate_normals(const P& points, const neighborhoods<scalar_of<P>>& near,
                                    const E& estimate, const normals_options& options = {})
    -> normals_result<scalar_of<P>, dimension_of<P>> {
  return normals_by(points, near, estimate, options);
}

/// Flips each normal, in place, where needed, so that it points from its point towards `viewpoint`.
/// Throws `invalid_input` for mismatched sizes or dimensions, for points with an origin, for
/// normals that are neither of unit length nor zero, and for a viewpoint that is not finite.
export template <MutablePoints N, PointsSource P>
  requires std::same_as<points_view_of<N>, points_view_of<P>>
void orient_to_viewpoint(N&& normals, const P& points, const coordinates& viewpoint) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  const points_view<S, C> view = points_in(points);
  const mutable_points_view<S, C> out = mutable_points_in(normals);
  expect_local(points, "orient_to_viewpoint");
  expects(out.dimension() == view.dimension() && out.size() == view.size(),
          "orient_to_viewpoint: there must be one normal per point");
  const auto eye = viewpoint.as<S, C>(
      view.dimension(), "orient_to_viewpoint: the viewpoint must have the dimension of the points");
  expects(is_finite(eye), "orient_to_viewpoint: the viewpoint must be finite");
  expect_unit_length<S, C>(out, "orient_to_viewpoint");
  closed_orient(view, &eye, out);
}

/// Flips each normal, in place, where needed, to the side to which the reference normal of its
/// point points. Throws `invalid_input` for mismatched sizes.
export template <MutablePoints N, PointwiseVectors R>
  requires std::same_as<points_view_of<N>, points_view_of<R>>
void orient_to_reference(N&& normals, const R& reference) {
  using S = scalar_of<R>;
  constexpr int C = closed_dimension<dimension_of<R>>;
  const points_view<S, C> view = points_in(reference);
  const mutable_points_view<S, C> out = mutable_points_in(normals);
  expects(out.dimension() == view.dimension() && out.size() == view.size(),
          "orient_to_reference: there must be one normal per reference normal");
  closed_orient<S, C>(view, nullptr, out);
}

}  // namespace cilantro
