// SPDX-License-Identifier: MIT
//
// What the mouse means: drags, clicks, and double clicks. Internal.
module cilantro.window:mouse;

import cilantro.standard;
import cilantro.visualization;
import :desktop;
import :navigation;

namespace cilantro {

/// How many pixels one unit of the desktop has, and how wide the window is in these units.
struct mouse_scale {
  double pixels_right, pixels_down, window_width;
};

class mouse {
 public:
  enum class click { none, single, twice };

  /// `can_turn`: whether the left button turns the view; otherwise it moves it, too.
  explicit mouse(bool can_turn) : can_turn_{can_turn} {}

  void press(const mouse_pressed& what, const view& seen) {
    if (grab_) return;
    const bool is_second = last_press_ && what.button == mouse_button::left &&
                           what.when - last_press_->when < std::chrono::milliseconds{400} &&
                           is_still(what.at, last_press_->at);
    grab_ = grab{.button = what.button,
                 .pans = what.button != mouse_button::left || what.with_shift || !can_turn_,
                 .is_second = is_second,
                 .at = what.at,
                 .from = seen};
    last_press_.reset();
    if (what.button == mouse_button::left) last_press_ = what;
    place_ = what.at;
  }

  /// The view that a drag makes, if there is one. It depends on where the button was pressed and
  /// where the mouse is, not on the way between.
  [[nodiscard]] std::optional<view> move(const mouse_moved& what, const mouse_scale& scale) {
    place_ = what.to;
    has_moved_ = true;
    if (!grab_ || (grab_->is_click && is_still(what.to, grab_->at))) return std::nullopt;
    grab_->is_click = false;
    const double right = what.to.x - grab_->at.x, down = what.to.y - grab_->at.y;
    if (grab_->pans)
      return pan(grab_->from,
                 {.right = right * scale.pixels_right, .down = down * scale.pixels_down});
    return turned(grab_->from, right, down, scale.window_width);
  }

  [[nodiscard]] click release(const mouse_released& what) {
    if (!grab_ || grab_->button != what.button) return click::none;
    const auto done = *std::exchange(grab_, std::nullopt);
    const bool is_click = done.is_click && done.button == mouse_button::left;
    if (!is_click || done.is_second) last_press_.reset();
    if (!is_click) return click::none;
    return done.is_second ? click::twice : click::single;
  }

  [[nodiscard]] bool can_turn() const { return can_turn_; }
  [[nodiscard]] const mouse_place& place() const { return place_; }
  [[nodiscard]] bool is_down() const { return grab_.has_value(); }
  /// What is under it may be something else.
  void note_moved() { has_moved_ = true; }
  /// Whether it was moved since this was asked last.
  [[nodiscard]] bool take_moved() { return std::exchange(has_moved_, false); }

  /// What else was done to the view is kept while a drag goes on.
  void go_on_from(const view& seen) {
    if (!grab_) return;
    grab_->at = place_;
    grab_->from = seen;
  }

 private:
  /// A button that is down, and the view at that time.
  struct grab {
    mouse_button button;
    bool pans, is_second;
    bool is_click = true;  ///< Until the mouse is moved.
    mouse_place at;
    view from;
  };

  static bool is_still(const mouse_place& a, const mouse_place& b) {
    return std::hypot(a.x - b.x, a.y - b.y) <= 3;
  }

  bool can_turn_, has_moved_ = false;
  mouse_place place_;
  std::optional<grab> grab_;
  std::optional<mouse_pressed> last_press_;
};

}  // namespace cilantro
