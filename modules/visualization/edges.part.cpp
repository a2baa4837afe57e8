// SPDX-License-Identifier: MIT
//
// Eye-dome lighting. Internal.
module cilantro.visualization:edges;

import cilantro.standard;
import cilantro.core;
import :drawing;
import :projector;

namespace cilantro {

/// How much light is left in each pixel where neighbours are nearer, by how much in relation to the
/// distance.
class edge_lighting {
 public:
  /// `strength` 0: all of it.
  edge_lighting(std::span<const depth_and_number> nearest, const projector& by, double strength,
                const execution& how)
      : width_{by.width},
        height_{by.height},
        // Two pixels of a picture 720 high, and as many of a smaller one.
        reach_{std::max(2 * by.fineness, int(std::lround(by.height / 360.0)))},
        strength_{float(strength) * 12},
        parallel_scale_{by.orthographic ? float(by.fx) / float(by.width) : 0} {
    if (strength == 0) return;
    nowhere_.assign(static_cast<std::size_t>(width_), std::numeric_limits<float>::quiet_NaN());
    depths_.resize(nearest.size());
    parallel_for(std::ssize(nearest), how, [&](index_t pixel) {
      depths_[static_cast<std::size_t>(pixel)] = depth_of(nearest[static_cast<std::size_t>(pixel)]);
    });
  }

  /// Of the pixels of a row; of those where nothing is, any number.
  void row(int y, std::span<float> light) const {
    if (depths_.empty()) {
      std::ranges::fill(light, 1.0f);
      return;
    }
    const std::array rows{row_at(y - reach_), row_at(y), row_at(y + reach_)};
    const auto shade = [&](int x, auto&& depth) {
      const float z = rows[1][x], scale = parallel_scale_ > 0 ? parallel_scale_ : 1 / z;
      const auto step = [&](int dx, int dy) {
        const float one = depth(rows[1 - dy], x - dx * reach_);
        const float other = depth(rows[1 + dy], x + dx * reach_);
        // Where nothing is, nothing is nearer.
        const float behind = 2 * z - (one == one ? one : z) - (other == other ? other : z);
        // Beyond this, nearer is just nearer.
        constexpr float most = 0.04f;
        return std::min(std::max(behind * scale, 0.0f), most);
      };
      // By pairs of opposite neighbours, between which a slope is none.
      const float sum = step(1, 0) + step(1, 1) + step(0, 1) + step(-1, 1);
      light[std::size_t(x)] = 1 / (1 + strength_ * sum);
    };
    const int inner = std::min(reach_, width_), end = std::max(inner, width_ - reach_);
    const auto careful = [&](const float* of, int x) {
      return 0 <= x && x < width_ ? of[x] : std::numeric_limits<float>::quiet_NaN();
    };
    for (int x = 0; x < inner; ++x) shade(x, careful);
    for (int x = inner; x < end; ++x) shade(x, [](const float* of, int at) { return of[at]; });
    for (int x = end; x < width_; ++x) shade(x, careful);
  }

 private:
  [[nodiscard]] inline const float* row_at(int y) const {
    if (y < 0 || y >= height_) return nowhere_.data();
    return depths_.data() + static_cast<std::ptrdiff_t>(y) * width_;
  }

  int width_, height_, reach_;
  float strength_, parallel_scale_;
  std::vector<float> depths_;   ///< NaN where nothing is.
  std::vector<float> nowhere_;  ///< A row of NaN.
};

}  // namespace cilantro
