// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import cilantro.consensus;
import cilantro.search;
import :exact_moments;
import :place_sample;
import :ranks;
import :survey;
import :tile_sums;

namespace cilantro {
namespace {

constexpr index_t places_looked_at = 50'000;
constexpr index_t planes_compared = 8;
/// The most fits of a plane to its inliers, one after another, as in memory.
constexpr int most_fits = 10;

/// Planes through a place and those that are nearest to it, which the planes of a survey, such as
/// roofs, have to themselves: of points anywhere, a plane with a share p of all has p^D of the
/// samples, and here p.
template <int D>
class local_planes : public hyperplane_family<double, D> {
 public:
  explicit local_planes(const point_matrix<double, D>& places)
      : hyperplane_family<double, D>{places}, places_{places} {
    if (places.cols() > 0) tree_.emplace(places);
  }

  [[nodiscard]] index_t sample_size() const { return 1; }
  [[nodiscard]] std::optional<hyperplane_model<D>> fit(
      std::span<const std::int32_t> indices) const {
    if (indices.size() != 1) return hyperplane_family<double, D>::fit(indices);
    index_list nearest;
    for (const auto& near : tree_->find(places_.col(indices[0]), knn{places_of_a_sample}))
      nearest.push_back(near.index);
    return hyperplane_family<double, D>::fit(nearest);
  }

 private:
  /// So many that a plane is not tilted much by noise, and few others are among them.
  static constexpr index_t places_of_a_sample = 10;

  const point_matrix<double, D>& places_;
  std::optional<kd_tree<double, D>> tree_;
};

/// The points that agree with a plane.
template <int D>
struct plane_sums {
  moment_sums<D> inliers;
  exact_sum squares;  ///< Of their distances.

  plane_sums& operator+=(const plane_sums& other) {
    inliers += other.inliers;
    squares += other.squares;
    return *this;
  }
  [[nodiscard]] double score(const ransac_options& options) const {
    const double n = double(inliers.count), limit = options.max_residual;
    return options.score == ransac_score::inliers ? n : n - squares.value() / (limit * limit);
  }
};

/// The plane through the mean across the direction of least variance, unless there are several.
template <int D>
std::optional<hyperplane_model<D>> plane_of(const moment_sums<D>& points) {
  if (points.count < D) return std::nullopt;
  const auto axes = decompose_symmetric<D>(points.covariance());
  constexpr double negligible = 16 * std::numeric_limits<double>::epsilon();
  if (!(axes.values[1] > negligible * axes.values[D - 1])) return std::nullopt;
  Eigen::Matrix<double, D, 1> normal = axes.vectors.col(0);
  index_t largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  if (normal[largest] < 0) normal = -normal;
  return hyperplane_model<D>{normal, -normal.dot(points.mean())};
}

/// Adds a point to the sums of the planes that it agrees with.
template <int D>
void add_to(std::vector<plane_sums<D>>& sums, const point_vector<double, D>& point,
            const std::vector<hyperplane_model<D>>& planes, double max_residual) {
  for (std::size_t p = 0; p < planes.size(); ++p) {
    const double distance = std::abs(planes[p].signed_distance(point));
    if (!(distance <= max_residual)) continue;
    sums[p].inliers.add(point);
    sums[p].squares.add_product(distance, distance);
  }
}

template <Scalar S, int D>
std::vector<plane_sums<D>> measured(const tiled_cloud<S, D>& cloud,
                                    const std::vector<hyperplane_model<D>>& planes,
                                    double max_residual, const task_monitor& monitor) {
  const auto visit = [&](point_cloud<S, D> points, std::vector<plane_sums<D>>& sums) {
    relate_to(cloud.origin(), points);
    for (index_t i = 0; i < points.size(); ++i)
      add_to<D>(sums, points.points.col(i).template cast<double>(), planes, max_residual);
  };
  return sum_over_tiles(cloud, std::vector<plane_sums<D>>(planes.size()), monitor, visit);
}

}  // namespace

template <Scalar S, int D>
std::optional<survey_plane<D>> ransac_hyperplane(const tiled_cloud<S, D>& cloud,
                                                 const ransac_options& options) {
  expects(options.threads == 0, "ransac_hyperplane: .threads of a survey are those of open_tiles");
  // The sample, all planes, and the fits.
  const auto monitor =
      in_passes(options.monitor, passes_of_limits(cloud) + 2 + (options.refit ? most_fits : 0));
  auto of_sample = options;
  of_sample.monitor = {{}, options.monitor.stop};
  // Before any pass: options that make no sense are told at once.
  const Eigen::Matrix<double, D, 1> nothing = Eigen::Matrix<double, D, 1>::Zero();
  (void)ransac(hyperplane_family{nothing}, of_sample);
  of_sample.min_inliers = 0;

  const auto from = with_decided_steps(cloud, monitor);
  const auto sample = sample_places(from, places_looked_at, options.seed, monitor);
  const point_matrix<double, D> places = sample.places.template cast<double>();
  decltype(sequential_ransac(hyperplane_family{places}, planes_compared, of_sample)) found;
  on_all_ranks(from.ranks().get(), [&] {
    found = sequential_ransac(hyperplane_family{places}, planes_compared, of_sample);
    for (auto& plane : sequential_ransac(local_planes<D>{places}, planes_compared, of_sample))
      found.push_back(std::move(plane));
  });
  const auto end_with = [&](std::optional<survey_plane<D>> result) {
    if (options.monitor.progress) options.monitor.progress(1);
    return result;
  };
  if (found.empty()) return end_with(std::nullopt);

  std::vector<hyperplane_model<D>> planes;
  for (const auto& one : found) planes.push_back(one.model);
  const auto all = measured(from, planes, options.max_residual, monitor);
  const auto best = std::ranges::max_element(
                        all, {}, [&](const plane_sums<D>& sums) { return sums.score(options); }) -
                    all.begin();
  auto model = planes[best];
  auto sums = all[best];
  const index_t least = std::max<index_t>(options.min_inliers, D);
  for (int k = 0; options.refit && k < most_fits; ++k) {
    const auto fitted = plane_of(sums.inliers);
    if (!fitted) break;
    const auto others = measured(from, {*fitted}, options.max_residual, monitor).front();
    if (others.inliers.count < std::min(least, sums.inliers.count)) break;
    const bool is_settled = others.inliers == sums.inliers;
    model = *fitted;
    sums = others;
    if (is_settled) break;
  }
  const index_t count = sums.inliers.count;
  if (count < least) return end_with(std::nullopt);
  return end_with(survey_plane<D>{model, count, sums.score(options),
                                  std::sqrt(sums.squares.value() / double(count)),
                                  found[best].iterations});
}

#define CILANTRO_INSTANTIATE(S, D)                                                    \
  template std::optional<survey_plane<D>> ransac_hyperplane(const tiled_cloud<S, D>&, \
                                                            const ransac_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
