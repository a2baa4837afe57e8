// SPDX-License-Identifier: MIT
//
// The part of space of which a cloud has every point, while a tile goes through steps. Internal.
module cilantro.tiles:region;

import cilantro.standard;
import cilantro.core;
import :survey;

namespace cilantro {

/// A rectangle of the first two coordinates with all that is above and below it, and balls.
template <int D>
class tile_region {
 public:
  struct ball {
    point_vector<double, D> center;
    double radius = 0;
  };

  /// The square of a tile with `margin` around it; without end where the survey has no points
  /// beyond.
  tile_region(const tile_info& tile, double edge, double margin, const extent<D>& survey) {
    const std::array<std::int64_t, 2> square{tile.x, tile.y};
    for (int d = 0; d < 2; ++d) {
      lower_[d] = double(square[d]) * edge - margin;
      upper_[d] = double(square[d] + 1) * edge + margin;
      if (lower_[d] <= survey.lower[d]) lower_[d] = -std::numeric_limits<double>::infinity();
      if (upper_[d] >= survey.upper[d]) upper_[d] = std::numeric_limits<double>::infinity();
    }
  }
  /// A rectangle from `lower` to `upper`.
  tile_region(const std::array<double, 2>& lower, const std::array<double, 2>& upper)
      : lower_{lower}, upper_{upper} {}

  void add(const ball& more) { balls_.push_back(more); }
  /// The balls alone.
  [[nodiscard]] tile_region balls() const {
    auto same = *this;
    same.lower_.fill(std::numeric_limits<double>::infinity());
    same.upper_.fill(-std::numeric_limits<double>::infinity());
    return same;
  }

  [[nodiscard]] bool is_everything() const {
    return std::isinf(lower_[0]) && std::isinf(lower_[1]) && std::isinf(upper_[0]) &&
           std::isinf(upper_[1]);
  }
  [[nodiscard]] bool contains(const point_vector<double, D>& place) const {
    bool is_in_column = true;
    for (int d = 0; d < 2; ++d)
      is_in_column = is_in_column && lower_[d] <= place[d] && place[d] <= upper_[d];
    return is_in_column || std::ranges::any_of(balls_, [&](const ball& b) {
             return (place - b.center).norm() <= b.radius;
           });
  }
  /// Whether all that is up to `margin` around a box is in its rectangle.
  [[nodiscard]] bool contains(const extent<D>& box, double margin) const {
    bool is_inside = true;
    for (int d = 0; d < 2; ++d)
      is_inside =
          is_inside && lower_[d] + margin <= box.lower[d] && box.upper[d] + margin <= upper_[d];
    return is_inside;
  }
  /// Whether a point of a box may be in it.
  [[nodiscard]] bool may_meet(const extent<D>& box) const {
    if (box.empty()) return false;
    bool meets_column = true;
    for (int d = 0; d < 2; ++d)
      meets_column = meets_column && lower_[d] <= box.upper[d] && box.lower[d] <= upper_[d];
    return meets_column || std::ranges::any_of(balls_, [&](const ball& b) {
             return distance_to(b.center, box) <= b.radius * (1 + 1e-12);
           });
  }
  /// A distance up to which all that is around a place is in it; negative for a place outside.
  [[nodiscard]] double margin_of(const point_vector<double, D>& place) const {
    double most = std::numeric_limits<double>::infinity();
    for (int d = 0; d < 2; ++d) most = std::min({most, place[d] - lower_[d], upper_[d] - place[d]});
    for (const ball& b : balls_) most = std::max(most, b.radius - (place - b.center).norm());
    return most;
  }

 private:
  static double distance_to(const point_vector<double, D>& place, const extent<D>& box) {
    point_vector<double, D> away;
    for (int d = 0; d < D; ++d)
      away[d] = std::max({box.lower[d] - place[d], place[d] - box.upper[d], 0.0});
    return away.norm();
  }

  std::array<double, 2> lower_{}, upper_{};
  std::vector<ball> balls_;
};

}  // namespace cilantro
