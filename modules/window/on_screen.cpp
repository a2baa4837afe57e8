// SPDX-License-Identifier: MIT
module;
#include <thread>
module cilantro.window;

import :background_picture;
import :desktop;
import :gl_functions;
import :graphics_card;
import :mouse;
import :navigation;
import :pace;
import :picture_texture;
import :recording;

namespace cilantro {
namespace {

window_options checked(const window_options& options) {
  constexpr int most = 1 << 15;
  expects(
      0 < options.width && options.width <= most && 0 < options.height && options.height <= most,
      "window: .width and .height must be from 1 to 32768");
  expects(options.drawing.width == 0 && options.drawing.height == 0,
          "window: .drawing.width and .drawing.height must be 0: the size is that of the window");
  expects(!options.drawing.monitor.progress && !options.drawing.monitor.stop.stop_possible(),
          "window: .drawing.monitor must be empty: a window draws when it has to");
  // What pictures are refused for is found before there is a window.
  auto tiny = options.drawing;
  tiny.width = tiny.height = 1;
  (void)render({}, {}, tiny);
  return options;
}

std::string title_of(const scene& all, const window_options& options) {
  if (!options.title.empty()) return options.title;
  std::string names;
  for (const auto& layer : all.layers()) names += (names.empty() ? "" : ", ") + layer.name;
  return names.empty() ? "cilantro" : names;
}

}  // namespace

/// What a window is, at an address that stays.
class window::screen {
 public:
  screen(scene first, const window_options& options)
      : drawing_{options.drawing},
        desktop_{title_of(first, options), options.width, options.height},
        mouse_{options.can_turn},
        pending_{std::move(first)} {
    desktop_.with_context([&] {
      gl_.emplace(desktop_window::function_of_gl);
      picture_.emplace(*gl_);
      const bool by_card =
          options.drawn_by == renderer::opengl ||
          (options.drawn_by == renderer::automatic && !graphics_card::is_software(*gl_));
      if (by_card) card_.emplace(*gl_);
      may_change_renderer_ = options.drawn_by == renderer::automatic;
    });
    from_ = fit({}, fitting());
  }

  screen(const screen&) = delete;
  screen& operator=(const screen&) = delete;
  ~screen() {
    desktop_.with_context([&] { card_.reset(); });
  }

  void expect_own_thread(const char* call) const {
    expects(std::this_thread::get_id() == owner_,
            std::string{"window: "} + call +
                " must be called by the thread that made the window; only show may come from any");
  }

  bool update() {
    desktop_window::note_events();
    while (is_open_) {
      const auto event = desktop_.take_event();
      if (!event) break;
      std::visit([&](const auto& what) { handle(what); }, *event);
    }
    take_scene();
    if (is_open_) {
      draw();
      say_what_is_under_the_mouse();
      filming([](recording& film) { film.catch_up(); });
    } else {
      stop_recording();
    }
    return is_open_;
  }
  void wait() {
    while (update()) wait_for_change();
  }
  void wait_for_change() {
    if (!is_open_ || has_work()) return;
    // Whatever happens ends a wait, so its length is of no importance.
    std::chrono::duration<double> time{10};
    if (const auto due = pace_.until_due(pace::clock::now()); due && has_pixels()) time = *due;
    desktop_window::wait_for_events(time.count());
  }
  void close() {
    is_open_ = false;
    desktop_.hide();
  }

  void show(scene next) {
    {
      const std::scoped_lock lock{pending_mutex_};
      pending_ = std::move(next);
    }
    desktop_window::wake();
  }
  const scene& current() {
    take_scene();
    return shown_;
  }

  view seen() {
    take_scene();
    const auto [width, height] = desktop_.size_in_pixels();
    return has_pixels() ? resized(from_, width, height) : from_;
  }
  void look(const view& from) {
    (void)orbit(from, {});
    (void)render({}, from, {.width = 1, .height = 1});
    is_fitted_ = true;
    change_view(from);
  }

  void on(key pressed, std::function<void()> action) { actions_[pressed] = std::move(action); }
  void on_pick(std::function<void(const picked&)> action) { pick_action_ = std::move(action); }
  void on_hover(std::function<void(const std::optional<picked>&)> action) {
    hover_action_ = std::move(action);
  }
  void set_title(const std::string& title) { desktop_.set_title(title); }

