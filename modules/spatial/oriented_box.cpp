// SPDX-License-Identifier: MIT
module cilantro.spatial;

import :polytope_shape;

namespace cilantro {
namespace {

/// Corners times directions that are tried, and how many boxes are then turned.
constexpr index_t most_work = 4'000'000;
constexpr std::size_t most_turned = 12;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a[0] * b[1] - a[1] * b[0];
}

/// The corners of the hull of points in a plane, counterclockwise (Andrew 1979).
std::vector<Eigen::Vector2d> ring_about(std::vector<Eigen::Vector2d> points) {
  const auto before = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1];
  };
  std::ranges::sort(points, before);
  std::vector<Eigen::Vector2d> ring;
  for (const bool upper : {false, true}) {
    const std::size_t begin = ring.size();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& next = points[upper ? points.size() - 1 - i : i];
      while (ring.size() >= begin + 2 &&
             cross(ring.back() - ring[ring.size() - 2], next - ring.back()) <= 0)
        ring.pop_back();
      ring.push_back(next);
    }
    ring.pop_back();
  }
  return ring;
}

struct rectangle {
  double area = std::numeric_limits<double>::infinity();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();
};

/// The smallest rectangle about points in a plane: one side lies on an edge of their hull. The
/// points that touch the other sides move on as the edges turn (rotating calipers: Shamos 1978).
rectangle smallest_rectangle(std::vector<Eigen::Vector2d> points) {
  const auto ring = ring_about(std::move(points));
  const std::size_t n = ring.size();
  rectangle best;
  if (n < 3) {
    if (n == 2 && (ring[1] - ring[0]).norm() > 0) best.direction = (ring[1] - ring[0]).normalized();
    best.area = 0;
    return best;
  }
  std::size_t right = 1, top = 1, left = 1;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d edge = ring[(i + 1) % n] - ring[i];
    const double length = edge.norm();
    if (!(length > 0)) continue;
    const Eigen::Vector2d along = edge / length, across{-along[1], along[0]};
    const auto climb = [&](std::size_t& at, const Eigen::Vector2d& direction) {
      for (std::size_t steps = 0; steps < n && direction.dot(ring[(at + 1) % n] - ring[at]) > 0;
           ++steps)
        at = (at + 1) % n;
    };
    climb(right, along);
    if (i == 0) top = right;
    climb(top, across);
    if (i == 0) left = top;
    climb(left, -along);
    const double area = along.dot(ring[right] - ring[left]) * across.dot(ring[top] - ring[i]);
    if (area < best.area) best = {area, along};
  }
  return best;
}

/// A frame of directions for a box, and its volume.
struct candidate {
  Eigen::Matrix3d axes;
  double volume;
  index_t order = 0;  ///< Which comes first of equally large ones.
};

/// The smallest box about the corners with one side across the direction.
candidate turned_about(const Eigen::Matrix3Xd& corners, const Eigen::Vector3d& direction) {
  Eigen::Index least = 0;
  direction.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d u = direction.cross(Eigen::Vector3d::Unit(least)).normalized();
  const Eigen::Vector3d v = direction.cross(u);
  std::vector<Eigen::Vector2d> flat(corners.cols());
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (index_t i = 0; i < corners.cols(); ++i) {
    const Eigen::Vector3d corner = corners.col(i);
    flat[i] = {u.dot(corner), v.dot(corner)};
    low = std::min(low, direction.dot(corner));
    high = std::max(high, direction.dot(corner));
  }
  const auto best = smallest_rectangle(std::move(flat));
  const Eigen::Vector3d first = best.direction[0] * u + best.direction[1] * v;
  candidate found{.axes = {}, .volume = best.area * (high - low)};
  found.axes << first, direction.cross(first), direction;
  return found;
}

