// SPDX-License-Identifier: MIT
module cilantro.window;

namespace cilantro {
namespace {

window_options without_turning(window_options options) {
  options.can_turn = false;
  if (options.title.empty()) options.title = "image";
  return options;
}

}  // namespace

/// At an address that stays, which the window calls.
struct image_viewer::state {
  explicit state(const window_options& options)
      : title{options.title}, shown{{}, without_turning(options)} {
    // Straight from the front again.
    shown.on(key::r, [this] { width = 0; });
    shown.on_hover([this](const std::optional<picked>& found) { say(found); });
  }

  struct content {
    view from;
    image_look look;
    value_text value;
  };
  void say(const std::optional<picked>& found) {
    const std::scoped_lock lock{mutex};
    if (!seen) return;
    std::string text = !title.empty()             ? title
                       : seen->look.title.empty() ? "image"
                                                  : seen->look.title;
    if (found) {
      const Eigen::Vector3d place = seen->look.pose.inverse() * found->place;
      // The border of the last pixel is that pixel's.
      const auto pixel = [](double at, int size) {
        return std::min(std::max(static_cast<int>(std::floor(at + 0.5)), 0), size - 1);
      };
      const int x = pixel(place.x() / seen->look.pixel_size.x(), seen->from.camera.width);
      const int y = pixel(-place.y() / seen->look.pixel_size.y(), seen->from.camera.height);
      text += " (" + std::to_string(x) + ", " + std::to_string(y) + "): " + seen->value(x, y);
    }
    shown.set_title(text);
  }
  /// Looks straight at an image of a new size.
  void look() {
    std::optional<view> from;
    {
      const std::scoped_lock lock{mutex};
      if (seen && (width != seen->from.camera.width || height != seen->from.camera.height)) {
        from = seen->from;
        width = from->camera.width;
        height = from->camera.height;
      }
    }
    if (from) shown.look(*from);
  }

  std::string title;
  window shown;
  std::mutex mutex;  ///< Of `seen`.
  std::optional<content> seen;
  int width = 0, height = 0;
};

image_viewer::image_viewer(const window_options& options)
    : state_{std::make_unique<state>(options)} {}
image_viewer::image_viewer(image_viewer&&) noexcept = default;
image_viewer& image_viewer::operator=(image_viewer&&) noexcept = default;
image_viewer::~image_viewer() = default;

image_viewer::state& image_viewer::existing() const {
  expects(state_ != nullptr, "image_viewer: it was moved from");
  return *state_;
}
void image_viewer::put(scene all, const view& from, const image_look& look, value_text value) {
  {
    const std::scoped_lock lock{existing().mutex};
    state_->seen = state::content{from, look, std::move(value)};
  }
  state_->shown.show(std::move(all));
}
bool image_viewer::update() {
  existing().look();
  return state_->shown.update();
}
void image_viewer::wait() {
  while (update()) state_->shown.wait_for_change();
}
void image_viewer::close() {
  existing().shown.close();
}
window& image_viewer::on_screen() {
  return existing().shown;
}

}  // namespace cilantro
