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

  void note_change(clock::time_point now) {
    last_change_ = now;
    is_stale_ = true;
  }

  /// How long until the next picture is due, if there is any.
  [[nodiscard]] std::optional<clock::duration> until_due(clock::time_point now) const {
    if (is_stale_) return clock::duration::zero();
    if (is_fine_) return std::nullopt;
    return std::max(last_change_ + rest - now, clock::duration::zero());
  }

  /// What the picture that is due is drawn with. From now on it counts as drawn.
  [[nodiscard]] render_options begin(const render_options& wanted, clock::time_point now) {
    is_stale_ = false;
    auto options = wanted;
    if (now - last_change_ < rest) {
      options.blend = false;
      options.supersampling = 1;
    }
    is_fine_ = options.blend == wanted.blend && options.supersampling == wanted.supersampling;
    return options;
  }

 private:
  static constexpr clock::duration rest = std::chrono::milliseconds{150};

  clock::time_point last_change_;
  bool is_stale_ = true;
  bool is_fine_ = false;  ///< Whether the last picture was drawn as it should be.
};

}  // namespace cilantro