/// Directions across which a side of the smallest box may lie: those of facets, the largest first,
/// and those across two edges, as far as the work allows.
std::vector<Eigen::Vector3d> directions_of(const polytope_data& hull,
                                           const Eigen::Matrix3Xd& corners) {
  const index_t most = std::max<index_t>(64, most_work / std::max<index_t>(1, corners.cols()));
  const auto corner = [&](std::int32_t v) -> Eigen::Vector3d { return corners.col(v); };
  std::vector<std::pair<double, index_t>> by_area;
  std::vector<Eigen::Vector3d> edges, directions;
  for (index_t f = 0; f < hull.facets.size(); ++f) {
    const auto ring = hull.facets[f];
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 2; k < ring.size(); ++k) {
      const Eigen::Vector3d a = corner(ring[k - 1]) - corner(ring[0]);
      sum += a.cross(Eigen::Vector3d{corner(ring[k]) - corner(ring[0])});
    }
    by_area.push_back({-sum.norm(), f});
    for (std::size_t k = 0; k < ring.size(); ++k)
      if (const auto from = ring[k], to = ring[(k + 1) % ring.size()]; from < to)
        edges.push_back((corner(to) - corner(from)).normalized());
  }
  std::ranges::sort(by_area);
  for (const auto& [area, f] : by_area)
    if (std::ssize(directions) < most) directions.push_back(hull.normals.col(f));
  if (std::ssize(edges) * std::ssize(edges) / 2 <= most - std::ssize(directions))
    for (std::size_t i = 0; i < edges.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (const Eigen::Vector3d across = edges[i].cross(edges[j]); across.norm() > 1e-9)
          directions.push_back(across.normalized());
  return directions;
}

Eigen::Matrix3d smallest_frame(const polytope_data& hull, const Eigen::Matrix3Xd& corners) {
  std::vector<candidate> best;
  for (const auto& direction : directions_of(hull, corners)) {
    auto next = turned_about(corners, direction);
    next.order = std::ssize(best);
    best.push_back(std::move(next));
  }
  std::ranges::sort(best, {}, [](const candidate& c) { return std::pair{c.volume, c.order}; });
  if (best.size() > most_turned) best.resize(most_turned);
  for (auto& box : best)
    for (int round = 0, axis = 0, unchanged = 0; round < 100 && unchanged < 3; ++round) {
      auto turned = turned_about(corners, box.axes.col(axis));
      axis = (axis + 1) % 3;
      if (turned.volume < box.volume * (1 - 1e-12)) {
        turned.order = box.order;
        box = std::move(turned);
        // Its third axis is the one that it was turned about.
        axis = 0;
        unchanged = 0;
      } else {
        ++unchanged;
      }
    }
  return std::ranges::min_element(best, {}, &candidate::volume)->axes;
}

}  // namespace

std::optional<oriented_box> smallest_box_about(const polytope_data& hull) {
  if (hull.affine_dimension < 0) return {};
  const index_t d = hull.dimension, k = hull.affine_dimension;
  const auto moved = centered(hull.vertices);
  const Eigen::MatrixXd& arms = moved.places;
  Eigen::MatrixXd axes = Eigen::MatrixXd::Identity(d, d);
  if (k == 3) {
    axes = smallest_frame(hull, arms);
  } else if (k > 0) {
    // Flat: in coordinates of its own.
    const Eigen::MatrixXd across =
        k == d ? Eigen::MatrixXd(d, 0) : span_of(hull.normals.rightCols(2 * (d - k)), 1e-9);
    Eigen::MatrixXd within = k == d ? axes : complement_of(across);
    if (k == 2) {
      std::vector<Eigen::Vector2d> flat(arms.cols());
      for (index_t i = 0; i < arms.cols(); ++i) flat[i] = within.transpose() * arms.col(i);
      const Eigen::Vector2d x = smallest_rectangle(std::move(flat)).direction;
      Eigen::Matrix2d turn;
      turn << x[0], -x[1], x[1], x[0];
      within = Eigen::MatrixXd{within * turn};
    }
    axes << within, across;
  }
  const Eigen::MatrixXd places = axes.transpose() * arms;
  const Eigen::VectorXd low = places.rowwise().minCoeff(), high = places.rowwise().maxCoeff();
  std::vector<index_t> order(d);
  std::iota(order.begin(), order.end(), index_t{0});
  std::ranges::sort(order, {}, [&](index_t i) { return std::pair{low[i] - high[i], i}; });
  const auto enlarged = [&](Eigen::VectorXd lengths) {
    for (index_t i = 0; i < d; ++i) lengths[i] = std::ldexp(lengths[i], moved.exponent);
    return lengths;
  };
  oriented_box found{.center = moved.middle + enlarged(axes * (low + high) / 2),
                     .axes = columns_of(axes, order),
                     .half_extents = entries_of(enlarged((high - low) / 2), order)};
  found.half_extents.array() += hull.tolerance;
  if (determinant(found.axes) < 0) found.axes.col(d - 1) *= -1;
  return found;
}

}  // namespace cilantro