  void record(const std::filesystem::path& path, const video_options& options) {
    expects(!film_, "window: a film is in the making; stop_recording ends it");
    take_scene();
    film_.emplace(path, options,
                  card_ ? drawn_by_card(drawing()) : render(shown_, seen(), drawing()));
  }
  void stop_recording() {
    if (!film_) return;
    auto film = *std::exchange(film_, std::nullopt);
    film.finish();
  }
  [[nodiscard]] bool is_recording() const { return film_.has_value(); }
  [[nodiscard]] renderer drawn_by() const { return card_ ? renderer::opengl : renderer::software; }

 private:
  /// Desktops may make icons of windows, with nothing to draw on.
  [[nodiscard]] bool has_pixels() const {
    const auto [width, height] = desktop_.size_in_pixels();
    return width > 0 && height > 0;
  }

  /// What another window's update may have noted, too.
  [[nodiscard]] bool has_work() {
    if (desktop_.has_events() || fine_picture_.is_done()) return true;
    const std::scoped_lock lock{pending_mutex_};
    return pending_.has_value();
  }

  void note_change() {
    fine_picture_.give_up();
    pace_.note_change(pace::clock::now());
  }
  void set_view(const view& from) {
    from_ = from;
    mouse_.note_moved();
    note_change();
  }
  /// As above, by something else than a drag.
  void change_view(const view& from) {
    set_view(from);
    mouse_.go_on_from(seen());
  }
  [[nodiscard]] view_options fitting() const {
    view_options options{.orthographic = from_.orthographic};
    const auto [width, height] = desktop_.size_in_pixels();
    if (has_pixels()) {
      options.width = width;
      options.height = height;
    }
    return options;
  }

  void take_scene() {
    {
      const std::scoped_lock lock{pending_mutex_};
      if (!pending_) return;
      shown_ = *std::exchange(pending_, std::nullopt);
    }
    for (const auto& [name, is_hidden] : hidden_by_keys_)
      if (std::ranges::find(shown_.layers(), name, &scene::layer::name) != shown_.layers().end())
        shown_.hide(name, is_hidden);
    if (!is_fitted_ && !shown_.bounds().isEmpty()) {
      is_fitted_ = true;
      from_ = fit(shown_, fitting());
    }
    note_change();
  }

  void draw() {
    if (!has_pixels()) return;
    const auto size = desktop_.size_in_pixels();
    if (size != drawn_size_) note_change();
    drawn_size_ = size;
    if (const auto due = pace_.take_due(pace::clock::now())) {
      if (due == pace::picture::coarse)
        draw_coarsely();
      else if (!is_as_wanted_ && card_)
        put_on_screen(drawn_by_card(drawing()));
      else if (!is_as_wanted_)
        fine_picture_.begin(shown_, seen(), drawing());
    } else if (const auto picture = fine_picture_.take()) {
      put_on_screen(*picture);
    }
    if (is_lost_) desktop_.present([&] { picture_->draw(); });
    is_lost_ = false;
  }
  void draw_coarsely() {
    const auto wanted = drawing();
    const auto options = coarse_.of(wanted, points_shown());
    is_as_wanted_ = options.blend == wanted.blend &&
                    options.supersampling == wanted.supersampling &&
                    options.point_budget == wanted.point_budget;
    const auto begin = pace::clock::now();
    put_on_screen(card_ ? drawn_by_card(options) : render(shown_, seen(), options));
    coarse_.note_time(pace::clock::now() - begin);
  }
  [[nodiscard]] image<rgb> drawn_by_card(const render_options& options) {
    std::optional<image<rgb>> picture;
    try {
      desktop_.with_context([&] { picture = card_->draw(shown_, seen(), options); });
    } catch (const window_error&) {
      if (!may_change_renderer_) throw;
      // What is too much for the card is not too much for the processor.
      desktop_.with_context([&] { card_.reset(); });
      picture = render(shown_, seen(), options);
    }
    return *std::move(picture);
  }
  [[nodiscard]] index_t points_shown() const {
    index_t n = 0;
    for (const auto& layer : shown_.layers())
      if (!layer.is_hidden)
        for (const auto& batch : layer.content->points()) n += batch.points.cols();
    return n;
  }
  void put_on_screen(const image<rgb>& picture) {
    desktop_.present([&] {
      picture_->set(picture);
      picture_->draw();
    });
    is_lost_ = false;
    filming([&](recording& film) { record(picture, film); });
  }
  /// A film that fails has ended.
  void filming(auto&& call) {
    if (!film_) return;
    try {
      call(*film_);
    } catch (...) {
      film_.reset();
      throw;
    }
  }

