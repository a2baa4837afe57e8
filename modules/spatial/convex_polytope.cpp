// SPDX-License-Identifier: MIT
module cilantro.spatial;

import :half_space_tests;
import :linear_program;
import :polytope_shape;

namespace cilantro {

std::optional<ball> interior_ball_of(const polytope_data& polytope) {
  if (polytope.affine_dimension < polytope.dimension || polytope.dimension == 0) return {};
  // About a point of the set, so that the bound can be as small as it.
  const Eigen::VectorXd middle = polytope.vertices.rowwise().mean();
  const Eigen::VectorXd offsets = polytope.offsets - polytope.normals.transpose() * middle;
  double size = (polytope.vertices.colwise() - middle).cwiseAbs().maxCoeff();
  if (!(size > 0)) size = offsets.size() > 0 ? offsets.cwiseAbs().maxCoeff() : 1;
  const auto found = ball_anywhere(polytope.normals, offsets, 4 * (size > 0 ? size : 1), 0);
  if (!(found.radius > 0) || found.touches_bound) return {};
  return ball{.center = Eigen::VectorXd{middle + found.center}, .radius = found.radius};
}

Eigen::MatrixXd bounds_of(const polytope_data& polytope) {
  expects(polytope.affine_dimension >= 0, "bounding_box: the polytope is empty");
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Eigen::MatrixXd bounds(polytope.dimension, 2);
  for (index_t d = 0; d < polytope.dimension; ++d) {
    bounds(d, 0) = polytope.vertices.row(d).minCoeff();
    bounds(d, 1) = polytope.vertices.row(d).maxCoeff();
    for (index_t r = 0; r < polytope.rays.cols(); ++r) {
      if (polytope.rays(d, r) < -1e-12) bounds(d, 0) = -infinity;
      if (polytope.rays(d, r) > 1e-12) bounds(d, 1) = infinity;
    }
  }
  return bounds;
}

index_t farthest_vertex_of(const polytope_data& polytope, const Eigen::VectorXd& direction) {
  if (polytope.vertices.cols() == 0) return -1;
  if (polytope.rays.cols() > 0 && (direction.transpose() * polytope.rays).maxCoeff() > 1e-12)
    return -1;
  Eigen::Index best = 0;
  (direction.transpose() * polytope.vertices).maxCoeff(&best);
  return best;
}

/// By the active set method on the dual of min ‖x − p‖² with normal · x <= offset (Goldfarb and
/// Idnani 1983), whose unconstrained start is p itself: half-spaces come in as long as one is
/// violated, and go out when their multiplier would turn negative.
Eigen::VectorXd closest_point_of(const polytope_data& polytope, const Eigen::VectorXd& point) {
  constexpr const char* not_found = "closest_point: no point was found that holds";
  const index_t d = polytope.dimension;
  Eigen::VectorXd x = point;
  std::vector<index_t> active;
  std::vector<double> multipliers;
  if (d == 0) return x;
  const double enough = std::max(1e-14 * point.cwiseAbs().maxCoeff(), polytope.tolerance / 4);
  for (int step = 0; step < 100 + 20 * static_cast<int>(polytope.normals.cols()); ++step) {
    Eigen::Index entering = 0;
    const Eigen::VectorXd outside = polytope.normals.transpose() * x - polytope.offsets;
    if (outside.size() == 0 || outside.maxCoeff(&entering) <= enough) return x;
    const Eigen::VectorXd normal = polytope.normals.col(entering);
    double multiplier = 0;
    while (true) {
      // How the active multipliers change per unit of the new one, and which way x goes then.
      Eigen::MatrixXd planes(d, std::ssize(active));
      for (index_t k = 0; k < planes.cols(); ++k) planes.col(k) = polytope.normals.col(active[k]);
      Eigen::VectorXd shares(0), direction = normal;
      if (planes.cols() > 0) {
        shares = solve_symmetric(planes.transpose() * planes, planes.transpose() * normal).col(0);
        direction -= planes * shares;
      }
      const double slope = direction.squaredNorm();
      const double full = slope > 1e-18 ? (normal.dot(x) - polytope.offsets[entering]) / slope
                                        : std::numeric_limits<double>::infinity();
      double partial = std::numeric_limits<double>::infinity();
      index_t leaving = -1;
      for (index_t k = 0; k < std::ssize(active); ++k)
        if (shares[k] > 1e-15 && multipliers[k] / shares[k] < partial) {
          partial = multipliers[k] / shares[k];
          leaving = k;
        }
      const double length = std::min(full, partial);
      if (!std::isfinite(length)) throw std::runtime_error{not_found};
      for (index_t k = 0; k < std::ssize(active); ++k) multipliers[k] -= length * shares[k];
      multiplier += length;
      if (std::isfinite(full)) x -= length * direction;
      if (full <= partial) {
        active.push_back(entering);
        multipliers.push_back(multiplier);
        break;
      }
      active.erase(active.begin() + leaving);
      multipliers.erase(multipliers.begin() + leaving);
    }
  }
  throw std::runtime_error{not_found};
}

std::shared_ptr<const polytope_data> intersection_of(const polytope_data& a,
                                                     const polytope_data& b) {
  expects(a.dimension == b.dimension, "intersection: both must have the same dimension");
  if (a.affine_dimension < 0 || b.affine_dimension < 0) return make_empty(a.dimension);
  Eigen::MatrixXd normals(a.dimension, a.normals.cols() + b.normals.cols());
  Eigen::VectorXd offsets(normals.cols());
  normals << a.normals, b.normals;
  offsets << a.offsets, b.offsets;
  return make_intersection(normals, offsets, std::max(a.tolerance, b.tolerance));
}

namespace {

void expect_bounded(const polytope_data& polytope, const char* who) {
  expects(polytope.bounded, std::string{who} + ": a polytope without end has no such sum");
}

}  // namespace

std::shared_ptr<const polytope_data> transformed(const polytope_data& polytope,
                                                 const Eigen::MatrixXd& linear,
                                                 const Eigen::VectorXd& translation) {
  expects(linear.cols() == polytope.dimension,
          "transform_polytope: the transform must have the dimension of the polytope");
  expects(linear.allFinite() && translation.allFinite(),
          "transform_polytope: the transform must be finite");
  if (polytope.affine_dimension < 0) return make_empty(linear.rows());
  if (const auto inverse = solve(linear, Eigen::MatrixXd::Identity(linear.rows(), linear.rows()));
      inverse && !polytope.bounded) {
    const Eigen::MatrixXd normals = inverse->transpose() * polytope.normals;
    return make_intersection(normals, polytope.offsets + normals.transpose() * translation,
                             polytope.tolerance);
  }
  expects(polytope.bounded,
          "transform_polytope: a polytope without end needs a transform that has an inverse");
  const Eigen::MatrixXd moved = (linear * polytope.vertices).colwise() + translation;
  const double stretch = linear.norm();
  auto hull = *make_hull<double>(as_points(moved), Eigen::VectorXd::Zero(moved.rows()),
                                 {.tolerance = polytope.tolerance * std::max(stretch, 1e-300)});
  for (auto& i : hull.indices) i = polytope.indices.empty() ? i : polytope.indices[i];
  if (polytope.indices.empty()) hull.indices.clear();
  return std::make_shared<const polytope_data>(std::move(hull));
}

std::shared_ptr<const polytope_data> sum_of(const polytope_data& a, const polytope_data& b) {
  expects(a.dimension == b.dimension, "minkowski_sum: both must have the same dimension");
  expect_bounded(a, "minkowski_sum");
  expect_bounded(b, "minkowski_sum");
  expects(a.vertices.cols() * b.vertices.cols() <= 100'000'000,
          "minkowski_sum: there are too many pairs of corners");
  Eigen::MatrixXd sums(a.dimension, a.vertices.cols() * b.vertices.cols());
  for (index_t i = 0; i < a.vertices.cols(); ++i)
    for (index_t j = 0; j < b.vertices.cols(); ++j)
      sums.col(i * b.vertices.cols() + j) = a.vertices.col(i) + b.vertices.col(j);
  auto hull = *make_hull<double>(as_points(sums), Eigen::VectorXd::Zero(a.dimension),
                                 {.tolerance = a.tolerance + b.tolerance});
  hull.indices.clear();
  return std::make_shared<const polytope_data>(std::move(hull));
}

std::shared_ptr<const polytope_data> difference_of(const polytope_data& a, const polytope_data& b) {
  expects(a.dimension == b.dimension, "minkowski_difference: both must have the same dimension");
  expect_bounded(b, "minkowski_difference");
  if (a.affine_dimension < 0) return make_empty(a.dimension);
  expects(b.affine_dimension >= 0,
          "minkowski_difference: what is taken away must not be empty: everything would be left");
  Eigen::VectorXd offsets = a.offsets;
  for (index_t f = 0; f < offsets.size(); ++f)
    offsets[f] -= (a.normals.col(f).transpose() * b.vertices).maxCoeff();
  return make_intersection(a.normals, offsets, a.tolerance + b.tolerance);
}

template <Scalar S>
void find_inside(const polytope_data& polytope, points_view<S, dynamic> points,
                 const Eigen::VectorXd& origin, double margin, const execution& how,
                 std::span<std::uint8_t> inside) {
  expects(!std::isnan(margin), "contains_each: the margin must be a number");
  if (polytope.affine_dimension < 0) {
    std::ranges::fill(inside, std::uint8_t{0});
    return;
  }
  const Eigen::VectorXd offsets = polytope.offsets.array() + (margin + polytope.tolerance);
  find_inside(points, origin, polytope.normals, offsets, how, inside);
}
template void find_inside(const polytope_data&, points_view<float, dynamic>, const Eigen::VectorXd&,
                          double, const execution&, std::span<std::uint8_t>);
template void find_inside(const polytope_data&, points_view<double, dynamic>,
                          const Eigen::VectorXd&, double, const execution&,
                          std::span<std::uint8_t>);

}  // namespace cilantro
