// SPDX-License-Identifier: MIT
//
// When a window draws, and how finely. Internal.
module;
#include <algorithm>
#include <chrono>
#include <optional>
module cilantro.window:pace;

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

/// What a coarse picture is drawn with in place of what was asked for.
[[nodiscard]] render_options coarse(render_options wanted) {
  wanted.blend = false;
  wanted.supersampling = 1;
  return wanted;
}

}  // namespace cilantro
