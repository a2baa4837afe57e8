// SPDX-License-Identifier: MIT
//
// Polytopes as they are cut by planes.
module;
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>
module cilantro.spatial:cell;

import cilantro.core;
import cilantro.eigen;
import :half_space_tests;
import :polytope_data;
import :polytope_measures;
import :polytope_shape;

namespace cilantro {

using piece = std::shared_ptr<const polytope_data>;

bool is_solid(const polytope_data& p) {
  return p.affine_dimension == p.dimension && p.dimension > 0;
}

template <class Cell>
struct cell_halves {
  std::optional<Cell> inner, outer;
};

/// A solid polytope as its corners and rays, and as the planes that each of them lies on: what it
/// takes to cut it by a plane without computing anything else anew (double description: Motzkin et
/// al. 1953; adjacency as in Fukuda and Prodon 1996).
///
/// Corners and rays are `generators` (x, w) with w = 1 or 0. Only what has no rays is cut by them.
class cell {
 public:
  using halves = cell_halves<cell>;
  /// Where generators are beside a plane normal · x = offset.
  struct extent {
    double least, most;
  };

  explicit cell(piece whole) : whole_{std::move(whole)} {
    const auto& p = *whole_;
    d_ = p.dimension;
    const index_t corners = p.vertices.cols(), facets = p.facets.size();
    count_ = corners + p.rays.cols();
    generators_.resize(count_ * (d_ + 1));
    for (index_t g = 0; g < count_; ++g) {
      const bool is_corner = g < corners;
      Eigen::VectorXd::Map(generator(g), d_) =
          is_corner ? p.vertices.col(g) : p.rays.col(g - corners);
      generator(g)[d_] = is_corner ? 1 : 0;
    }
    planes_.reserve(facets * (d_ + 1));
    for (index_t f = 0; f < facets; ++f) add_plane(p.normals.col(f).data(), p.offsets[f], 1);
    words_ = words_for(facets);
    if (d_ < 2 || !p.bounded || count_ * words_ > most_words) return;
    on_.assign(count_ * words_, 0);
    for (index_t f = 0; f < facets; ++f)
      for (const auto g : p.facets[f]) mark(g, f);
    // Where a corner is short of facets, its edges are not known.
    for (index_t g = 0; g < corners && !on_.empty(); ++g)
      if (count_bits(planes_of(g)) < d_) on_.clear();
  }

  [[nodiscard]] extent beside(const double* normal, double offset) const {
    extent found{.least = std::numeric_limits<double>::infinity(),
                 .most = -std::numeric_limits<double>::infinity()};
    for (index_t g = 0; g < count_; ++g) {
      double height = height_of(g, normal, offset);
      if (is_ray(g)) {
        if (std::abs(height) <= negligible_slope) continue;
        height *= std::numeric_limits<double>::infinity();
      }
      found.least = std::min(found.least, height);
      found.most = std::max(found.most, height);
    }
    return found;
  }

  /// What is on the inner side of the plane, normal · x <= offset, and on the outer one; nothing
  /// where it is no thicker than the tolerance.
  [[nodiscard]] halves split(const double* normal, double offset, double tolerance) && {
    const auto [least, most] = beside(normal, offset);
    if (most <= tolerance) return {.inner = std::move(*this), .outer = {}};
    if (least >= -tolerance) return {.inner = {}, .outer = std::move(*this)};
    if (on_.empty()) return split_slowly(normal, offset, tolerance);

    std::vector<double> heights(count_);
    std::vector<signed char> side(count_, 0);
    for (index_t g = 0; g < count_; ++g) {
      heights[g] = height_of(g, normal, offset);
      if (std::abs(heights[g]) > tolerance) side[g] = heights[g] < 0 ? -1 : 1;
    }
    const index_t plane = plane_count();
    cell inner = without_generators(plane), outer = inner;
    inner.add_plane(normal, offset, 1);
    outer.add_plane(normal, offset, -1);
    for (index_t g = 0; g < count_; ++g) {
      if (side[g] <= 0) inner.add_generator(generator(g), planes_of(g), side[g] == 0, plane);
      if (side[g] >= 0) outer.add_generator(generator(g), planes_of(g), side[g] == 0, plane);
    }
    add_crossings(heights, side, plane, inner, outer);
    return {.inner = std::move(inner), .outer = std::move(outer)};
  }

  /// As a polytope again; nothing if it has no inside.
  [[nodiscard]] piece polytope(double tolerance) const {
    if (whole_) return whole_;
    if (auto made = from_generators(tolerance)) return made;
    auto made = from_planes(tolerance);
    return is_solid(*made) ? made : nullptr;
  }

