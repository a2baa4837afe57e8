// SPDX-License-Identifier: MIT
module;
#include "clustering/kernels/nearest_centers.hpp"
#include "core/closed_spaces.hpp"
module cilantro.clustering;

import :centroid_search;

namespace cilantro {
namespace {

using label = clusters::label;

/// One start of the iteration, which keeps for each point Hamerly's two bounds: on the distance to
/// its centre from above, and to any other centre from below.
template <Scalar S, int D, class M>
class kmeans_run {
 public:
  kmeans_run(points_view<S, D> points, const kmeans_options& options)
      : points_{points},
        how_{options.threads, {{}, options.monitor.stop}},
        largest_{largest_searchable_coordinate<S>(points.dimension())} {
    for (index_t i = 0; i < points.size(); ++i)
      if (is_searchable(at(i), points.dimension(), largest_))
        finite_.push_back(static_cast<std::int32_t>(i));
    labels_.resize(finite_.size(), clusters::none);
    upper_.resize(finite_.size());
    lower_.resize(finite_.size());
  }

  [[nodiscard]] index_t usable() const { return std::ssize(finite_); }

  void start_from(points_view<S, D> centroids) { centroids_ = centroids.matrix(); }
  void start_at_random(index_t k, random_stream random) {
    centroids_.resize(points_.dimension(), k);
    index_t c = 0;
    for (const index_t f : distinct_sample(usable(), k, random))
      centroids_.col(c++) = points_[finite_[f]];
  }
  void start_far_apart(index_t k, random_stream random);

  void run(const kmeans_options& options);

  [[nodiscard]] kmeans_result<S, D, M> result();

 private:
  [[nodiscard]] const S* at(index_t i) const { return points_.data() + i * points_.stride(); }
  [[nodiscard]] const S* usable_at(std::size_t f) const { return at(finite_[f]); }
  /// What a distance adds to the inertia.
  static double cost(S distance) { return double(M::sum(distance)); }

  bool assign();
  void update();
  void find_centers();
  void find_means();
  void find_medians();
  void fill_empty();