  void record(const image<rgb>& picture, recording& film) {
    if (picture.width() == film.width() && picture.height() == film.height()) {
      film.add(picture);
    } else {
      auto options = drawing();
      options.width = film.width();
      options.height = film.height();
      film.add(render(shown_, seen(), options));
    }
  }
  /// As it is wanted, but for what a window has become too large for.
  [[nodiscard]] render_options drawing() const {
    auto options = drawing_;
    const auto [width, height] = desktop_.size_in_pixels();
    while (options.supersampling > 1 &&
           index_t(width) * height * options.supersampling * options.supersampling >
               detail::most_pixels)
      --options.supersampling;
    return options;
  }

  void handle(const mouse_pressed& what) { mouse_.press(what, seen()); }
  void handle(const mouse_moved& what) {
    if (const auto dragged = mouse_.move(what, scale())) set_view(*dragged);
  }
  void handle(const mouse_released& what) {
    const auto click = mouse_.release(what);
    const auto action = pick_action_;
    if (click == mouse::click::none || (click == mouse::click::single && !action)) return;
    const auto found = picked_at(what.at);
    if (!found) return;
    if (click == mouse::click::twice)
      set_view(centered_on(seen(), found->place));
    else
      action(*found);
  }
  void handle(const wheel_turned& what) {
    const view now = seen();
    const auto in_pixels = scale();
    // A plane is enlarged where the mouse is, a space where it is turned around.
    change_view(mouse_.can_turn() || !now.orthographic
                    ? zoomed(now, what.steps)
                    : zoomed_at(now, what.steps, mouse_.place().x * in_pixels.pixels_right,
                                mouse_.place().y * in_pixels.pixels_down));
  }
  void say_what_is_under_the_mouse() {
    if (!hover_action_ || mouse_.is_down() || !mouse_.take_moved()) return;
    // A copy, since it may set another one.
    const auto action = hover_action_;
    action(picked_at(mouse_.place()));
  }
  [[nodiscard]] std::optional<picked> picked_at(const mouse_place& at) {
    const auto in_pixels = scale();
    return pick(shown_, seen(), std::floor(at.x * in_pixels.pixels_right),
                std::floor(at.y * in_pixels.pixels_down), {.threads = drawing_.threads});
  }
  [[nodiscard]] mouse_scale scale() const {
    const auto size = desktop_.size(), pixels = desktop_.size_in_pixels();
    return {double(pixels.width) / size.width, double(pixels.height) / size.height,
            double(size.width)};
  }

  void handle(const key_pressed& what) {
    if (const auto own = actions_.find(what.pressed); own != actions_.end()) {
      // A copy, since it may set another one.
      if (const auto action = own->second) action();
      return;
    }
    if (key::digit_1 <= what.pressed && what.pressed <= key::digit_9) {
      hide_or_show(index_t(what.pressed) - index_t(key::digit_1));
      return;
    }
    switch (what.pressed) {
      case key::r:
        change_view(fit(current(), fitting()));
        break;
      case key::o:
        change_rays();
        break;
      case key::e:
        drawing_.edges = drawing_.edges > 0 ? 0 : edges_;
        break;
      case key::b:
        drawing_.blend = !drawing_.blend;
        break;
      case key::l:
        drawing_.labels = drawing_.legends = !(drawing_.labels || drawing_.legends);
        break;
      case key::q:
      case key::escape:
        close();
        break;
      default:
        return;
    }
    note_change();
  }
  void hide_or_show(index_t number) {
    const auto layers = current().layers();
    if (number >= std::ssize(layers)) return;
    const std::string name = layers[number].name;
    const bool hide = !layers[number].is_hidden;
    hidden_by_keys_[name] = hide;
    shown_.hide(name, hide);
    note_change();
  }
  void change_rays() {
    const view now = seen();
    const double smaller = std::min(now.camera.width, now.camera.height);
    if (!now.orthographic) {
      focal_share_ = now.camera.fx / smaller;
      change_view(by_parallel_rays(now));
    } else {
      change_view(from_an_eye(now, focal_share_ * smaller));
    }
  }
  void handle(const picture_lost&) { is_lost_ = true; }
  void handle(const close_wanted&) { close(); }