 private:
  static constexpr index_t most_words = index_t{1} << 20;
  static constexpr double negligible_slope = 1e-12;

  cell() = default;
  [[nodiscard]] index_t plane_count() const { return std::ssize(planes_) / (d_ + 1); }
  static index_t words_for(index_t planes) { return (planes + 63) / 64; }
  static int count_bits(std::span<const std::uint64_t> bits) {
    int sum = 0;
    for (const auto word : bits) sum += std::popcount(word);
    return sum;
  }

  [[nodiscard]] const double* generator(index_t g) const { return &generators_[g * (d_ + 1)]; }
  [[nodiscard]] double* generator(index_t g) { return &generators_[g * (d_ + 1)]; }
  [[nodiscard]] bool is_ray(index_t g) const { return generator(g)[d_] == 0; }
  [[nodiscard]] std::span<const std::uint64_t> planes_of(index_t g) const {
    return {&on_[g * words_], static_cast<std::size_t>(words_)};
  }
  [[nodiscard]] bool lies_on(index_t g, index_t plane) const {
    return (on_[g * words_ + plane / 64] >> (plane % 64) & 1) != 0;
  }
  void mark(index_t g, index_t plane) {
    on_[g * words_ + plane / 64] |= std::uint64_t{1} << (plane % 64);
  }
  [[nodiscard]] double height_of(index_t g, const double* normal, double offset) const {
    const double* x = generator(g);
    double sum = -offset * x[d_];
    for (index_t k = 0; k < d_; ++k) sum += normal[k] * x[k];
    return sum;
  }

  void add_plane(const double* normal, double offset, double sign) {
    for (index_t k = 0; k < d_; ++k) planes_.push_back(sign * normal[k]);
    planes_.push_back(sign * offset);
  }
  /// With the same planes, and room for another one.
  [[nodiscard]] cell without_generators(index_t plane) const {
    cell other;
    other.d_ = d_;
    other.planes_.reserve(planes_.size() + d_ + 1);
    other.planes_ = planes_;
    other.words_ = words_for(plane + 1);
    other.generators_.reserve(generators_.size());
    other.on_.reserve(count_ * other.words_);
    return other;
  }
  void add_generator(const double* x, std::span<const std::uint64_t> planes, bool is_on,
                     index_t plane) {
    generators_.insert(generators_.end(), x, x + d_ + 1);
    on_.insert(on_.end(), planes.begin(), planes.end());
    on_.resize((count_ + 1) * words_, 0);
    if (is_on) mark(count_, plane);
    ++count_;
  }

  /// Where edges meet the plane: for each two generators on either side that are neighbours, which
  /// they are if no third one lies on all planes on which both are.
  void add_crossings(const std::vector<double>& heights, const std::vector<signed char>& side,
                     index_t plane, cell& inner, cell& outer) const {
    std::vector<index_t> members;
    std::vector<std::uint64_t> common(words_);
    std::vector<double> crossing(d_ + 1);
    for (index_t f = 0; f < plane; ++f) {
      members.clear();
      for (index_t g = 0; g < count_; ++g)
        if (lies_on(g, f)) members.push_back(g);
      for (const auto a : members)
        for (const auto b : members) {
          if (side[a] >= 0 || side[b] <= 0) continue;
          for (index_t w = 0; w < words_; ++w)
            common[w] = on_[a * words_ + w] & on_[b * words_ + w];
          // Each pair once: from the first plane on which both are.
          if (first_bit(common) != f || count_bits(common) < d_ - 1) continue;
          if (std::ranges::any_of(
                  members, [&](index_t c) { return c != a && c != b && lies_on_all(c, common); }))
            continue;
          cross(a, b, heights, crossing);
          inner.add_generator(crossing.data(), common, true, plane);
          outer.add_generator(crossing.data(), common, true, plane);
        }
    }
  }
  static index_t first_bit(const std::vector<std::uint64_t>& bits) {
    for (std::size_t w = 0; w < bits.size(); ++w)
      if (bits[w] != 0) return static_cast<index_t>(64 * w) + std::countr_zero(bits[w]);
    return -1;
  }
  [[nodiscard]] bool lies_on_all(index_t g, const std::vector<std::uint64_t>& planes) const {
    for (index_t w = 0; w < words_; ++w)
      if ((planes[w] & ~on_[g * words_ + w]) != 0) return false;
    return true;
  }
  void cross(index_t a, index_t b, const std::vector<double>& heights,
             std::vector<double>& out) const {
    const double share_of_a = heights[b] / (heights[b] - heights[a]);
    const double share_of_b = -heights[a] / (heights[b] - heights[a]);
    const double *x = generator(a), *y = generator(b);
    for (index_t k = 0; k < d_; ++k) out[k] = share_of_a * x[k] + share_of_b * y[k];
    out[d_] = 1;
  }

