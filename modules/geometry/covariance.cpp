// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

/// A subset's mean, and its covariance by axes. Axes without extent count as if they had next to
/// none, so that distances and determinants of degenerate subsets can still be compared.
template <int D>
struct ellipsoid {
  using vector = point_vector<double, D>;
  using matrix = Eigen::Matrix<double, D, D>;

  index_t count = 0;
  vector mean;
  matrix covariance, whitening;  ///< Rows of the latter: axes over standard deviations.
  double log_determinant = std::numeric_limits<double>::infinity();

  void measure() {
    const auto axes = decompose_symmetric<D>(covariance);
    const double largest = std::max(axes.values.maxCoeff(), 0.0);
    const double least = std::max(1e-14 * largest, std::numeric_limits<double>::min());
    const vector extents = axes.values.cwiseMax(least);
    log_determinant = extents.array().log().sum();
    whitening = extents.cwiseSqrt().cwiseInverse().asDiagonal() * axes.vectors.transpose();
  }
};

template <int D>
class minimum_determinant {
 public:
  using vector = point_vector<double, D>;
  using matrix = Eigen::Matrix<double, D, D>;
  using points_type = point_matrix<double, D>;
  using fit = ellipsoid<D>;

  minimum_determinant(const points_type& points, const minimum_covariance_determinant& how,
                      std::uint64_t stream)
      : points_{points}, how_{how}, stream_{stream} {}

  [[nodiscard]] fit find() {
    const index_t n = points_.cols();
    std::vector<std::int32_t> all(n);
    std::iota(all.begin(), all.end(), 0);
    const index_t h = kept_of(n);
    if (h == n || n <= points_.rows() + 1) return of(all);
    std::vector<fit> best = n <= most_direct ? search(all, how_.trials, 0) : nested_search(all);
    for (fit& f : best) f = converged(std::move(f), all);
    fit found = *std::ranges::min_element(best, {}, &fit::log_determinant);
    return scaled(std::move(found), n);
  }

  /// The sample covariance of the points within a squared distance of `f`.
  [[nodiscard]] fit within(const fit& f, double limit) const {
    std::vector<std::int32_t> kept;
    for (index_t i = 0; i < points_.cols(); ++i)
      if (squared_distance(f, i) <= limit) kept.push_back(static_cast<std::int32_t>(i));
    return of(kept);
  }

 private:
  // From the paper: where nesting begins, its subsets, what is merged, and how many fits go on.
  static constexpr index_t most_direct = 600, subset_size = 300, most_merged = 1500;
  static constexpr std::size_t survivors = 10;

  [[nodiscard]] index_t kept_of(index_t n) const {
    const auto wanted = static_cast<index_t>(std::ceil(how_.share * double(n)));
    return std::clamp(wanted, std::min(n, (n + points_.rows() + 1) / 2), n);
  }

  [[nodiscard]] double squared_distance(const fit& f, index_t i) const {
    return (f.whitening * (points_.col(i) - f.mean)).squaredNorm();
  }

  [[nodiscard]] fit of(std::span<const std::int32_t> subset) const {
    fit f{std::ssize(subset),
          vector::Zero(points_.rows()),
          matrix::Zero(points_.rows(), points_.rows()),
          {}};
    if (subset.empty()) return f;
    for (const auto i : subset) f.mean += points_.col(i);
    f.mean /= double(f.count);
    for (const auto i : subset) {
      const vector difference = points_.col(i) - f.mean;
      f.covariance.noalias() += difference * difference.transpose();
    }
    if (f.count > 1) f.covariance /= double(f.count - 1);
    f.measure();
    return f;
  }

  /// The points of `among` that are nearest to `f`, and their fit: never a larger determinant.
  [[nodiscard]] fit concentrated(const fit& f, std::span<const std::int32_t> among) {
    distances_.resize(among.size());
    for (std::size_t i = 0; i < among.size(); ++i)
      distances_[i] = {squared_distance(f, among[i]), among[i]};
    const auto last = distances_.begin() + (kept_of(std::ssize(among)) - 1);
    std::ranges::nth_element(distances_, last);
    const auto farthest = *last;
    nearest_.clear();
    // In the order of the points, which is the same whatever the selection has done.
    for (const auto i : among)
      if (std::pair{squared_distance(f, i), i} <= farthest) nearest_.push_back(i);
    return of(nearest_);
  }

  [[nodiscard]] fit converged(fit f, std::span<const std::int32_t> among) {
    for (int step = 0; step < 100; ++step) {
      fit next = concentrated(f, among);
      const bool settled = step > 0 && !(next.log_determinant < f.log_determinant - 1e-12);
      f = std::move(next);
      if (settled) break;
    }
    return f;
  }

