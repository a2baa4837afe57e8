// SPDX-License-Identifier: MIT
//
// From a shape to a polytope: its measures, and the way from a subspace back into all of space.
module cilantro.spatial:polytope_measures;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :polytope_data;
import :polytope_shape;

namespace cilantro {

namespace {

double factorial(index_t n) {
  return n < 2 ? 1 : double(n) * factorial(n - 1);
}

/// Volume, area and centroid, from cones over the simplices of the boundary.
template <int D>
void measure(const polytope_shape& shape, polytope_data& out) {
  const index_t d = shape.vertices.rows();
  const point_vector<double, D> middle = shape.vertices.rowwise().mean();
  // In units of about its size, so that products of huge or tiny numbers stay in range.
  const double size = (shape.vertices.colwise() - Eigen::VectorXd{middle}).cwiseAbs().maxCoeff();
  int exponent = 0;
  std::frexp(size, &exponent);
  const double unit = size > 0 ? std::ldexp(1.0, exponent) : 1;
  point_vector<double, D> moment = 0 * middle;
  Eigen::Matrix<double, D, D> arms(d, d);
  double volume = 0, area = 0;
  for (std::size_t s = 0; s < shape.simplices.size(); s += d) {
    for (index_t k = 0; k < d; ++k)
      arms.col(k) = (shape.vertices.col(shape.simplices[s + k]) - middle) / unit;
    double cone = 0, base = 0;
    if constexpr (D == 3) {
      const Eigen::Vector3d a = arms.col(1) - arms.col(0), b = arms.col(2) - arms.col(0);
      const Eigen::Vector3d across = a.cross(b);
      cone = std::abs(across.dot(arms.col(0)));
      base = across.norm();
    } else {
      cone = std::abs(determinant(arms));
      const Eigen::MatrixXd edges = arms.rightCols(d - 1).colwise() - arms.col(0);
      base = std::sqrt(std::max(0.0, determinant(edges.transpose() * edges)));
    }
    volume += cone;
    area += base;
    moment += cone * arms.rowwise().sum();
  }
  const auto scaled = [&](double sum, index_t power) {
    return sum > 0 ? sum / factorial(power) * std::pow(unit, double(power)) : 0;
  };
  out.measure = scaled(volume, d);
  out.area = scaled(area, d - 1);
  out.centroid = middle;
  if (volume > 0) out.centroid += moment / (volume * double(d + 1)) * unit;
}

}  // namespace

/// The polytope in all of space.
polytope_data embed(polytope_shape shape, const affine_subspace& within) {
  polytope_data out;
  const index_t d = within.basis.rows(), k = within.basis.cols();
  out.dimension = d;
  out.affine_dimension = k;
  out.bounded = shape.rays.cols() == 0;
  const bool everywhere = k == d;
  if (out.bounded) {
    if (k == 0) {
      out.measure = 1;
      out.centroid = within.origin;
    } else {
      if (k == 3)
        measure<3>(shape, out);
      else
        measure<dynamic>(shape, out);
      out.centroid = within.origin + within.basis * out.centroid;
    }
  } else {
    out.measure = out.area = std::numeric_limits<double>::infinity();
  }
  const Eigen::MatrixXd across = everywhere ? Eigen::MatrixXd(d, 0) : complement_of(within.basis);
  const index_t facets = shape.facets.size(), flat = across.cols();
  out.vertices = (within.basis * shape.vertices).colwise() + within.origin;
  out.rays = within.basis * shape.rays;
  out.normals.resize(d, facets + 2 * flat);
  out.offsets.resize(facets + 2 * flat);
  out.normals.leftCols(facets) = within.basis * shape.normals;
  out.offsets.head(facets) = shape.offsets;
  for (index_t f = 0; f < facets; ++f) out.offsets[f] += out.normals.col(f).dot(within.origin);
  for (index_t j = 0; j < flat; ++j) {
    const double place = across.col(j).dot(within.origin);
    out.normals.col(facets + 2 * j) = across.col(j);
    out.offsets[facets + 2 * j] = place;
    out.normals.col(facets + 2 * j + 1) = -across.col(j);
    out.offsets[facets + 2 * j + 1] = -place;
  }
  out.indices = std::move(shape.indices);
  out.facets = std::move(shape.facets);
  out.neighbors = std::move(shape.neighbors);
  out.simplices = std::move(shape.simplices);
  return out;
}

/// The polytope whose coordinates are those of its space.
polytope_data embed_in_space(polytope_shape shape) {
  const index_t d = shape.vertices.rows();
  return embed(std::move(shape), {Eigen::VectorXd::Zero(d), Eigen::MatrixXd::Identity(d, d)});
}

/// Moves the polytope.
void translate(polytope_data& moved, const Eigen::VectorXd& by) {
  if (by.size() == 0 || by.isZero(0)) return;
  moved.vertices.colwise() += by;
  moved.offsets += moved.normals.transpose() * by;
  if (moved.centroid.size() > 0) moved.centroid += by;
  moved.tolerance += 64 * std::numeric_limits<double>::epsilon() * by.cwiseAbs().maxCoeff();
}

}  // namespace cilantro
