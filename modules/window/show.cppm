// SPDX-License-Identifier: MIT
export module cilantro.window:show;

import cilantro.standard;
import cilantro.visualization;
import :on_screen;

namespace cilantro {

/// Shows a scene in a window until it is closed. Throws as `window` does.
export void show(const scene& all, const window_options& options = {});

struct show_tap {
  std::string layer;
  cloud_look how;
  window_options options;

  static constexpr const char* name = "show";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void look(const C& cloud) const {
    show(scene{}.set(layer, cloud, how), options);
  }
};
/// The step that shows the cloud, as a layer of that name, until the window is closed, and passes
/// it on unchanged.
export [[nodiscard]] auto show(std::string layer, cloud_look look = {},
                               window_options options = {}) {
  return tap_step{show_tap{std::move(layer), std::move(look), std::move(options)}};
}

}  // namespace cilantro
