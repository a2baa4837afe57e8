// SPDX-License-Identifier: MIT
module;
#include <unordered_map>
module cilantro.tiles;

import cilantro.eigen;
import cilantro.clustering;
import :place_sample;
import :ranks;
import :survey;
import :tile_sums;

namespace cilantro {
namespace {

/// The points that are nearest to a centre.
template <int D>
struct center_sums {
  index_t count = 0;
  std::array<exact_sum, D> sums{};
  exact_sum inertia;
  /// The one farthest away, of equally far ones that with the least coordinates.
  double farthest = -1;
  std::array<double, D> farthest_place{};

  void add(const point_vector<double, D>& point, double square) {
    std::array<double, D> place;
    for (int d = 0; d < D; ++d) {
      place[d] = point[d];
      sums[d] += place[d];
    }
    ++count;
    inertia += square;
    keep_farthest(square, place);
  }
  center_sums& operator+=(const center_sums& other) {
    count += other.count;
    for (int d = 0; d < D; ++d) sums[d] += other.sums[d];
    inertia += other.inertia;
    keep_farthest(other.farthest, other.farthest_place);
    return *this;
  }

 private:
  void keep_farthest(double square, const std::array<double, D>& place) {
    if (std::tie(farthest, place) > std::tie(square, farthest_place)) return;
    farthest = square;
    farthest_place = place;
  }
};

template <Scalar S, int D>
class survey_kmeans {
 public:
  survey_kmeans(const tiled_cloud<S, D>& cloud, const kmeans_options& options)
      : options_{options},
        monitor_{in_passes(options.monitor, passes_of_limits(cloud) + 2 +
                                                std::min(options.max_iterations, 1 << 20))},
        cloud_{with_decided_steps(cloud, monitor_)} {}