  std::thread::id owner_ = std::this_thread::get_id();
  render_options drawing_;
  double edges_ = drawing_.edges > 0 ? drawing_.edges : render_options{}.edges;
  desktop_window desktop_;
  std::optional<gl_functions> gl_;
  std::optional<picture_texture> picture_;
  std::optional<graphics_card> card_;
  bool may_change_renderer_ = false;
  pace pace_;
  coarse_drawing coarse_;
  bool is_as_wanted_ = true;  ///< Whether the last picture needs no finer one.
  background_picture fine_picture_{desktop_window::wake};
  bool is_open_ = true, is_fitted_ = false, is_lost_ = false;
  desktop_window::extent drawn_size_{};

  std::mutex pending_mutex_;
  std::optional<scene> pending_;  ///< Guarded by the mutex.
  scene shown_;
  std::map<std::string, bool> hidden_by_keys_;

  view from_;
  /// Focal length by the smaller side of the picture, of the last view that was not by parallel
  /// rays.
  double focal_share_ = 0.5 / std::tan(view_options{}.field_of_view / 2);
  mouse mouse_;
  std::map<key, std::function<void()>> actions_;
  std::function<void(const picked&)> pick_action_;
  std::function<void(const std::optional<picked>&)> hover_action_;
  std::optional<recording> film_;
};

bool can_open_window() {
  try {
    desktop_window probe{"cilantro", 1, 1, false};
    probe.with_context([] {
      const gl_functions gl{desktop_window::function_of_gl};
      picture_texture{gl};
    });
    return true;
  } catch (const window_error&) {
    return false;
  }
}

window::window(scene first, const window_options& options)
    : screen_{std::make_unique<screen>(std::move(first), checked(options))} {}
window::window(window&&) noexcept = default;
window& window::operator=(window&&) noexcept = default;
window::~window() = default;

window::screen& window::existing(const char* call) const {
  expects(screen_ != nullptr, std::string{"window: "} + call + " of a window that was moved from");
  return *screen_;
}
window::screen& window::own(const char* call) const {
  existing(call).expect_own_thread(call);
  return *screen_;
}
bool window::update() {
  return own("update").update();
}
void window::wait() {
  own("wait").wait();
}
void window::wait_for_change() {
  own("wait_for_change").wait_for_change();
}
void window::close() {
  own("close").close();
}
void window::show(scene next) {
  existing("show").show(std::move(next));
}
scene window::current() const {
  return own("current").current();
}
view window::seen() const {
  return own("seen").seen();
}
void window::look(const view& from) {
  own("look").look(from);
}
void window::on(key pressed, std::function<void()> action) {
  own("on").on(pressed, std::move(action));
}
void window::on_pick(std::function<void(const picked&)> action) {
  own("on_pick").on_pick(std::move(action));
}

void window::on_hover(std::function<void(const std::optional<picked>&)> action) {
  own("on_hover").on_hover(std::move(action));
}
void window::set_title(const std::string& title) {
  own("set_title").set_title(title);
}
void window::record(const std::filesystem::path& path, const video_options& options) {
  own("record").record(path, options);
}
void window::stop_recording() {
  own("stop_recording").stop_recording();
}
renderer window::drawn_by() const {
  return own("drawn_by").drawn_by();
}
bool window::is_recording() const {
  return own("is_recording").is_recording();
}

void show(const scene& all, const window_options& options) {
  window{all, options}.wait();
}

}  // namespace cilantro
