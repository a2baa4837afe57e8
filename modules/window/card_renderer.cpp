// SPDX-License-Identifier: MIT
module;
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>

module cilantro.window;

import :desktop;
import :gl_functions;
import :graphics_card;

namespace cilantro {
namespace {

[[noreturn]] void throw_no_card(const std::string& cause) {
  throw window_error{"no graphics card can draw here: " + cause +
                     "; render(scene, view) draws by the processor"};
}

/// EGL, loaded when it is asked for: without it, windows work as well.
struct egl_functions {
  void* library = ::dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
  PFNEGLGETPROCADDRESSPROC get_proc_address = load<PFNEGLGETPROCADDRESSPROC>("eglGetProcAddress");
  PFNEGLQUERYSTRINGPROC query_string = load<PFNEGLQUERYSTRINGPROC>("eglQueryString");
  PFNEGLGETDISPLAYPROC get_display = load<PFNEGLGETDISPLAYPROC>("eglGetDisplay");
  PFNEGLINITIALIZEPROC initialize = load<PFNEGLINITIALIZEPROC>("eglInitialize");
  PFNEGLBINDAPIPROC bind_api = load<PFNEGLBINDAPIPROC>("eglBindAPI");
  PFNEGLCHOOSECONFIGPROC choose_config = load<PFNEGLCHOOSECONFIGPROC>("eglChooseConfig");
  PFNEGLCREATECONTEXTPROC create_context = load<PFNEGLCREATECONTEXTPROC>("eglCreateContext");
  PFNEGLDESTROYCONTEXTPROC destroy_context = load<PFNEGLDESTROYCONTEXTPROC>("eglDestroyContext");
  PFNEGLMAKECURRENTPROC make_current = load<PFNEGLMAKECURRENTPROC>("eglMakeCurrent");

  /// The same for all, and never closed: drivers do not bear to be loaded again.
  static const egl_functions& all() {
    static const egl_functions functions;
    return functions;
  }

 private:
  template <class Function>
  Function load(const char* name) const {
    const auto function = library ? reinterpret_cast<Function>(::dlsym(library, name)) : nullptr;
    if (function == nullptr)
      throw_no_card("EGL, which draws without a display, is not installed (libegl1)");
    return function;
  }
};

/// A context that draws nowhere but into its own pixels.
class offscreen_context {
 public:
  offscreen_context() {
    const auto& egl = egl_functions::all();
    egl.bind_api(EGL_OPENGL_API);
    const auto get_platform_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        egl.get_proc_address("eglGetPlatformDisplayEXT"));
    // The cards one by one, the best first, and at last whatever draws without any surface.
    if (get_platform_display) {
      const auto query_devices =
          reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(egl.get_proc_address("eglQueryDevicesEXT"));
      std::array<EGLDeviceEXT, 16> devices{};
      EGLint count = 0;
      if (query_devices && query_devices(EGLint(devices.size()), devices.data(), &count))
        for (int i = 0; i < count && !context_; ++i)
          try_display(get_platform_display(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
      if (!context_)
        try_display(
            get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    }
    if (!context_) try_display(egl.get_display(EGL_DEFAULT_DISPLAY));
    if (!context_) throw_no_card("no driver draws by OpenGL 3.3 without a display");
  }
  offscreen_context(const offscreen_context&) = delete;
  offscreen_context& operator=(const offscreen_context&) = delete;
  ~offscreen_context() { egl_functions::all().destroy_context(display_, context_); }

  /// Calls a function with this context.
  void with(auto&& call) const {
    const auto& egl = egl_functions::all();
    if (!egl.make_current(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      throw_no_card("its driver has failed");
    struct released {
      EGLDisplay display;
      ~released() {
        egl_functions::all().make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      }
    } const release{display_};
    call();
  }

 private:
  void try_display(EGLDisplay display) {
    const auto& egl = egl_functions::all();
    if (display == EGL_NO_DISPLAY || !egl.initialize(display, nullptr, nullptr)) return;
    // Otherwise, one for windows is meant.
    constexpr std::array<EGLint, 5> wanted{EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE,
                                           EGL_PBUFFER_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!egl.choose_config(display, wanted.data(), &config, 1, &count) || count < 1) return;
    constexpr std::array<EGLint, 7> version{EGL_CONTEXT_MAJOR_VERSION,
                                            3,
                                            EGL_CONTEXT_MINOR_VERSION,
                                            3,
                                            EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                            EGL_NONE};
    const auto context = egl.create_context(display, config, EGL_NO_CONTEXT, version.data());
    if (context == EGL_NO_CONTEXT) return;
    if (!egl.make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
      egl.destroy_context(display, context);
      return;
    }
    egl.make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    display_ = display;
    context_ = context;
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

struct card_renderer::state {
  offscreen_context context;
  std::string name;
  std::optional<gl_functions> gl;
  std::optional<graphics_card> card;

  state() {
    context.with([&] {
      gl.emplace([](const char* function) -> gl_function {
        return egl_functions::all().get_proc_address(function);
      });
      card.emplace(*gl);
      name = graphics_card::name_of(*gl);
    });
  }
  state(const state&) = delete;
  state& operator=(const state&) = delete;
  ~state() {
    context.with([&] { card.reset(); });
  }
};

card_renderer::card_renderer() : state_{std::make_unique<state>()} {}
card_renderer::card_renderer(card_renderer&&) noexcept = default;
card_renderer& card_renderer::operator=(card_renderer&&) noexcept = default;
card_renderer::~card_renderer() = default;

image<rgb> card_renderer::render(const scene& all, const view& from,
                                 const render_options& options) {
  expects(
      options.threads == 0 && !options.monitor.progress && !options.monitor.stop.stop_possible(),
      "card_renderer: a graphics card has no .threads and no .monitor");
  expects(state_ != nullptr, "card_renderer: it was moved from");
  // What the processor refuses is refused here, too.
  auto tiny = options;
  tiny.width = tiny.height = 1;
  (void)cilantro::render({}, from, tiny);
  std::optional<image<rgb>> picture;
  state_->context.with([&] { picture = state_->card->draw(all, from, options); });
  return *std::move(picture);
}
const std::string& card_renderer::name() const {
  expects(state_ != nullptr, "card_renderer: it was moved from");
  return state_->name;
}

}  // namespace cilantro
