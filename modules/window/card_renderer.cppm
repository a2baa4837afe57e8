// SPDX-License-Identifier: MIT
export module cilantro.window:card_renderer;

import cilantro.standard;
import cilantro.visualization;

namespace cilantro {

/// Draws scenes by a graphics card, without a display: for machines that have a card and no screen.
/// Layers stay on the card as long as they are in what is drawn, so that a second picture of them
/// costs less. Moves; one thread may use it at a time.
export class card_renderer {
 public:
  /// Throws `window_error` if no driver draws by OpenGL 3.3 without a display (EGL).
  card_renderer();
  card_renderer(card_renderer&& other) noexcept;
  card_renderer& operator=(card_renderer&& other) noexcept;
  ~card_renderer();

  /// As the `render` that draws by the processor, alike and not to the bit. `.threads` and
  /// `.monitor` must be those of default options. Throws as that does, and `window_error` if the
  /// card has too little memory.
  [[nodiscard]] image<rgb> render(const scene& all, const view& from,
                                  const render_options& options = {});
  /// What its driver calls it; one of a software driver is slower than the processor itself.
  [[nodiscard]] const std::string& name() const [[clang::lifetimebound]];

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace cilantro
