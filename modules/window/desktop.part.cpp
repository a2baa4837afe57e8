// SPDX-License-Identifier: MIT
//
// The desktop's part of a window: opened by GLFW, it notes what happens to it. Internal.
//
// GLFW calls back from within C frames, which no exception may cross. So what happens is noted
// there, and handled by whoever takes the events.
module;
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <deque>
#include <thread>
module cilantro.window:desktop;

import cilantro.standard;
import cilantro.core;
import :key;
import :key_codes;
import :on_screen;

namespace cilantro {

/// Throws a `window_error`, with what GLFW says, too.
[[noreturn]] void throw_window_error(const std::string& cause) {
  const char* details = nullptr;
  glfwGetError(&details);
  throw window_error{"there can be no window here: " + cause +
                     (details ? " (" + std::string{details} + ")" : "") +
                     "; write_picture(scene, \"scene.png\") and write_html(scene, \"scene.html\") "
                     "show a scene without one"};
}

/// GLFW for the one thread that has windows. It stays when the last of them is gone: a driver that
/// is loaded and unloaded with every window fails after some two hundred of them.
class glfw_use {
 public:
  glfw_use() {
    auto& all = shared();
    const std::scoped_lock lock{all.mutex};
    expects(all.count == 0 || all.owner == std::this_thread::get_id(),
            "window: all windows belong to the thread that made the first of them");
    if (glfwInit() != GLFW_TRUE) throw_window_error("no display");
    all.owner = std::this_thread::get_id();
    ++all.count;
  }
  glfw_use(const glfw_use&) = delete;
  glfw_use& operator=(const glfw_use&) = delete;
  ~glfw_use() {
    auto& all = shared();
    const std::scoped_lock lock{all.mutex};
    --all.count;
  }