  [[nodiscard]] point_matrix<S, D> starts(index_t k) const {
    expects(k >= 1, "kmeans: k must be at least 1");
    constexpr index_t most_centers = index_t{1} << 24;
    expects(k <= most_centers, "kmeans: k is too large");
    const auto sample =
        sample_places(cloud_, std::max<index_t>(10'000, 100 * k), options_.seed, monitor_);
    expects(sample.points >= k, "kmeans: there must be at least k points");
    auto of_sample = options_;
    of_sample.monitor = {{}, options_.monitor.stop};
    point_matrix<S, D> found;
    on_all_ranks(cloud_.ranks().get(), [&] {
      found =
          kmeans(sample.places, std::min(k, index_t(sample.places.cols())), of_sample).centroids;
    });
    return found;
  }

  [[nodiscard]] survey_kmeans_result<S, D> run(point_matrix<S, D> centers) const {
    survey_kmeans_result<S, D> result;
    const auto bytes = std::uint64_t(centers.cols()) * sizeof(center_sums<D>);
    expects(bytes <= cloud_.survey()->memory, "kmeans: what is summed up for all centres needs " +
                                                  std::to_string(bytes / 1'000'000) +
                                                  " MB, more than .memory of open_tiles");
    auto sums = measured(centers);
    index_t points = 0;
    for (const auto& sum : sums) points += sum.count;
    expects(points >= centers.cols(), "kmeans: there must be at least k points");
    while (true) {
      const auto next = moved(centers, sums);
      result.converged = double((next - centers).colwise().norm().maxCoeff()) <= options_.tolerance;
      if (result.converged || result.iterations == options_.max_iterations) break;
      centers = next;
      sums = measured(centers);
      ++result.iterations;
    }
    if (options_.monitor.progress) options_.monitor.progress(1);
    describe(centers, sums, result);
    return result;
  }

 private:
  using all_sums = std::vector<center_sums<D>>;

  [[nodiscard]] all_sums measured(const point_matrix<S, D>& centers) const {
    const survey_kmeans_result<S, D> nearest{centers, {}};
    const auto k = std::uint64_t(centers.cols());
    all_sums sums(centers.cols());
    std::mutex mutex;
    visit_points(
        cloud_,
        [&](index_t t) { return std::min(k, cloud_.tiles()[t].points) * sizeof(center_sums<D>); },
        monitor_,
        [&](point_cloud<S, D> points) {
          relate_to(cloud_.origin(), points);
          const auto labels = nearest.assign(points.points);
          // Of all centres, a tile meets few.
          std::unordered_map<clusters::label, center_sums<D>> found;
          for (index_t i = 0; i < points.size(); ++i) {
            if (labels[i] < 0) continue;
            const point_vector<double, D> point = points.points.col(i).template cast<double>();
            const point_vector<double, D> center = centers.col(labels[i]).template cast<double>();
            found[labels[i]].add(point, (point - center).squaredNorm());
          }
          const std::scoped_lock lock{mutex};
          for (const auto& [label, sum] : found) sums[label] += sum;
        });
    add_up_over_ranks(cloud_.ranks().get(), sums);
    return sums;
  }

  /// The means; centres without points go where points are farthest from theirs. One in each other
  /// cluster, so that some may have to wait.
  static point_matrix<S, D> moved(const point_matrix<S, D>& centers, const all_sums& sums) {
    std::vector<const center_sums<D>*> far;
    for (const auto& sum : sums)
      if (sum.farthest > 0) far.push_back(&sum);
    std::ranges::sort(far, [](const auto* a, const auto* b) {
      return std::tie(b->farthest, a->farthest_place) < std::tie(a->farthest, b->farthest_place);
    });
    auto next = centers;
    auto farthest = far.begin();
    for (index_t c = 0; c < centers.cols(); ++c) {
      const auto& sum = sums[c];
      const bool waits = sum.count == 0 && farthest == far.end();
      for (int d = 0; d < D && !waits; ++d)
        next(d, c) = static_cast<S>(sum.count > 0 ? sum.sums[d].value() / double(sum.count)
                                                  : (*farthest)->farthest_place[d]);
      if (sum.count == 0 && !waits) ++farthest;
    }
    return next;
  }

  static void describe(const point_matrix<S, D>& centers, const all_sums& sums,
                       survey_kmeans_result<S, D>& result) {
    const auto place = [&](index_t c) {
      std::array<S, D> all;
      for (int d = 0; d < D; ++d) all[d] = centers(d, c);
      return all;
    };
    std::vector<index_t> order(sums.size());
    std::iota(order.begin(), order.end(), index_t{0});
    std::erase_if(order, [&](index_t c) { return sums[c].count == 0; });
    std::ranges::sort(order, [&](index_t a, index_t b) {
      return std::tuple{-sums[a].count, place(a), a} < std::tuple{-sums[b].count, place(b), b};
    });
    result.centroids.resize(D, std::ssize(order));
    exact_sum inertia;
    for (index_t c = 0; c < std::ssize(order); ++c) {
      result.centroids.col(c) = centers.col(order[c]);
      result.sizes.push_back(sums[order[c]].count);
      inertia += sums[order[c]].inertia;
    }
    result.inertia = inertia.value();
  }

  const kmeans_options& options_;
  task_monitor monitor_;
  tiled_cloud<S, D> cloud_;
};

void expect_possible(const kmeans_options& options) {
  expect_from(0, options.max_iterations, "kmeans: max_iterations");
  expect_from(1, options.restarts, "kmeans: restarts");
  expect_from(0, options.tolerance, "kmeans: tolerance");
  expects(options.threads == 0, "kmeans: .threads of a survey are those of open_tiles");
}

}  // namespace

template <Scalar S, int D>
survey_kmeans_result<S, D> kmeans(const tiled_cloud<S, D>& cloud, index_t k,
                                  const kmeans_options& options) {
  expect_possible(options);
  const survey_kmeans<S, D> search{cloud, options};
  return search.run(search.starts(k));
}

template <Scalar S, int D>
survey_kmeans_result<S, D> kmeans(const tiled_cloud<S, D>& cloud,
                                  const std::type_identity_t<point_matrix<S, D>>& centroids,
                                  const kmeans_options& options) {
  expect_possible(options);
  expects(centroids.cols() >= 1, "kmeans: k must be at least 1");
  expects(centroids.allFinite(), "kmeans: centres must be finite");
  return survey_kmeans<S, D>{cloud, options}.run(centroids);
}

#define CILANTRO_INSTANTIATE(S, D)                                               \
  template survey_kmeans_result<S, D> kmeans(const tiled_cloud<S, D>&, index_t,  \
                                             const kmeans_options&);             \
  template survey_kmeans_result<S, D> kmeans<S, D>(                              \
      const tiled_cloud<S, D>&, const std::type_identity_t<point_matrix<S, D>>&, \
      const kmeans_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
