// SPDX-License-Identifier: MIT
export module cilantro.consensus:cylinder_family;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import :sample;
import :constraints;

namespace cilantro {

/// Which cylinders are allowed: the direction of their `axis`, and their `radius`.
export struct cylinder_limits {
  std::optional<direction_limit> axis = {};
  radius_limit radius = {};
};

/// The cylinder through two points with normals.
[[nodiscard]] std::optional<cylinder_model> cylinder_of(const Eigen::Vector3d& p,
                                                        const Eigen::Vector3d& p_normal,
                                                        const Eigen::Vector3d& q,
                                                        const Eigen::Vector3d& q_normal,
                                                        const cylinder_limits& limits);
/// The least-squares cylinder, starting from one near it, or from one that the normals suggest.
[[nodiscard]] std::optional<cylinder_model> refine_cylinder(const gathered_points& data,
                                                            const Eigen::MatrixXd& normals,
                                                            const cylinder_model& start,
                                                            const cylinder_limits& limits);

/// Cylinders through points with normals. A sample is two points, degenerate if their normals are
/// parallel. More points are fitted by least squares of the distances to the cylinder, starting
/// from the cylinder of the two, among a few, whose normals differ most. Views points and normals,
/// which must outlive it.
/// Source: Schnabel, Wahl & Klein 2007, "Efficient RANSAC for point-cloud shape detection", section
/// 4.1; the iteration is that of Marquardt 1963.
export template <Scalar S>
class cylinder_family {
 public:
  using model_type = cylinder_model;

  /// Throws `invalid_input` unless there is one normal per point, and for limits that make no
  /// sense.
  template <BorrowedPoints P, BorrowedPoints N>
    requires(dimension_of<P> == 3 && dimension_of<N> == 3 && PointwiseVectors<N>)
  cylinder_family(P&& points, N&& normals, cylinder_limits limits = {})
      : points_{as_points(std::forward<P>(points))},
        normals_{as_points(std::forward<N>(normals))},
        limits_{std::move(limits)} {
    expects(points_.size() == normals_.size(),
            "cylinder_family: there must be one normal per point");
    expect_sensible(limits_.axis, 3);
    expect_sensible(limits_.radius);
  }
  /// From points that have normals, such as a cloud.
  template <BorrowedPoints P>
    requires OrientedPoints<P>
  explicit cylinder_family(P&& points, cylinder_limits limits = {})
      : cylinder_family{as_points(points), normals_in(points), std::move(limits)} {}

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return 2; }
  [[nodiscard]] std::optional<model_type> fit(std::span<const std::int32_t> indices) const {
    if (indices.size() < 2) return std::nullopt;
    index_t first = indices[0], other = indices[1];
    if (indices.size() > 2) {
      // Of a few points that are spread over all, the one whose normal differs most from the first;
      // unknown normals are skipped.
      const std::size_t stride = std::max<std::size_t>(1, indices.size() / 64);
      index_t known = -1;
      other = -1;
      for (std::size_t k = 0; k < indices.size(); k += stride) {
        const index_t i = indices[k];
        if (!is_finite(normals_[i]) || normals_[i].isZero(0)) continue;
        if (known < 0)
          known = i;
        else if (other < 0 || cosine(known, i) < cosine(known, other))
          other = i;
      }
      if (other < 0) return std::nullopt;
      first = known;
    }
    const auto start =
        cylinder_of(points_[first].template cast<double>(), normals_[first].template cast<double>(),
                    points_[other].template cast<double>(), normals_[other].template cast<double>(),
                    indices.size() == 2 ? limits_ : cylinder_limits{});
    if (!start || indices.size() == 2) return start;
    const auto data = gather_points<S, 3>(points_, indices);
    if (!data) return std::nullopt;
    Eigen::MatrixXd normals(3, std::ssize(indices));
    for (index_t k = 0; k < normals.cols(); ++k) {
      const auto normal = normals_[indices[k]];
      normals.col(k) = is_finite(normal) ? normal.template cast<double>().eval()
                                         : Eigen::Vector3d::Zero().eval();
    }
    return refine_cylinder(*data, normals, *start, limits_);
  }
  [[nodiscard]] double residual(const model_type& model, index_t i) const {
    return std::abs(model.signed_distance(points_[i]));
  }

 private:
  [[nodiscard]] S cosine(index_t i, index_t j) const {
    return std::abs(normals_[i].dot(normals_[j])) / (normals_[i].norm() * normals_[j].norm());
  }

  points_view<S, 3> points_, normals_;
  cylinder_limits limits_;
};
export template <BorrowedPoints P, BorrowedPoints N>
cylinder_family(P&&, N&&, cylinder_limits = {}) -> cylinder_family<scalar_of<P>>;
export template <BorrowedPoints P>
  requires OrientedPoints<P>
cylinder_family(P&&, cylinder_limits = {}) -> cylinder_family<scalar_of<P>>;

}  // namespace cilantro
