// SPDX-License-Identifier: MIT
export module cilantro.geometry:contract;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :accumulate;
import :covariance;
import :moments;

namespace cilantro {

/// Tests a covariance estimator of yours on `points`: that it gives the same result when called
/// twice, that its covariance is symmetric and has no negative variance, that its mean lies within
/// the bounding box of the points, and that a point that is not finite changes nothing. Returns a
/// sentence for each rule that is broken. Give at least a few dozen finite points.
export template <PointsSource P, CovarianceEstimator<scalar_of<P>, dimension_of<P>> E>
[[nodiscard]] std::vector<std::string> check_covariance_estimator(const E& estimate,
                                                                  const P& points) {
  using S = scalar_of<P>;
  constexpr int D = dimension_of<P>;
  using result = std::optional<moments<S, D>>;
  std::vector<std::string> violations;
  const auto expect = [&](bool condition, const char* rule) {
    if (!condition) violations.emplace_back(rule);
  };
  const auto view = points_in(points);
  std::vector<std::int32_t> finite;
  for (index_t i = 0; i < view.size(); ++i)
    if (is_finite(view[i])) finite.push_back(static_cast<std::int32_t>(i));
  const std::span<const std::int32_t> all{finite};
  const result found = estimate(view, all), again = estimate(view, all);
  expect(found.has_value() == again.has_value(),
         "two calls with the same arguments give different results");
  expect(!result{estimate(view, all.first(0))} || finite.empty(),
         "it returns a result for no points");
  if (!found || !again) return violations;
  expect(found->mean == again->mean && found->covariance == again->covariance,
         "two calls with the same arguments give different results");
  expect(found->count > 0 && found->count <= std::ssize(finite),
         "it counts more points than there are");
  expect(found->covariance == found->covariance.transpose(), "the covariance is not symmetric");
  expect((found->covariance.diagonal().array() >= 0).all(), "a variance is negative");
  for (index_t d = 0; d < view.dimension(); ++d) {
    S low = std::numeric_limits<S>::infinity(), high = -low;
    for (const auto i : finite) {
      low = std::min(low, view[i][d]);
      high = std::max(high, view[i][d]);
    }
    expect(found->mean[d] >= low && found->mean[d] <= high,
           "the mean is outside the bounding box of the points");
  }

  // The same with a point of NaN at the end.
  point_matrix<S, D> spoilt(view.dimension(), view.size() + 1);
  spoilt.leftCols(view.size()) = view.matrix();
  spoilt.rightCols(1).setConstant(std::numeric_limits<S>::quiet_NaN());
  finite.push_back(static_cast<std::int32_t>(view.size()));
  const result with_nan = estimate(as_points(spoilt), std::span<const std::int32_t>{finite});
  expect(with_nan && with_nan->covariance == found->covariance && with_nan->mean == found->mean,
         "a point that is not finite changes the result");
  return violations;
}

/// Tests a grid accumulator of yours: that gathering points 0 to `count` − 1 gives the same
/// `result(accumulator)` if they are added one after another, added in two parts that are merged,
/// or added to a copy that was made halfway. Returns a sentence for each rule that is broken.
export template <GridAccumulator A, class F>
  requires std::invocable<const F&, const A&>
[[nodiscard]] std::vector<std::string> check_grid_accumulator(const A& empty, index_t count,
                                                              const F& result) {
  std::vector<std::string> violations;
  A at_once = empty;
  for (index_t i = 0; i < count; ++i) at_once.add(i);
  for (const index_t cut : {index_t{0}, index_t{1}, count / 2, count}) {
    A first = empty, second = empty;
    for (index_t i = 0; i < count; ++i) (i < cut ? first : second).add(i);
    const A copy = first;
    first.merge(second);
    if (!(result(first) == result(at_once)))
      violations.push_back("gathering in parts of " + std::to_string(cut) + " and " +
                           std::to_string(count - cut) + " gives another result than at once");
    A resumed = copy;
    for (index_t i = cut; i < count; ++i) resumed.add(i);
    if (!(result(resumed) == result(at_once)))
      violations.emplace_back("a copy does not continue where the original was");
  }
  return violations;
}

}  // namespace cilantro
