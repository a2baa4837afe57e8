// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

/// The least spread of neighbours in a direction, relative to the largest, that determines a slope.
constexpr double least_spread = 0.1;

/// Fits gradients, one neighbourhood after another.
template <Scalar S, int D>
class gradient_fit {
 public:
  gradient_fit(const oriented_points_view<S, D>& surface, std::span<const double> values,
               double rounding)
      : surface_{surface},
        values_{values},
        rounding_{rounding},
        scatter_(surface.points.dimension(), surface.points.dimension()),
        slopes_(surface.points.dimension()) {}

  /// The gradient at point `i`; NaN if nothing is known.
  point_vector<double, D> operator()(index_t i, std::span<const std::int32_t> near) {
    const index_t d = surface_.points.dimension();
    vector unknown = vector::Constant(d, std::numeric_limits<double>::quiet_NaN());
    const vector normal = surface_.normals[i].template cast<double>();
    if (!std::isfinite(values_[i]) || !is_finite(normal) || normal.isZero(0)) return unknown;
    sum(i, near, normal / normal.norm());

    // Neighbours scatter by the rounding of their coordinates, wherever they are.
    const double extent = std::sqrt(scatter_.trace() / double(near.size()));
    const double step = double(std::numeric_limits<S>::epsilon()) *
                        (surface_.points[i].template cast<double>().cwiseAbs().maxCoeff() + extent);
    const double noise = 4 * double(near.size()) * step * step;
    if (!(scatter_.trace() > noise)) return unknown;
    if (largest_difference_ <= 4 * rounding_ * largest_value_) return vector::Zero(d);
    if constexpr (D == 3) {
      // With a third spread along the normal, the matrix has an inverse, and its determinant says
      // how little the lesser spread in the plane can be.
      const double both = scatter_.trace();
      const Eigen::Vector3d n = normal / normal.norm();
      const Eigen::Matrix3d full = scatter_ + both * n * n.transpose();
      const double least = full.determinant() / (both * both);
      if (least > least_spread * least_spread * both && least > noise)
        return full.inverse() * slopes_;
    }
    const auto spreads = decompose_symmetric<D>(scatter_);
    const double least =
        std::max(noise, least_spread * least_spread * spreads.values[spreads.values.size() - 1]);
    vector gradient = vector::Zero(d);
    for (index_t k = 0; k < d; ++k)
      if (spreads.values[k] >= least)
        gradient +=
            spreads.vectors.col(k) * (spreads.vectors.col(k).dot(slopes_) / spreads.values[k]);
    return gradient;
  }

 private:
  using vector = point_vector<double, D>;

  /// Sums the neighbours' places in the tangent plane, seen from point `i`, times themselves and
  /// times the differences of values.
  void sum(index_t i, std::span<const std::int32_t> near, const vector& n) {
    const vector here = surface_.points[i].template cast<double>();
    scatter_.setZero();
    slopes_.setZero();
    largest_difference_ = 0;
    largest_value_ = std::abs(values_[i]);
    for (const auto j : near) {
      if (!std::isfinite(values_[j])) continue;
      const vector offset = surface_.points[j].template cast<double>() - here;
      const vector along = offset - n * n.dot(offset);
      const double difference = values_[j] - values_[i];
      scatter_.noalias() += along * along.transpose();
      slopes_ += along * difference;
      largest_difference_ = std::max(largest_difference_, std::abs(difference));
      largest_value_ = std::max(largest_value_, std::abs(values_[j]));
    }
  }

  oriented_points_view<S, D> surface_;
  std::span<const double> values_;
  double rounding_;
  Eigen::Matrix<double, D, D> scatter_;
  vector slopes_;
  double largest_difference_ = 0, largest_value_ = 0;
};

}  // namespace

template <Scalar S, int D>
point_matrix<S, D> closed_gradients(const oriented_points_view<S, D>& surface,
                                    std::span<const double> values, double rounding,
                                    const neighborhood_spec& spec, const execution& how) {
  const auto& [points, normals] = surface;
  const index_t d = points.dimension();
  expects(std::ssize(values) == points.size(),
          "value_gradients: there must be one value per point; there are " +
              std::to_string(values.size()) + " for " + std::to_string(points.size()) + " points");
  expects(surface.has_normals() || points.empty(),
          "value_gradients: the points have no normals; estimate them first");
  expects(points.empty() || spec.max_count() >= d,
          "value_gradients: a gradient in " + std::to_string(d) + " dimensions needs " +
              std::to_string(d) + " neighbours, the point itself among them, and there are " +
              std::to_string(spec.max_count()) + " at most");
  expect_unit_length<S, D>(normals, "value_gradients");
  point_matrix<S, D> gradients =
      point_matrix<S, D>::Constant(d, points.size(), std::numeric_limits<S>::quiet_NaN());
  if (points.empty()) return gradients;
  const kd_tree<S, D> tree{points, {.threads = how.threads}};
  visit_neighborhoods(tree, points, spec,
                      [&](const neighborhood_block<S>& block) {
                        gradient_fit<S, D> fit{surface, values, rounding};
                        for (index_t k = 0; k < block.size(); ++k)
                          gradients.col(block.query(k)) =
                              fit(block.query(k), block[k].indices()).template cast<S>();
                      },
                      {.ascending = false, .threads = how.threads, .monitor = how.monitor});
  return gradients;
}

#define CILANTRO_INSTANTIATE(S, D)                                                \
  template point_matrix<S, D> closed_gradients(const oriented_points_view<S, D>&, \
                                               std::span<const double>, double,   \
                                               const neighborhood_spec&, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
