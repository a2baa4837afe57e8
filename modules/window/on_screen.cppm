// SPDX-License-Identifier: MIT
export module cilantro.window:on_screen;

import cilantro.standard;
import cilantro.visualization;
import :key;

namespace cilantro {

/// There can be no window here: no display, no driver, or none that speaks OpenGL 3.3. The sentence
/// says which, and what draws without one.
export class window_error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What draws what is on the screen.
export enum class renderer {
  automatic,  ///< The graphics card where there is one; otherwise `software`.
  software,   ///< `render`, by the processor: what is on the screen is what it draws, to the bit.
  opengl,     ///< OpenGL 3.3, whatever it is that the driver draws with: alike, not equal.
};

/// Options of windows.
export struct window_options {
  std::string title = {};          ///< In UTF-8; if empty, the names of the layers at first.
  int width = 1280, height = 720;  ///< As the desktop counts; fine screens have more pixels.
  /// How scenes are drawn once nothing has changed for 0.15 s; until then without `.blend` and
  /// `.supersampling`, and with as many points as there is time for thirty times a second. Of large
  /// windows, `.supersampling` is lower where it would be too much for `render`. `.width`
  /// and `.height` must be 0, since the size is the window's, and
  /// `.monitor` empty.
  render_options drawing = {};
  renderer drawn_by = renderer::automatic;  ///< What draws what is on the screen.
  /// Whether dragging turns what is seen; otherwise it moves it, as the right button does.
  bool can_turn = true;
};

/// Whether a window can be opened here: it tries, with one that is not seen. Call it where windows
/// may be made.
export [[nodiscard]] bool can_open_window();

/// A window that shows a scene, and needs no graphics card for that. The left
/// button of the mouse turns it, the right one moves it, the wheel makes it larger. The keys r, o,
/// e, b, l and the digits change what is seen; q and Escape close the window. There may be several.
///
/// All windows of a program belong to the thread that made the first of them, until the last is
/// gone. Only `show` may be called from any thread; the others throw `invalid_input` elsewhere. So
/// do all of a window that was moved from.
export class window {
 public:
  /// Opens a window. Throws `window_error`, and `invalid_input` for options that make no sense.
  explicit window(scene first = {}, const window_options& options = {});
  window(window&& other) noexcept;
  window& operator=(window&& other) noexcept;
  ~window();

  /// Handles what the mouse, the keys and other threads did, draws if anything changed, and returns
  /// at once: the body of a loop of yours, `while (w.update()) …`. False once the window is closed.
  /// What callbacks throw comes from here, and so does what `render` throws.
  bool update();
  /// Updates until the window is closed, without using the processor while nothing happens. Other
  /// windows stand still meanwhile.
  void wait();
  /// Waits until there is something to update, such as a mouse that was moved or a scene that was
  /// shown, for a loop of yours that has nothing else to do.
  void wait_for_change();
  /// Closes the window, as the user may, too.
  void close();

  /// Shows another scene from the same view; the first that is not empty is fitted. May be called
  /// from any thread while the window exists, and costs little: of scenes that come faster than
  /// they are drawn, only the last is.
  void show(scene next);
  /// The scene that is shown, without the layers that were hidden by keys.
  [[nodiscard]] scene current() const;

  /// From where it is seen: `render(w.current(), w.seen())` is what is on the screen, to the bit
  /// where the processor draws. The camera has the size of the window in pixels.
  [[nodiscard]] view seen() const;
  /// Shows the scene from there. A camera of another size is scaled as by `render`. Throws
  /// `invalid_input` for views that `orbit` or `render` do not accept.
  void look(const view& from);

  /// Calls `action` when the key is pressed without Ctrl, Alt or Super, instead of what the key
  /// does by itself; an empty one leaves a key without effect. It may call anything of the window,
  /// but not destroy it.
  void on(key pressed, std::function<void()> action);
  /// Calls `action` with what was clicked; a click on the background is none.
  void on_pick(std::function<void(const picked&)> action);
  /// Calls `action` with what is under the mouse after it or the view was moved; with nothing over
  /// the background.
  /// Finding it takes as long as `pick` does.
  void on_hover(std::function<void(const std::optional<picked>&)> action);
  void set_title(const std::string& title);

  /// From now on, what is on the screen becomes a film, in the size that the window has now, as
  /// long as it is there to be seen; shorter where frames take longer to write than to see. Throws
  /// as `video` does, and `invalid_input` while there is a film in the making.
  void record(const std::filesystem::path& path, const video_options& options = {});
  /// Ends the film, if there is one; so does closing the window. Without either, nothing remains of
  /// it. Throws as `video::finish` does.
  void stop_recording();
  [[nodiscard]] bool is_recording() const;

  /// Who draws: `software` or `opengl`.
  [[nodiscard]] renderer drawn_by() const;

 private:
  class screen;
  [[nodiscard]] screen& existing(const char* call) const;
  [[nodiscard]] screen& own(const char* call) const;
  std::unique_ptr<screen> screen_;  // At one address, which the events know, also if it is moved.
};

}  // namespace cilantro
