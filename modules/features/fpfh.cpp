// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
#include "features/kernels/pair_features.hpp"
module cilantro.features;

import cilantro.eigen;

namespace cilantro {
namespace {

using detail::histogram_bins;
using detail::histogram_stride;
using detail::histogram_values;

const detail::pair_features& kernels() {
  return *detail::for_target(
      static_cast<int>(current_vector_target()),
      []<detail::kernel_target V> { return &detail::pair_features_in<V>(); });
}

/// Points and normals in three dimensions, in single precision relative to one of the points.
template <Scalar S, int D>
std::vector<detail::surface_point> surface_of(points_view<S, D> points, points_view<S, D> normals) {
  std::vector<detail::surface_point> surface(static_cast<std::size_t>(points.size()));
  const auto first = std::ranges::find_if(points, [](const auto& p) { return is_finite(p); });
  for (index_t i = 0; i < points.size(); ++i) {
    auto& one = surface[i];
    one = {};
    const S square = normals[i].squaredNorm();
    if (!is_finite(points[i]) || !std::isfinite(square) || square == 0) continue;
    expects(std::abs(square - 1) <= S(0.01),
            "fpfh: a normal does not have unit length; are points and normals swapped?");
    for (int d = 0; d < D; ++d) {
      one.point[d] = static_cast<float>(points[i][d] - (*first)[d]);
      one.normal[d] = static_cast<float>(normals[i][d]);
    }
  }
  return surface;
}

bool has_normal(const detail::surface_point& p) {
  return p.normal[0] != 0 || p.normal[1] != 0 || p.normal[2] != 0;
}
float along(const detail::surface_point& a, const detail::surface_point& b) {
  return a.normal[0] * b.normal[0] + a.normal[1] * b.normal[1] + a.normal[2] * b.normal[2];
}

using feature = std::array<float, histogram_stride>;

std::span<float, histogram_bins> histogram(feature& all, int which) {
  return std::span<float, histogram_bins>{all.data() + which * histogram_bins, histogram_bins};
}

void scale_to_one(feature& all) {
  for (int h = 0; h < 3; ++h) {
    float sum = 0;
    for (const float v : histogram(all, h)) sum += v;
    if (sum > 0)
      for (float& v : histogram(all, h)) v /= sum;
  }
}

/// Of a feature and that of the flipped surface, the one in which more lies above than below.
void choose_sign(feature& all) {
  constexpr int middle = histogram_bins / 2;
  float balance = 0;
  for (int b = 0; b < histogram_bins; ++b) balance += float(b - middle) * histogram(all, 2)[b];
  if (balance >= 0) return;
  std::ranges::reverse(histogram(all, 0));
  std::ranges::reverse(histogram(all, 2));
}

template <Scalar S, int D>
class feature_histograms {
 public:
  feature_histograms(points_view<S, D> points, points_view<S, D> normals,
                     const neighborhood_spec& near, const fpfh_options& options)
      : points_{points},
        near_{near},
        options_{options},
        surface_{surface_of(points, normals)},
        tree_{points, {.threads = options.threads}},
        pairs_(static_cast<std::size_t>(points.size() * histogram_stride)) {
    options_.monitor = in_passes(options.monitor, options.at ? 3 : 2);
  }

  [[nodiscard]] Eigen::MatrixXf all() {
    const auto at = options_.at ? mask_of(*options_.at) : std::vector<std::uint8_t>{};
    count_pairs(options_.at ? those_near(at) : at);

    constexpr index_t rows = D == 3 ? histogram_values : 2 * histogram_bins;
    Eigen::MatrixXf features(rows, points_.size());
    features.setZero();
    visit(at, [&](index_t i, std::span<const std::int32_t> near, std::span<const S> distances) {
      const auto found = blended(i, near, distances);
      // In two dimensions α, the angle out of the plane, says nothing.
      float* to = features.col(i).data();
      to = std::copy_n(found.data(), histogram_bins, to);
      if constexpr (D == 3) to = std::copy_n(found.data() + histogram_bins, histogram_bins, to);
      std::copy_n(found.data() + 2 * histogram_bins, histogram_bins, to);
    });
    if (!options_.at) return features;
    Eigen::MatrixXf chosen(rows, std::ssize(*options_.at));
    for (index_t c = 0; c < chosen.cols(); ++c) chosen.col(c) = features.col((*options_.at)[c]);
    return chosen;
  }

 private:
  [[nodiscard]] std::vector<std::uint8_t> mask_of(const index_list& some) const {
    std::vector<std::uint8_t> mask(static_cast<std::size_t>(points_.size()));
    for (const auto i : some) {
      expects(0 <= i && i < points_.size(), "fpfh: an index in `at` is not one of a point");
      mask[i] = 1;
    }
    return mask;
  }

