// SPDX-License-Identifier: MIT
//
// Windows on the display that on_display.sh made, and who sits in front of it.
module;
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <vector>
export module window_support;

import cilantro.window;
using namespace cilantro;

/// Moves the mouse and presses keys as a person would, by xdotool. %1 is the window that was found
/// last.
export bool person_does(const std::string& what) {
  return std::system(("timeout 60 xdotool " + what + " > /dev/null").c_str()) == 0;
}
/// The first line of what xdotool says.
export std::string answer_of(const std::string& question) {
  std::FILE* const says = ::popen(("timeout 60 xdotool " + question).c_str(), "r");
  std::array<char, 256> line{};
  if (!std::fgets(line.data(), int(line.size()), says)) line[0] = '\0';
  ::pclose(says);
  const std::string answer{line.data()};
  return answer.substr(0, answer.find('\n'));
}
/// Lays out the keyboard as in a country, by what Xvfb depends on.
export bool has_keyboard(const std::string& country) {
  return std::system(("setxkbmap " + country).c_str()) == 0;
}
/// Finds the window of that title, once it is there.
export std::string at_window(const std::string& title) {
  return "search --sync --onlyvisible --name '^" + title + "$' ";
}

/// Updates the windows until something holds, or for two minutes: a look may take ten seconds where
/// each access is checked.
export template <class F, class... Windows>
bool eventually(F&& holds, Windows&... windows) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{120};
  while (!holds()) {
    (windows.update(), ...);
    if (std::chrono::steady_clock::now() > end) return false;
  }
  return true;
}
/// Updates a window while a person does something, and until what was done has arrived.
export template <class Window>
bool while_person_does(Window& w, const std::string& what) {
  auto done = std::async(std::launch::async, [&] { return person_does(what); });
  eventually([&] { return done.wait_for(std::chrono::seconds{0}) == std::future_status::ready; },
             w);
  return done.get();
}

/// A part of the screen, as large as what is rendered; its top left corner is at (left, top).
export image<rgb> on_screen(int left, int top, int width, int height) {
  std::ifstream file{std::getenv("CILANTRO_SCREEN"), std::ios::binary};
  std::vector<char> bytes(std::filesystem::file_size(std::getenv("CILANTRO_SCREEN")));
  file.read(bytes.data(), std::streamsize(bytes.size()));
  const auto byte = [&](std::size_t at) { return static_cast<std::uint8_t>(bytes[at]); };
  // The header is 25 numbers of four bytes, the most significant first.
  const auto number = [&](std::size_t k) {
    std::size_t value = 0;
    for (std::size_t i = 4 * k; i < 4 * k + 4; ++i) value = value << 8 | byte(i);
    return value;
  };
  const std::size_t header = number(0), stride = number(12), colors = number(19);
  image<rgb> result{width, height};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::size_t at =
          header + 12 * colors + std::size_t(top + y) * stride + 4 * std::size_t(left + x);
      result(x, y) = {byte(at + 2), byte(at + 1), byte(at)};
    }
  return result;
}
/// Whether the screen shows what `render` draws of the window, pixel by pixel.
export bool is_on_screen(const window& w, const render_options& drawing = {}, int left = 0,
                         int top = 0) {
  const auto expected = render(w.current(), w.seen(), drawing);
  return on_screen(left, top, expected.width(), expected.height()) == expected;
}

/// A wavy sheet of points in the colours of their heights, an edge of a box and a text.
export scene some_scene(double height = 0.2) {
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf(3, 5000)};
  random_stream random{7};
  for (auto p : cloud.points.colwise()) {
    p << float(random.uniform(-1, 1)), float(random.uniform(-1, 1)), 0;
    p.z() = float(height) * std::sin(4 * p.x()) * std::cos(5 * p.y());
  }
  scene all;
  all.set("sheet", cloud, cloud_look{.color = by_coordinate{2}})
      .set("box", box_lines({Eigen::Vector3d{-1, -1, -0.3}, Eigen::Vector3d{1, 1, 0.3}}))
      .set("text", label{"here", {-0.5, -0.4, 0.3}});
  return all;
}

/// Whether two views are the same, but for the last digits.
export bool are_same(const view& a, const view& b, double tolerance = 1e-9) {
  const auto differ = [&](double x, double y) {
    return !(std::abs(x - y) <= tolerance * std::max(1.0, std::abs(x)));
  };
  return (a.camera.to_world.matrix() - b.camera.to_world.matrix()).norm() <= tolerance &&
         a.camera.width == b.camera.width && a.camera.height == b.camera.height &&
         !differ(a.camera.fx, b.camera.fx) && !differ(a.camera.fy, b.camera.fy) &&
         !differ(a.camera.cx, b.camera.cx) && !differ(a.camera.cy, b.camera.cy) &&
         !differ(a.distance, b.distance) && a.orthographic == b.orthographic;
}

/// Runs what opens a window, and meanwhile closes it by a key.
export void person_closes(const std::string& title, auto&& opens) {
  auto done = std::async(std::launch::async, [&] {
    return person_does(at_window(title) + "mousemove --window %1 100 100 key --window 0 q");
  });
  opens();
  done.get();
}

/// Asks a window to close, as a desktop does when its cross is clicked.
export bool desktop_closes(const std::string& title) {
  return std::system(
             ("python3 -B " CILANTRO_CLOSE_WINDOW " $(timeout 60 xdotool " + at_window(title) + ")")
                 .c_str()) == 0;
}
