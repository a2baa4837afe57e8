// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

void expect_sample(index_t size, index_t count) {
  expects(size >= 0 && size <= std::numeric_limits<std::int32_t>::max(),
          "sample: there must be between 0 and 2^31 - 1 points");
  expect_from(0, double(count), "sample: the count");
}

/// The farthest point so far; the first of several.
struct farthest {
  double distance = -1;
  index_t index = -1;
  farthest& operator+=(const farthest& other) {
    if (other.distance > distance) *this = other;
    return *this;
  }
};

}  // namespace

index_list random_indices(index_t size, index_t count, std::uint64_t seed) {
  expect_sample(size, count);
  return distinct_sample(size, std::min(count, size), random_stream{seed});
}

index_list uniform_indices(index_t size, index_t count) {
  expect_sample(size, count);
  count = std::min(count, size);
  index_list sample;
  for (index_t i = 0; i < count; ++i) sample.push_back(static_cast<std::int32_t>(i * size / count));
  return sample;
}

template <Scalar S, int D>
index_list closed_farthest_points(points_view<S, D> points, index_t count,
                                  const farthest_point_options& options) {
  const index_t n = points.size();
  expect_sample(n, count);
  expects(n == 0 || (0 <= options.first && options.first < n),
          "farthest_point_sample: the first point is not one of the points");
  index_list sample;
  // How far each point is from those chosen: −1 once it is one of them, or if it can never be.
  std::vector<double> distance(static_cast<std::size_t>(n),
                               std::numeric_limits<double>::infinity());
  index_t available = 0;
  for (index_t i = 0; i < n; ++i) {
    if (is_finite(points[i]))
      ++available;
    else
      distance[i] = -1;
  }
  count = std::min(count, available);
  if (count == 0) return sample;
  index_t next = options.first;
  while (distance[next] < 0) next = (next + 1) % n;

  const execution how{options.threads, {{}, options.monitor.stop}};
  for (;;) {
    sample.push_back(static_cast<std::int32_t>(next));
    distance[next] = -1;
    if (options.monitor.progress) options.monitor.progress(double(sample.size()) / double(count));
    if (std::ssize(sample) == count) return sample;
    const point_vector<double, D> chosen = points[next].template cast<double>();
    next = ordered_sum(n, how, farthest{}, [&](farthest& far, index_t i) {
             double& d = distance[i];
             if (d < 0) return;
             d = std::min(d, (points[i].template cast<double>() - chosen).squaredNorm());
             if (d > far.distance) far = {d, i};
           }).index;
  }
}

#define CILANTRO_INSTANTIATE(S, D)                                             \
  template index_list closed_farthest_points<S, D>(points_view<S, D>, index_t, \
                                                   const farthest_point_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