  /// Sorted by determinant, and no more than survive.
  static void keep_best(std::vector<fit>& fits) {
    // By position where determinants are equal, as those of exact fits are.
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < fits.size(); ++i) order.emplace_back(fits[i].log_determinant, i);
    std::ranges::sort(order);
    if (order.size() > survivors) order.resize(survivors);
    std::vector<fit> best;
    for (const auto& [determinant, i] : order) best.push_back(std::move(fits[i]));
    fits = std::move(best);
  }

  [[nodiscard]] std::vector<fit> search(std::span<const std::int32_t> among, int trials,
                                        std::uint64_t first) {
    const index_t n = std::ssize(among);
    std::vector<fit> fits;
    std::vector<std::int32_t> subset;
    for (int t = 0; t < trials; ++t) {
      subset.clear();
      const auto chosen = distinct_sample(n, std::min(n, points_.rows() + 1), random(first + t));
      for (const index_t i : chosen) subset.push_back(among[i]);
      fit f = concentrated(of(subset), among);
      fits.push_back(concentrated(f, among));
    }
    keep_best(fits);
    return fits;
  }

  [[nodiscard]] std::vector<fit> nested_search(std::span<const std::int32_t> all) {
    const index_t n = std::ssize(all), merged_size = std::min(n, most_merged);
    std::vector<std::int32_t> merged;
    for (const index_t i : distinct_sample(n, merged_size, random(~std::uint64_t{0})))
      merged.push_back(all[i]);
    shuffle(merged, random(~std::uint64_t{1}));
    const index_t subsets = merged_size / subset_size;
    const int trials = std::max(1, how_.trials / static_cast<int>(subsets));
    std::vector<fit> fits;
    for (index_t s = 0; s < subsets; ++s) {
      const auto begin = static_cast<std::size_t>(s * merged_size / subsets);
      const auto end = static_cast<std::size_t>((s + 1) * merged_size / subsets);
      for (fit& f : search(std::span{merged}.subspan(begin, end - begin), trials,
                           static_cast<std::uint64_t>(s * trials)))
        fits.push_back(std::move(f));
    }
    for (fit& f : fits) f = concentrated(concentrated(f, merged), merged);
    keep_best(fits);
    if (n > 20 * most_merged) fits.resize(1);
    return fits;
  }

  /// Makes up for the points that were left out of the covariance of a normal distribution.
  [[nodiscard]] fit scaled(fit f, index_t n) const {
    const double share = double(f.count) / double(n);
    if (!(share < 1)) return f;
    const index_t d = points_.rows();
    f.covariance *= share / chi_square_probability(chi_square_quantile(share, d), d + 2);
    f.measure();
    return f;
  }

  [[nodiscard]] random_stream random(std::uint64_t trial) const {
    return random_stream{how_.seed ^ (stream_ * 0x9e3779b97f4a7c15u), trial};
  }

  const points_type& points_;
  const minimum_covariance_determinant& how_;
  std::uint64_t stream_;
  std::vector<std::pair<double, std::int32_t>> distances_;
  std::vector<std::int32_t> nearest_;
};

}  // namespace

index_list all_indices(index_t size) {
  expects(size <= std::numeric_limits<std::int32_t>::max(),
          "mean_and_covariance: at most 2^31 - 1 points can be indexed");
  std::vector<std::int32_t> all(size);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

template <Scalar S, int D>
Eigen::VectorX<S> closed_mahalanobis(points_view<S, D> points, const moments<S, D>& of) {
  const index_t dimension = points.dimension();
  expects(points.empty() || of.mean.size() == dimension,
          "mahalanobis_distances: points and moments must have the same dimension");
  Eigen::VectorX<S> distances(points.size());
  if (points.empty()) return distances;
  const auto [extents, axes, converged] = decompose_symmetric<D>(of.covariance);
  const double none = double(dimension) * double(std::numeric_limits<S>::epsilon()) *
                      std::max(extents.maxCoeff(), 0.0);
  const point_vector<double, D> mean = of.mean.template cast<double>();
  for (index_t i = 0; i < points.size(); ++i) {
    const point_vector<double, D> difference = points[i].template cast<double>() - mean;
    const point_vector<double, D> along = axes.transpose() * difference;
    const double rounding = double(std::numeric_limits<S>::epsilon()) *
                            (points[i].cwiseAbs().maxCoeff() + difference.norm());
    double sum = 0;
    for (index_t d = 0; d < dimension; ++d) {
      if (extents[d] > none)
        sum += along[d] * along[d] / extents[d];
      else if (!(std::abs(along[d]) <= rounding))
        sum = std::isnan(along[d]) ? along[d] : std::numeric_limits<double>::infinity();
    }
    distances[i] = static_cast<S>(std::sqrt(sum));
  }
  return distances;
}

template <Scalar S, int D>
std::optional<moments<S, D>> closed_minimum_determinant(points_view<S, D> points,
                                                        std::span<const std::int32_t> indices,
                                                        const minimum_covariance_determinant& how) {
  expect_between(0.5, how.share, 1, "minimum_covariance_determinant: share");
  expect_from(1, double(how.trials), "minimum_covariance_determinant: trials");
  expects(!how.rejection || *how.rejection > 0,
          "minimum_covariance_determinant: the rejection must be positive");
  std::vector<std::int32_t> finite;
  for (const auto i : indices)
    if (is_finite(points[i])) finite.push_back(i);
  if (finite.empty()) return std::nullopt;
  // Around one of the points, so that those far from the origin lose nothing.
  const point_vector<double, D> origin = points[finite.front()].template cast<double>();
  point_matrix<double, D> centered(points.dimension(), std::ssize(finite));
  for (index_t i = 0; i < centered.cols(); ++i)
    centered.col(i) = points[finite[i]].template cast<double>() - origin;

  minimum_determinant<D> solver{centered, how, static_cast<std::uint64_t>(finite.front())};
  auto found = solver.find();
  if (how.rejection) {
    auto all = solver.within(found, *how.rejection);
    if (all.count > 0) found = std::move(all);
  }
  return moments<S, D>{found.count, (origin + found.mean).template cast<S>(), found.covariance};
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template Eigen::VectorX<S> closed_mahalanobis<S, D>(points_view<S, D>, const moments<S, D>&); \
  template std::optional<moments<S, D>> closed_minimum_determinant<S, D>(                       \
      points_view<S, D>, std::span<const std::int32_t>, const minimum_covariance_determinant&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