  [[nodiscard]] piece from_planes(double tolerance) const {
    const Eigen::Map<const Eigen::MatrixXd> all(planes_.data(), d_ + 1, plane_count());
    return make_intersection(all.topRows(d_), all.row(d_).transpose(), tolerance);
  }
  [[nodiscard]] halves split_slowly(const double* normal, double offset, double tolerance) const {
    halves both;
    for (const double sign : {1.0, -1.0}) {
      cell half = *this;
      half.add_plane(normal, offset, sign);
      if (auto made = half.from_planes(tolerance); is_solid(*made))
        (sign > 0 ? both.inner : both.outer).emplace(std::move(made));
    }
    return both;
  }

  /// Nothing if the generators do not make a polytope within the tolerance.
  [[nodiscard]] piece from_generators(double tolerance) const {
    const Eigen::Map<const Eigen::MatrixXd> all(generators_.data(), d_ + 1, count_);
    std::vector<std::int32_t> order;
    for (index_t g = 0; g < count_; ++g) {
      if (count_bits(planes_of(g)) < d_) return nullptr;
      order.push_back(static_cast<std::int32_t>(g));
    }
    std::ranges::sort(order, [&](auto a, auto b) {
      return std::lexicographical_compare(generator(a), generator(a) + d_, generator(b),
                                          generator(b) + d_);
    });
    polytope_shape shape;
    if (count_ == 0) return nullptr;
    shape.vertices = columns_of(all.topRows(d_), order);
    shape.rays.resize(d_, 0);
    std::vector<index_t> facets;
    for (index_t f = 0; f < plane_count(); ++f) {
      const std::size_t before = shape.facets.values.size();
      for (index_t k = 0; k < count_; ++k)
        if (lies_on(order[k], f)) shape.facets.values.push_back(static_cast<std::int32_t>(k));
      if (std::ssize(shape.facets.values) - static_cast<index_t>(before) < d_) {
        shape.facets.values.resize(before);
        continue;
      }
      shape.facets.close();
      facets.push_back(f);
    }
    if (std::ssize(facets) <= d_) return nullptr;
    const Eigen::Map<const Eigen::MatrixXd> planes(planes_.data(), d_ + 1, plane_count());
    shape.normals = columns_of(planes.topRows(d_), facets);
    shape.offsets = entries_of(planes.row(d_).transpose(), facets);
    const double allowed = std::max(tolerance, 64 * std::numeric_limits<double>::epsilon() *
                                                   shape.vertices.cwiseAbs().maxCoeff());
    if (!holds(shape, allowed)) return nullptr;
    arrange(shape, false, false);
    if (d_ > 3) {
      auto boundary = simplices_of_boundary(shape.vertices);
      if (!boundary.error.empty()) return nullptr;
      shape.simplices = std::move(boundary.simplices);
    }
    polytope_data out =
        embed(std::move(shape), {Eigen::VectorXd::Zero(d_), Eigen::MatrixXd::Identity(d_, d_)});
    out.tolerance = allowed;
    return std::make_shared<const polytope_data>(std::move(out));
  }
  /// Whether corners are inside all planes, and on those that they are said to lie on; and, in
  /// space, whether facets close up (Euler).
  [[nodiscard]] static bool holds(const polytope_shape& shape, double allowed) {
    for (index_t f = 0; f < shape.facets.size(); ++f) {
      const auto normal = shape.normals.col(f).transpose();
      if (!((normal * shape.vertices).maxCoeff() <= shape.offsets[f] + allowed)) return false;
      for (const auto g : shape.facets[f])
        if (!(std::abs(normal.dot(shape.vertices.col(g)) - shape.offsets[f]) <= allowed))
          return false;
    }
    if (shape.vertices.rows() != 3) return true;
    const auto edges = std::ssize(shape.facets.values);
    return 2 * (shape.vertices.cols() + shape.facets.size() - 2) == edges;
  }

  piece whole_;
  index_t d_ = 0, count_ = 0, words_ = 0;
  std::vector<double> planes_;  ///< d + 1 numbers each: normal and offset.
  std::vector<double> generators_;
  std::vector<std::uint64_t> on_;  ///< Empty if the polytope cannot be cut by its generators.
};

}  // namespace cilantro
