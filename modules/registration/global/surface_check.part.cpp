// SPDX-License-Identifier: MIT
//
// How well one surface lies on another under a transform, and what contradicts it.
module cilantro.registration:surface_check;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.search;
import :putative_pairs;

namespace cilantro {

/// How far a viewpoint has seen in each direction, by cells of one degree.
template <int D>
class seen_distances {
 public:
  /// Each point hides a disc of radius `reach` around it.
  seen_distances(const point_matrix<double, D>& points, const point_vector<double, D>& viewpoint,
                 double reach)
      : viewpoint_{viewpoint},
        distances_(static_cast<std::size_t>(columns * rows),
                   std::numeric_limits<float>::infinity()) {
    for (index_t i = 0; i < points.cols(); ++i) {
      const point_vector<double, D> away = points.col(i) - viewpoint_;
      const double distance = away.norm();
      if (!(distance > reach)) continue;
      const auto [column, row] = cell_of(away, distance);
      const double radius = std::asin(reach / distance) / cell;
      const index_t up = D == 2 ? 0 : static_cast<index_t>(radius);
      for (index_t r = std::max<index_t>(0, row - up); r <= std::min(rows - 1, row + up); ++r) {
        // Towards the poles, cells of the same angle are narrower.
        const double narrow =
            D == 2 ? 1 : std::max(0.05, std::cos((double(r) + 0.5) * cell - std::numbers::pi / 2));
        const auto side = static_cast<index_t>(std::min(radius / narrow, columns / 2.0));
        for (index_t c = column - side; c <= column + side; ++c) {
          auto& seen = distances_[r * columns + (c + columns) % columns];
          seen = std::min(seen, static_cast<float>(distance));
        }
      }
    }
  }

  /// How far away something was seen in the direction of a point; infinity if nothing was.
  [[nodiscard]] std::pair<double, double> along(const point_vector<double, D>& point) const {
    const point_vector<double, D> away = point - viewpoint_;
    const double distance = away.norm();
    if (!(distance > 0)) return {0, std::numeric_limits<double>::infinity()};
    const auto [column, row] = cell_of(away, distance);
    return {distance, double(distances_[row * columns + column])};
  }

 private:
  static constexpr index_t columns = 360, rows = D == 2 ? 1 : 180;
  static constexpr double cell = std::numbers::pi / 180;

  static std::pair<index_t, index_t> cell_of(const point_vector<double, D>& away, double distance) {
    const auto clamped = [](double angle, index_t count) {
      return std::clamp<index_t>(static_cast<index_t>(std::floor(angle / cell)), 0, count - 1);
    };
    const index_t column = clamped(std::atan2(away[1], away[0]) + std::numbers::pi, columns);
    if constexpr (D == 2)
      return {column, 0};
    else
      return {column,
              clamped(std::asin(std::clamp(away[2] / distance, -1.0, 1.0)) + std::numbers::pi / 2,
                      rows)};
  }

  point_vector<double, D> viewpoint_;
  std::vector<float> distances_;
};

/// A set as `align_globally` compares it: its voxels, in coordinates around `center`.
template <int D>
struct voxel_surface {
  point_matrix<double, D> points, normals;  ///< A normal is zero if it is unknown.
  point_vector<double, D> center = point_vector<double, D>::Zero();
  index_list first;      ///< A point of each voxel.
  index_list described;  ///< The voxels that have a feature.
  Eigen::MatrixXf features;
  std::optional<kd_tree<double, D>> tree;
  std::optional<seen_distances<D>> seen;  ///< If there is a viewpoint.
};

/// A transform is wrong if a larger share of what viewpoints should see contradicts it.
inline constexpr double most_contradicted = 0.03;

/// What a comparison of two surfaces has found.
struct surface_evidence {
  index_t compared = 0;  ///< Points of the source.
  index_t agreeing = 0;  ///< Those near a target point with about the same normal.
  index_t tight = 0;     ///< Of these, those in its tangent plane.
  index_t visible = 0, contradicted = 0;

  [[nodiscard]] double overlap() const {
    return compared > 0 ? double(agreeing) / double(compared) : 0;
  }
  [[nodiscard]] double contradicted_share() const {
    return visible > 0 ? double(contradicted) / double(visible) : 0;
  }
  /// The share of the source that lies on the target, less what contradicts it.
  [[nodiscard]] double score() const {
    const double kept = 1 - contradicted_share();
    return agreeing > 0 ? double(tight) / double(compared) * kept * kept : 0;
  }
};

template <int D>
class surface_check {
 public:
  surface_check(const voxel_surface<D>& source, const voxel_surface<D>& target, double voxel,
                bool oriented, int threads)
      : source_{source}, target_{target}, voxel_{voxel}, oriented_{oriented}, threads_{threads} {}

  /// Compares every `step`-th point.
  [[nodiscard]] surface_evidence compare(const pair_proposal<D>& proposal, index_t step) const {
    struct total : surface_evidence {
      total& operator+=(const total& other) {
        compared += other.compared;
        agreeing += other.agreeing;
        tight += other.tight;
        visible += other.visible;
        contradicted += other.contradicted;
        return *this;
      }
    };
    const index_t count = (source_.points.cols() + step - 1) / step;
    total all = ordered_sum(count, {.threads = threads_}, total{},
                            [&](total& sum, index_t k) { compare_point(proposal, k * step, sum); });
    if (source_.seen) {
      const Eigen::Matrix<double, D, D> back = proposal.rotation.transpose();
      for (index_t i = 0; i < target_.points.cols(); i += step)
        look(*source_.seen, back * (target_.points.col(i) - proposal.translation), all);
    }
    return all;
  }

 private:
  void compare_point(const pair_proposal<D>& proposal, index_t i, surface_evidence& sum) const {
    const point_vector<double, D> place =
        proposal.rotation * source_.points.col(i) + proposal.translation;
    ++sum.compared;
    if (target_.seen) look(*target_.seen, place, sum);
    const auto nearest = target_.tree->nearest_two(place, 2 * voxel_)[0];
    if (nearest.index < 0) return;
    const auto normal = target_.normals.col(nearest.index);
    const double cosine = (proposal.rotation * source_.normals.col(i)).dot(normal);
    if ((oriented_ ? cosine : std::abs(cosine)) < 0.8) return;
    ++sum.agreeing;
    const double off = (place - target_.points.col(nearest.index)).dot(normal);
    if (std::abs(off) < 0.4 * voxel_) ++sum.tight;
  }

  void look(const seen_distances<D>& seen, const point_vector<double, D>& place,
            surface_evidence& sum) const {
    const auto [distance, limit] = seen.along(place);
    if (!std::isfinite(limit)) return;
    ++sum.visible;
    if (distance < limit - 4 * voxel_) ++sum.contradicted;
  }

  const voxel_surface<D>&source_, &target_;
  double voxel_;
  bool oriented_;
  int threads_;
};

}  // namespace cilantro