  /// Calls `f(i, indices, distances)` for each wanted point that has a normal.
  template <class F>
  void visit(std::span<const std::uint8_t> wanted, F f) const {
    visit_neighborhoods(tree_, points_, near_,
                        [&](const neighborhood_block<S>& block) {
                          for (index_t i = 0; i < block.size(); ++i)
                            if (has_normal(surface_[block.query(i)]))
                              f(block.query(i), block[i].indices(), block[i].distances());
                        },
                        {.wanted = wanted,
                         .ascending = false,
                         .threads = options_.threads,
                         .monitor = options_.monitor});
  }

  [[nodiscard]] std::vector<std::uint8_t> those_near(const std::vector<std::uint8_t>& at) const {
    std::vector<std::uint8_t> mask = at;
    std::mutex one_at_a_time;
    visit(at, [&](index_t, std::span<const std::int32_t> near, std::span<const S>) {
      const std::scoped_lock lock{one_at_a_time};
      for (const auto j : near) mask[j] = 1;
    });
    return mask;
  }

  /// The histogram of each wanted point's own pairs.
  void count_pairs(std::span<const std::uint8_t> wanted) {
    visit(wanted, [&](index_t i, std::span<const std::int32_t> near, std::span<const S>) {
      std::array<std::int32_t, histogram_values> counts{};
      kernels().count(surface_.data(), surface_[i], near.data(), std::ssize(near),
                      options_.oriented, counts.data());
      std::int32_t pairs = 0;
      for (int b = 0; b < histogram_bins; ++b) pairs += counts[b];
      float* own = pairs_.data() + i * histogram_stride;
      for (int b = 0; b < histogram_values; ++b)
        own[b] = pairs > 0 ? float(counts[b]) / float(pairs) : 0;
    });
  }

  [[nodiscard]] feature blended(index_t i, std::span<const std::int32_t> near,
                                std::span<const S> distances) const {
    std::vector<std::int32_t> others;
    std::vector<float> weights;
    std::vector<std::uint8_t> mirrored;
    for (std::size_t n = 0; n < near.size(); ++n) {
      const auto& other = surface_[near[n]];
      const auto square = static_cast<float>(distances[n] * distances[n]);
      if (!(square > 0) || !has_normal(other)) continue;
      others.push_back(near[n]);
      weights.push_back(1 / square);
      mirrored.push_back(!options_.oriented && along(surface_[i], other) < 0);
    }
    feature all{};
    kernels().blend(pairs_.data(), others.data(), weights.data(), mirrored.data(),
                    std::ssize(others), all.data());
    scale_to_one(all);
    const float* own = pairs_.data() + i * histogram_stride;
    for (int b = 0; b < histogram_values; ++b) all[b] += own[b];
    scale_to_one(all);
    if (!options_.oriented) choose_sign(all);
    return all;
  }

  points_view<S, D> points_;
  neighborhood_spec near_;
  fpfh_options options_;
  std::vector<detail::surface_point> surface_;
  kd_tree<S, D> tree_;
  std::vector<float> pairs_;
};

}  // namespace

template <Scalar S, int D>
Eigen::MatrixXf closed_fpfh(points_view<S, D> points, points_view<S, D> normals,
                            const neighborhood_spec& near, const fpfh_options& options) {
  expects(points.empty() || !normals.empty(), "fpfh: the points have no normals");
  expects(normals.size() == points.size() && normals.dimension() == points.dimension(),
          "fpfh: there must be one normal per point");
  const index_t d = points.dimension();
  if constexpr (D == dynamic) {
    expects(d == 2 || d == 3 || points.empty(),
            "fpfh: points must have two or three dimensions, and have " + std::to_string(d));
    const auto as = [&]<int E>(points_view<S, D> all) {
      return points_view<S, E>{all.data(), all.size(), all.stride()};
    };
    if (d == 2)
      return closed_fpfh<S, 2>(as.template operator()<2>(points),
                               as.template operator()<2>(normals), near, options);
    if (points.empty()) return closed_fpfh<S, 3>({}, {}, near, options);
    return closed_fpfh<S, 3>(as.template operator()<3>(points), as.template operator()<3>(normals),
                             near, options);
  } else {
    return feature_histograms<S, D>{points, normals, near, options}.all();
  }
}

#define CILANTRO_INSTANTIATE(S, D)                                           \
  template Eigen::MatrixXf closed_fpfh(points_view<S, D>, points_view<S, D>, \
                                       const neighborhood_spec&, const fpfh_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
