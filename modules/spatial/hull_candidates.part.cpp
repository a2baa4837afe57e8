// SPDX-License-Identifier: MIT
//
// Which points can be vertices of their hull at all: in two and three dimensions, those that are
// not inside the hull of some extreme ones (Akl and Toussaint 1978, with more directions).
module;
#include "spatial/kernels/inside_planes.hpp"
#include "spatial/qhull.hpp"
module cilantro.spatial:hull_candidates;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :half_space_tests;
import :polytope_data;
import :polytope_shape;

namespace cilantro {

/// Beyond it, sums of coordinates and of their products with unit vectors are no numbers.
constexpr double largest_coordinate = 1e307;

/// What `hull_candidates` returns.
struct candidate_list : index_list {
  index_t non_finite = 0;
};

namespace {

/// Fewer points than this are not worth it.
constexpr index_t least_points = 1000;
/// Extremes are looked for in every so many blocks.
constexpr index_t block = 64, blocks_apart = 8;
constexpr int directions_3d = 24, directions_2d = 8;

/// Directions that are spread over a half circle or, along a spiral, over a half sphere, after the
/// axes.
Eigen::MatrixXf spread_directions(index_t d) {
  const int more = d == 2 ? directions_2d : directions_3d;
  Eigen::MatrixXf all(d, d + more);
  all.leftCols(d).setIdentity();
  for (int i = 0; i < more; ++i) {
    if (d == 2) {
      const float turn = float(i + 0.5) / float(more) * std::numbers::pi_v<float>;
      all.col(d + i) << std::cos(turn), std::sin(turn);
    } else {
      const float z = (float(i) + 0.5F) / float(more), r = std::sqrt(1 - z * z);
      const float turn = std::numbers::pi_v<float> * (3 - std::sqrt(5.0F)) * float(i);
      all.col(d + i) << r * std::cos(turn), r * std::sin(turn), z;
    }
  }
  return all;
}

/// Some points that are far out, ascending and each once. Which ones does not matter for the
/// result.
template <Scalar S>
index_list extremes_of(points_view<S, dynamic> points) {
  const index_t d = points.dimension();
  const Eigen::MatrixXf directions = spread_directions(d);
  struct extreme {
    float low = std::numeric_limits<float>::infinity();
    float high = -std::numeric_limits<float>::infinity();
    index_t low_block = -1, high_block = -1;
  };
  std::vector<extreme> found(directions.cols());
  std::array<std::array<float, block>, 3> axis{};
  const auto load = [&](index_t begin) {
    for (index_t k = 0; k < d; ++k)
      for (index_t i = 0; i < block; ++i)
        axis[k][i] = float(points.data()[(begin + i) * points.stride() + k]);
  };
  const auto along = [&](index_t j, index_t i) {
    float sum = directions(0, j) * axis[0][i] + directions(1, j) * axis[1][i];
    if (d == 3) sum += directions(2, j) * axis[2][i];
    return sum;
  };
  for (index_t begin = 0; begin + block <= points.size(); begin += block * blocks_apart) {
    load(begin);
    for (index_t j = 0; j < directions.cols(); ++j) {
      std::array<float, 16> low, high;
      low.fill(std::numeric_limits<float>::infinity());
      high.fill(-std::numeric_limits<float>::infinity());
      for (index_t i = 0; i < block; ++i) {
        const float place = along(j, i);
        low[i % 16] = std::min(low[i % 16], place);
        high[i % 16] = std::max(high[i % 16], place);
      }
      const float least = std::ranges::min(low), most = std::ranges::max(high);
      if (least < found[j].low) found[j] = {least, found[j].high, begin, found[j].high_block};
      if (most > found[j].high) found[j] = {found[j].low, most, found[j].low_block, begin};
    }
  }
  index_list extremes;
  for (index_t j = 0; j < directions.cols(); ++j) {
    for (const bool high : {false, true}) {
      const index_t begin = high ? found[j].high_block : found[j].low_block;
      if (begin < 0) continue;
      load(begin);
      index_t best = 0;
      for (index_t i = 1; i < block; ++i)
        if (const float at = along(j, i), most = along(j, best);
            std::isnan(most) || (high ? at > most : at < most))
          best = i;
      extremes.push_back(static_cast<std::int32_t>(begin + best));
    }
  }
  std::ranges::sort(extremes);
  extremes.erase(std::ranges::unique(extremes).begin(), extremes.end());
  return extremes;
}

/// Marks the points inside the hull of a few; false if these are too flat for that.
template <Scalar S>
bool mark_inner(points_view<S, dynamic> points, const hull_options& how,
                std::vector<std::uint8_t>& inner) {
  const index_t d = points.dimension();
  const index_list extremes = extremes_of(points);
  Eigen::MatrixXd few(d, std::ssize(extremes));
  for (index_t i = 0; i < few.cols(); ++i) few.col(i) = points[extremes[i]].template cast<double>();
  if (!few.allFinite()) return false;
  const double size = few.cwiseAbs().maxCoeff();
  if (few.cols() <= d || size > largest_coordinate ||
      span_of(few.rightCols(few.cols() - 1).colwise() - few.col(0).eval(), 1e-6 * size).cols() < d)
    return false;
  const auto hull =
      detail::run_qhull(few.data(), static_cast<int>(few.cols()), static_cast<int>(d));
  if (!hull.error.empty()) return false;
  const Eigen::Map<const Eigen::MatrixXd> normals(hull.normals.data(), d,
                                                  std::ssize(hull.normals) / d);
  // Vertices of the hull are outside of this by far more than what rounding makes of the sums.
  const Eigen::VectorXd offsets =
      (normals.transpose() * few).rowwise().maxCoeff().array() - 1e-9 * size;
  inner.resize(points.size());
  find_inside(points, Eigen::VectorXd::Zero(d), normals, offsets,
              {.threads = how.threads, .monitor = how.monitor}, inner);
  return true;
}

}  // namespace

/// The finite points that may be vertices of the hull, ascending.
template <Scalar S>
candidate_list hull_candidates(points_view<S, dynamic> points, const hull_options& how) {
  candidate_list candidates;
  std::vector<std::uint8_t> inner;
  const bool culled = how.cull && (points.dimension() == 2 || points.dimension() == 3) &&
                      points.size() >= least_points && mark_inner(points, how, inner);
  for (index_t i = 0; i < points.size(); ++i) {
    if (culled && inner[i] != 0) continue;
    const S* point = points.data() + i * points.stride();
    bool is_finite = true;
    for (index_t d = 0; d < points.dimension(); ++d) is_finite &= std::isfinite(point[d]);
    if (is_finite)
      candidates.push_back(static_cast<std::int32_t>(i));
    else
      ++candidates.non_finite;
  }
  return candidates;
}
template candidate_list hull_candidates(points_view<float, dynamic>, const hull_options&);
template candidate_list hull_candidates(points_view<double, dynamic>, const hull_options&);

}  // namespace cilantro
