// SPDX-License-Identifier: MIT
export module cilantro.window:image_viewer;

import cilantro.standard;
import cilantro.visualization;
import :on_screen;

namespace cilantro {

/// A window that shows an image, of numbers by a color map with its bar; the title says the pixel
/// under the mouse and its value. Dragging moves the image, and the wheel makes it larger where the
/// mouse is; for the rest it is as windows are.
export class image_viewer {
 public:
  /// Throws as `window` does.
  explicit image_viewer(const window_options& options = {});
  image_viewer(image_viewer&& other) noexcept;
  image_viewer& operator=(image_viewer&& other) noexcept;
  ~image_viewer();

  /// Shows a copy of an image, the first one and each of another size as large as there is room
  /// for. May be called from any thread while the viewer exists. Throws as `draw` of images does,
  /// and `invalid_input` for one without pixels.
  template <DrawableImage I>
  void show(const I& source, const image_look& look = {}) {
    const image_view pixels{source};
    using pixel = pixel_of<I>;
    image<pixel> copy(pixels.width(), pixels.height());
    for (int y = 0; y < pixels.height(); ++y) std::ranges::copy(pixels[y], copy[y].begin());
    const view from = one_to_one(copy, look);
    scene all;
    all.set(look.title.empty() ? "image" : look.title, copy, look);
    put(std::move(all), from, look, [copy = std::move(copy)](int x, int y) {
      if constexpr (std::same_as<pixel, rgb>) {
        const auto& [red, green, blue] = copy(x, y);
        return in_digits(red) + ", " + in_digits(green) + ", " + in_digits(blue);
      } else {
        return in_digits(double(copy(x, y)));
      }
    });
  }

  /// As those of windows.
  bool update();
  void wait();
  void close();
  /// What shows it, for keys and films.
  [[nodiscard]] window& on_screen() [[clang::lifetimebound]];

 private:
  using value_text = std::function<std::string(int, int)>;
  void put(scene all, const view& from, const image_look& look, value_text value);

  struct state;
  [[nodiscard]] state& existing() const;
  std::unique_ptr<state> state_;
};

/// Shows an image in a window until it is closed. Throws as `image_viewer` does.
export template <DrawableImage I>
void show(const I& source, const image_look& look = {}, const window_options& options = {}) {
  image_viewer viewer{options};
  viewer.show(source, look);
  viewer.wait();
}

}  // namespace cilantro