 private:
  struct uses {
    std::mutex mutex;
    int count = 0;
    std::thread::id owner;
  };
  static uses& shared() {
    static uses all;
    return all;
  }
};

using event_time = std::chrono::steady_clock::time_point;

/// In the units of the desktop, from the top left of the window.
struct mouse_place {
  double x = 0, y = 0;
};
enum class mouse_button { left, middle, right };
struct mouse_pressed {
  mouse_button button;
  mouse_place at;
  bool with_shift;
  event_time when;
};
struct mouse_released {
  mouse_button button;
  mouse_place at;
};
struct mouse_moved {
  mouse_place to;
};
struct wheel_turned {
  double steps;  ///< Away from the user.
};
struct key_pressed {
  key pressed;
};
/// What was on the screen is lost.
struct picture_lost {};
struct close_wanted {};
using window_event = std::variant<mouse_pressed, mouse_released, mouse_moved, wheel_turned,
                                  key_pressed, picture_lost, close_wanted>;

/// A window with a context of OpenGL.
class desktop_window {
 public:
  desktop_window(const std::string& title, int width, int height, bool is_visible = true) {
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_VISIBLE, is_visible ? GLFW_TRUE : GLFW_FALSE);
    glfwWindowHintString(GLFW_X11_CLASS_NAME, "cilantro");
    glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "cilantro");
    handle_.reset(glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr));
    if (!handle_) throw_window_error("no driver speaks OpenGL 3.3");
    glfwSetWindowUserPointer(handle_.get(), this);
    glfwGetCursorPos(handle_.get(), &mouse_.x, &mouse_.y);
    note_what_happens();
  }
  desktop_window(const desktop_window&) = delete;
  desktop_window& operator=(const desktop_window&) = delete;

  struct extent {
    int width, height;
    friend bool operator==(const extent&, const extent&) = default;
  };
  /// In the units of the desktop, in which the mouse is.
  [[nodiscard]] extent size() const {
    extent result{};
    glfwGetWindowSize(handle_.get(), &result.width, &result.height);
    return result;
  }
  [[nodiscard]] extent size_in_pixels() const {
    extent result{};
    glfwGetFramebufferSize(handle_.get(), &result.width, &result.height);
    return result;
  }
  void hide() { glfwHideWindow(handle_.get()); }
  void set_title(const std::string& title) { glfwSetWindowTitle(handle_.get(), title.c_str()); }

  /// Lets GLFW note what happened to all windows.
  static void note_events() { glfwPollEvents(); }
  /// As above, and waits until something happens or the time is over.
  static void wait_for_events(double seconds) { glfwWaitEventsTimeout(seconds); }
  /// Ends a wait; from any thread.
  static void wake() { glfwPostEmptyEvent(); }

  [[nodiscard]] bool has_events() const { return failure_ != nullptr || !events_.empty(); }
  /// The first event that was noted and not taken.
  [[nodiscard]] std::optional<window_event> take_event() {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    if (events_.empty()) return std::nullopt;
    const auto first = events_.front();
    events_.pop_front();
    return first;
  }

  /// A function of OpenGL, as the current context has it; null if it has none of that name.
  static void (*function_of_gl(const char* name))() { return glfwGetProcAddress(name); }

  /// Calls a function with the context of this window.
  void with_context(auto&& call) {
    const context_of_caller restore;
    glfwMakeContextCurrent(handle_.get());
    glfwSwapInterval(0);  // Several windows would wait one after the other.
    call();
  }
  /// Shows what `draw` draws.
  void present(auto&& draw) {
    with_context([&] {
      draw();
      glfwSwapBuffers(handle_.get());
    });
  }

 private:
  struct context_of_caller {
    GLFWwindow* before = glfwGetCurrentContext();
    context_of_caller() = default;
    context_of_caller(const context_of_caller&) = delete;
    context_of_caller& operator=(const context_of_caller&) = delete;
    ~context_of_caller() { glfwMakeContextCurrent(before); }
  };
  static desktop_window& of(GLFWwindow* handle) {
    return *static_cast<desktop_window*>(glfwGetWindowUserPointer(handle));
  }
  void note(const window_event& what) noexcept {
    try {
      // Where the mouse was on its way says nothing.
      if (!events_.empty() && std::holds_alternative<mouse_moved>(what) &&
          std::holds_alternative<mouse_moved>(events_.back()))
        events_.pop_back();
      events_.push_back(what);
    } catch (...) {
      failure_ = std::current_exception();
    }
  }
  void note_what_happens() {
    glfwSetCursorPosCallback(handle_.get(), [](GLFWwindow* handle, double x, double y) {
      of(handle).note(mouse_moved{of(handle).mouse_ = {x, y}});
    });
    glfwSetMouseButtonCallback(
        handle_.get(), [](GLFWwindow* handle, int code, int action, int modifiers) {
          if (code > GLFW_MOUSE_BUTTON_MIDDLE) return;
          const auto button = code == GLFW_MOUSE_BUTTON_LEFT    ? mouse_button::left
                              : code == GLFW_MOUSE_BUTTON_RIGHT ? mouse_button::right
                                                                : mouse_button::middle;
          // Not where the mouse is now, after what happened since.
          const mouse_place at = of(handle).mouse_;
          if (action == GLFW_PRESS)
            of(handle).note(mouse_pressed{button, at, (modifiers & GLFW_MOD_SHIFT) != 0,
                                          std::chrono::steady_clock::now()});
          else
            of(handle).note(mouse_released{button, at});
        });
    glfwSetScrollCallback(handle_.get(), [](GLFWwindow* handle, double, double steps) {
      of(handle).note(wheel_turned{steps});
    });
    glfwSetKeyCallback(handle_.get(),
                       [](GLFWwindow* handle, int code, int scancode, int action, int modifiers) {
                         if (action != GLFW_PRESS ||
                             (modifiers & (GLFW_MOD_CONTROL | GLFW_MOD_ALT | GLFW_MOD_SUPER)) != 0)
                           return;
                         if (const auto pressed = key_of(code, scancode))
                           of(handle).note(key_pressed{*pressed});
                       });
    glfwSetWindowRefreshCallback(handle_.get(),
                                 [](GLFWwindow* handle) { of(handle).note(picture_lost{}); });
    glfwSetWindowCloseCallback(handle_.get(),
                               [](GLFWwindow* handle) { of(handle).note(close_wanted{}); });
  }

  struct destroy {
    void operator()(GLFWwindow* handle) const { glfwDestroyWindow(handle); }
  };
  glfw_use use_;
  std::unique_ptr<GLFWwindow, destroy> handle_;
  mouse_place mouse_;
  std::deque<window_event> events_;
  std::exception_ptr failure_;
};

}  // namespace cilantro