  points_view<S, D> points_;
  execution how_;
  S largest_;
  std::vector<std::int32_t> finite_;  ///< The points that count; what follows is of these.
  std::vector<label> labels_;
  std::vector<S> upper_, lower_;
  point_matrix<S, D> centroids_;
  std::vector<S> moved_;             ///< How far each centre has moved since the last assignment.
  std::vector<std::uint8_t> dirty_;  ///< The centres whose points have changed.
  std::vector<index_t> count_;       ///< The members of each centre.
  int iterations_ = 0;
  bool converged_ = false;
  index_t evaluations_ = 0;
};

template <Scalar S, int D, class M>
void kmeans_run<S, D, M>::start_far_apart(index_t k, random_stream random) {
  const index_t n = usable();
  constexpr index_t block_size = default_block_size;
  std::vector<double> cost_of(static_cast<std::size_t>(n), std::numeric_limits<double>::infinity());
  std::vector<double> in_block((n + block_size - 1) / block_size);
  centroids_.resize(points_.dimension(), k);
  index_t chosen = random.below(n);
  for (index_t c = 0;;) {
    centroids_.col(c++) = points_[finite_[chosen]];
    if (c == k) return;
    parallel_blocks(n, block_size, how_, [&](index_t b, index_t begin, index_t end) {
      double sum = 0;
      for (index_t f = begin; f < end; ++f) {
        auto& least = cost_of[f];
        least = std::min(least, double(metric_sum(M{}, at(finite_[f]), centroids_.col(c - 1).data(),
                                                  points_.dimension())));
        sum += least;
      }
      in_block[b] = sum;
    });
    double total = 0;
    for (const double sum : in_block) total += sum;
    if (!(total > 0)) {  // No other point is left.
      centroids_ = point_matrix<S, D>{centroids_.leftCols(c)};
      return;
    }
    double rest = random.uniform() * total;
    index_t block = 0;
    while (block + 1 < std::ssize(in_block) && rest >= in_block[block]) rest -= in_block[block++];
    // Rounding may leave a rest at the end: then the last point that can be drawn is.
    for (index_t f = block * block_size; f < n; ++f) {
      const double cost = cost_of[f];
      if (cost > 0) chosen = f;
      rest -= cost;
      if (rest < 0) break;
    }
  }
}

/// Puts every point to its nearest centre; whether one has changed.
template <Scalar S, int D, class M>
bool kmeans_run<S, D, M>::assign() {
  const centroid_search<S, D, M> search{as_points(centroids_)};
  const index_t k = centroids_.cols();
  std::vector<S> half(k);
  for (index_t c = 0; c < k; ++c) half[c] = search.find(centroids_.col(c).data()).second / 2;
  const S farthest_move = moved_.empty() ? S(0) : *std::ranges::max_element(moved_);
  // What all roundings of distances, and of bounds carried on from iteration to iteration, allow.
  const S slack = std::numeric_limits<S>::epsilon() *
                  S(32 + 2 * points_.dimension() + 4 * index_t{iterations_});
  const detail::moved_centers<S> centers{moved_.data(), half.data(), farthest_move, slack};

  std::vector<std::vector<label>> touched((usable() + default_block_size - 1) / default_block_size);
  std::vector<index_t> evaluations(touched.size());
  parallel_blocks(usable(), default_block_size, how_, [&](index_t b, index_t begin, index_t end) {
    const auto first = static_cast<std::size_t>(begin);
    const auto block = std::span{finite_}.subspan(first, static_cast<std::size_t>(end - begin));
    std::array<std::int32_t, default_block_size> room, some;
    std::span<const std::int32_t> doubtful;
    if (moved_.empty()) {
      std::iota(room.begin(), room.end(), 0);
      doubtful = std::span{room}.first(block.size());
    } else {
      doubtful = search.doubtful(points_, block, centers, labels_.data() + begin,
                                 upper_.data() + begin, lower_.data() + begin, room);
    }
    for (std::size_t k = 0; k < doubtful.size(); ++k) some[k] = block[doubtful[k]];
    std::vector<typename centroid_search<S, D, M>::result> found;
    search.find(points_, std::span{some}.first(doubtful.size()), found);
    evaluations[b] = std::ssize(doubtful);
    auto& changes = touched[b];
    for (std::size_t k = 0; k < doubtful.size(); ++k) {
      const auto f = first + static_cast<std::size_t>(doubtful[k]);
      const auto& [nearest, to_nearest, to_second] = found[k];
      upper_[f] = to_nearest;
      lower_[f] = to_second;
      label& own = labels_[f];
      if (nearest == own) continue;
      changes.push_back(own);
      changes.push_back(nearest);
      own = nearest;
    }
  });
  for (const index_t count : evaluations) evaluations_ += count;
  dirty_.assign(static_cast<std::size_t>(k), 0);
  for (const auto& changes : touched)
    for (const label c : changes)
      if (c >= 0) dirty_[c] = 1;
  return std::ranges::any_of(dirty_, [](auto is_dirty) { return is_dirty != 0; });
}

template <Scalar S, int D, class M>
void kmeans_run<S, D, M>::update() {
  const point_matrix<S, D> before = centroids_;
  find_centers();
  fill_empty();
  moved_.resize(centroids_.cols());
  for (index_t c = 0; c < centroids_.cols(); ++c)
    moved_[c] = M::distance(
        metric_sum(M{}, before.col(c).data(), centroids_.col(c).data(), centroids_.rows()));
}

/// Centres whose points have changed move to where they belong, by a function of these points and
/// of where the centre was.
template <Scalar S, int D, class M>
void kmeans_run<S, D, M>::find_centers() {
  if constexpr (std::same_as<M, manhattan>)
    find_medians();
  else
    find_means();
}

/// In blocks, since a sum must not depend on the number of threads, and few enough for all their
/// sums to be small beside the points. Relative to where the centre was, to keep digits far from
/// the origin.
template <Scalar S, int D, class M>
void kmeans_run<S, D, M>::find_means() {
  const index_t k = centroids_.cols(), dimension = centroids_.rows();
  const index_t block_size = std::max<index_t>(16 * default_block_size, 8 * k);
  const index_t blocks = (usable() + block_size - 1) / block_size;
  std::vector<point_matrix<double, D>> sums(blocks);
  std::vector<std::vector<index_t>> counts(sums.size());
  const point_matrix<double, D> base = centroids_.template cast<double>();
  parallel_blocks(usable(), block_size, how_, [&](index_t b, index_t begin, index_t end) {
    auto& sum = sums[b];
    auto& count = counts[b];
    sum.setZero(dimension, k);
    count.resize(k);
    // Neighbours in memory are often of one centre, whose sum then stays in registers.
    for (auto f = static_cast<std::size_t>(begin); f < static_cast<std::size_t>(end);) {
      const label own = labels_[f];
      const auto start = f;
      if (dirty_[own]) {
        point_vector<double, D> part = point_vector<double, D>::Zero(dimension);
        const point_vector<double, D> from = base.col(own);
        for (; f < static_cast<std::size_t>(end) && labels_[f] == own; ++f)
          part += points_[finite_[f]].template cast<double>() - from;
        sum.col(own) += part;
      } else {
        while (f < static_cast<std::size_t>(end) && labels_[f] == own) ++f;
      }
      count[own] += static_cast<index_t>(f - start);
    }
  });
  count_.assign(static_cast<std::size_t>(k), 0);
  point_matrix<double, D> total = point_matrix<double, D>::Zero(dimension, k);
  for (std::size_t b = 0; b < sums.size(); ++b) {
    total += sums[b];
    for (std::size_t c = 0; c < count_.size(); ++c) count_[c] += counts[b][c];
  }
  for (index_t c = 0; c < k; ++c)
    if (const auto at = static_cast<std::size_t>(c); dirty_[at] && count_[at] > 0)
      centroids_.col(c) = (base.col(c) + total.col(c) / double(count_[at])).template cast<S>();
}

template <Scalar S, int D, class M>
void kmeans_run<S, D, M>::find_medians() {
  std::vector<index_t> offsets(static_cast<std::size_t>(centroids_.cols()) + 1);
  for (const label own : labels_) ++offsets[static_cast<std::size_t>(own) + 1];
  count_.assign(offsets.begin() + 1, offsets.end());
  for (std::size_t c = 1; c < offsets.size(); ++c) offsets[c] += offsets[c - 1];
  std::vector<std::int32_t> members(finite_.size());
  std::vector<index_t> next(offsets.begin(), offsets.end() - 1);
  for (std::size_t f = 0; f < finite_.size(); ++f) members[next[labels_[f]]++] = finite_[f];
  parallel_blocks(centroids_.cols(), 1, how_, [&](index_t c, index_t, index_t) {
    const auto own = static_cast<std::size_t>(c);
    if (!dirty_[own] || count_[own] == 0) return;
    std::vector<S> values;
    for (index_t d = 0; d < centroids_.rows(); ++d) {
      values.clear();
      for (index_t m = offsets[own]; m < offsets[own + 1]; ++m) values.push_back(at(members[m])[d]);
      const auto middle = values.begin() + (std::ssize(values) - 1) / 2;
      std::ranges::nth_element(values, middle);
      centroids_(d, c) = *middle;
    }
  });
}

template <Scalar S, int D, class M>
void kmeans_run<S, D, M>::fill_empty() {
  if (std::ranges::find(count_, 0) == count_.end()) return;
  std::vector<neighbor<S>> far(finite_.size());  // The index is a place in the list.
  const centroid_search<S, D, M> search{as_points(centroids_)};
  parallel_for(usable(), how_, [&](index_t f) {
    const auto at = static_cast<std::size_t>(f);
    far[at] = {f, search.distance(usable_at(at), labels_[at])};
  });
  std::ranges::sort(far, [](const auto& a, const auto& b) {
    return std::pair{-a.distance, a.index} < std::pair{-b.distance, b.index};
  });
  auto next = far.begin();
  for (std::size_t c = 0; c < count_.size(); ++c) {
    if (count_[c] > 0) continue;
    const auto donor = [&](const auto& one) {
      return static_cast<std::size_t>(labels_[one.index]);
    };
    while (next != far.end() && count_[donor(*next)] < 2) ++next;
    if (next == far.end() || !(next->distance > 0)) break;
    --count_[donor(*next)];
    dirty_[donor(*next)] = dirty_[c] = 1;
    ++count_[c];
    const auto f = static_cast<std::size_t>(next++->index);
    labels_[f] = static_cast<label>(c);
    lower_[f] = upper_[f] = 0;
    centroids_.col(static_cast<index_t>(c)) = points_[finite_[f]];
  }
  // Those that have given a point away have another centre now.
  find_centers();
}

template <Scalar S, int D, class M>
void kmeans_run<S, D, M>::run(const kmeans_options& options) {
  while (assign()) {
    if (iterations_ == options.max_iterations) return;
    ++iterations_;
    update();
    if (options.tolerance > 0 && double(*std::ranges::max_element(moved_)) <= options.tolerance) {
      assign();
      break;
    }
  }
  converged_ = true;
}

template <Scalar S, int D, class M>
kmeans_result<S, D, M> kmeans_run<S, D, M>::result() {
  const centroid_search<S, D, M> search{as_points(centroids_)};
  const double inertia = ordered_sum(usable(), how_, 0.0, [&](double& sum, index_t f) {
    const auto at = static_cast<std::size_t>(f);
    sum += cost(search.distance(usable_at(at), labels_[at]));
  });
  std::vector<label> labels(static_cast<std::size_t>(points_.size()), clusters::none);
  for (std::size_t f = 0; f < finite_.size(); ++f) labels[finite_[f]] = labels_[f];
  kmeans_result<S, D, M> found{clusters{labels}, {},         inertia,
                               iterations_,      converged_, evaluations_};
  found.centroids.resize(centroids_.rows(), found.size());
  for (index_t c = 0; c < found.size(); ++c)
    found.centroids.col(c) = centroids_.col(labels[found[c].front()]);
  return found;
}

}  // namespace

template <Scalar S, int D, CoordinateMetric<S> M>
kmeans_result<S, D, M> closed_kmeans(points_view<S, D> points, index_t k, points_view<S, D> initial,
                                     const kmeans_options& options) {
  expect_from(1, double(k), "kmeans: the number of clusters");
  expect_from(1, options.restarts, "kmeans: restarts");
  expect_from(0, options.max_iterations, "kmeans: max_iterations");
  expect_from(0, options.tolerance, "kmeans: tolerance");
  const bool given = !initial.empty();
  expects(!given || (initial.dimension() == points.dimension() && initial.matrix().allFinite()),
          "kmeans: the centroids must be finite, and of the points' dimension");
  std::optional<kmeans_result<S, D, M>> best;
  index_t evaluations = 0;
  const int starts = given ? 1 : options.restarts;
  for (int start = 0; start < starts; ++start) {
    kmeans_run<S, D, M> run{points, options};
    expects(k <= run.usable(), "kmeans: there must be at least as many finite points as clusters");
    const random_stream random{options.seed, static_cast<std::uint64_t>(start)};
    if (given)
      run.start_from(initial);
    else if (options.start == kmeans_start::plus_plus)
      run.start_far_apart(k, random);
    else
      run.start_at_random(k, random);
    run.run(options);
    auto found = run.result();
    evaluations += found.evaluations;
    if (!best || found.inertia < best->inertia) best = std::move(found);
    if (options.monitor.progress) options.monitor.progress(double(start + 1) / double(starts));
  }
  best->evaluations = evaluations;
  return *std::move(best);
}

template <Scalar S, int D, CoordinateMetric<S> M>
std::vector<label> closed_nearest(points_view<S, D> centroids, points_view<S, D> points,
                                  const execution& how) {
  expects(points.empty() || centroids.empty() || centroids.dimension() == points.dimension(),
          "assign: points and centroids must have the same dimension");
  std::vector<label> labels(static_cast<std::size_t>(points.size()), clusters::none);
  if (centroids.empty()) return labels;
  const centroid_search<S, D, M> search{centroids};
  const S largest = largest_searchable_coordinate<S>(points.dimension());
  parallel_for(points.size(), how, [&](index_t i) {
    const S* point = points.data() + i * points.stride();
    if (is_searchable(point, points.dimension(), largest)) labels[i] = search.find(point).nearest;
  });
  return labels;
}

#define CILANTRO_INSTANTIATE_FOR(S, D, M)                                                      \
  template kmeans_result<S, D, M> closed_kmeans(points_view<S, D>, index_t, points_view<S, D>, \
                                                const kmeans_options&);                        \
  template std::vector<label> closed_nearest<S, D, M>(points_view<S, D>, points_view<S, D>,    \
                                                      const execution&);
#define CILANTRO_INSTANTIATE(S, D)          \
  CILANTRO_INSTANTIATE_FOR(S, D, euclidean) \
  CILANTRO_INSTANTIATE_FOR(S, D, manhattan)
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE
#undef CILANTRO_INSTANTIATE_FOR

}  // namespace cilantro
