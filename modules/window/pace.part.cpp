// SPDX-License-Identifier: MIT
//
// When a window draws, and how finely. Internal.
module cilantro.window:pace;

import cilantro.standard;
import cilantro.visualization;

namespace cilantro {

/// Pictures are coarse and soon there while something changes; once nothing has for a while, there
/// is one more, drawn as it should be.
class pace {
 public:
  using clock = std::chrono::steady_clock;
  enum class picture { coarse, fine };

  void note_change(clock::time_point now) {
    last_change_ = now;
    due_ = picture::coarse;
  }

  /// How long until the next picture is due, if one is.
  [[nodiscard]] std::optional<clock::duration> until_due(clock::time_point now) const {
    if (!due_) return std::nullopt;
    if (due_ == picture::coarse) return clock::duration::zero();
    return std::max(last_change_ + rest - now, clock::duration::zero());
  }

  /// The picture that is due, if one is. From now on it counts as drawn.
  [[nodiscard]] std::optional<picture> take_due(clock::time_point now) {
    const auto time = until_due(now);
    if (!time || time->count() > 0) return std::nullopt;
    const auto taken = due_;
    due_.reset();
    if (taken == picture::coarse) due_ = picture::fine;
    return taken;
  }

 private:
  static constexpr clock::duration rest = std::chrono::milliseconds{150};

  clock::time_point last_change_;
  std::optional<picture> due_ = picture::coarse;
};

/// What coarse pictures are drawn with, so that there are thirty in a second.
class coarse_drawing {
 public:
  /// In place of what was asked for, of a scene with so many points.
  [[nodiscard]] render_options of(render_options wanted, index_t points) {
    wanted.blend = false;
    wanted.supersampling = 1;
    if (wanted.point_budget > 0) points = std::min(points, wanted.point_budget);
    drawn_ = std::min(points, budget_);
    is_all_ = drawn_ == points;
    if (!is_all_) wanted.point_budget = drawn_;
    return wanted;
  }
  /// How long the last one took. What it could have drawn in time is the budget of the next.
  void note_time(std::chrono::duration<double> took) {
    const double possible = double(drawn_) * (aim / std::max(took, aim / 16));
    // One picture in time says little about those of more points; one too late says enough.
    if (took > aim)
      budget_ = std::max(least, index_t(0.9 * possible));
    else if (took < aim / 2 && !is_all_)
      budget_ = std::min(index_t(possible), 2 * drawn_);
  }

 private:
  static constexpr std::chrono::duration<double> aim{1 / 30.};
  static constexpr index_t least = 50'000;

  index_t budget_ = std::numeric_limits<index_t>::max(), drawn_ = 0;
  bool is_all_ = true;
};

}  // namespace cilantro
