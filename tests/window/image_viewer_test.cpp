// SPDX-License-Identifier: MIT
//
// Images on the screen, and films of windows.
#include <doctest/doctest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

import window_support;
import test_support;
import cilantro.window;

using namespace cilantro;

namespace {

image<std::uint16_t> ramp(int width, int height) {
  image<std::uint16_t> depth(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) depth(x, y) = std::uint16_t(1000 + x + 7 * y);
  return depth;
}

/// The frames of a film in YUV4MPEG2, by their luminance.
std::vector<std::string> frames_of(const std::filesystem::path& path, int width, int height) {
  std::ifstream file{path, std::ios::binary};
  const std::string text{std::istreambuf_iterator<char>{file}, {}};
  std::vector<std::string> frames;
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  for (auto at = text.find("FRAME\n"); at < text.size(); at += 6 + 3 * pixels)
    frames.push_back(text.substr(at + 6, pixels));
  return frames;
}

}  // namespace

TEST_CASE(
    "an image is on the screen pixel by pixel, and the title says the value under the mouse") {
  const auto depth = ramp(400, 300);
  image_viewer viewer{{.width = 400, .height = 300, .drawing = {.legends = false}}};
  viewer.show(depth, {.map = viridis, .title = "millimetres"});
  window& w = viewer.on_screen();
  REQUIRE(eventually([&] { return is_on_screen(w, {.legends = false}); }, viewer));
  const auto expected = render(depth, {.map = viridis}, {.legends = false});
  CHECK(on_screen(0, 0, 400, 300) == expected);

  const auto title = [] {
    return answer_of("search --onlyvisible --name '^(image|millimetres)' getwindowname %1");
  };
  REQUIRE(while_person_does(
      viewer, "search --onlyvisible --name '^(image|millimetres)' mousemove --window %1 123 45"));
  CHECK(eventually([&] { return title() == "millimetres (123, 45): 1438"; }, viewer));

  // Of colours, from another thread, in another size: as large as there is room for.
  image<rgb> colors(40, 30);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) colors(x, y) = {std::uint8_t(x), std::uint8_t(y), 9};
  viewer.show(colors);
  REQUIRE(while_person_does(
      viewer, "search --onlyvisible --name '^(image|millimetres)' mousemove --window %1 205 115"));
  CHECK(eventually([&] { return title() == "image (20, 11): 20, 11, 9"; }, viewer));
  CHECK(on_screen(205, 115, 1, 1)(0, 0) == rgb{20, 11, 9});
}

TEST_CASE("an image is moved and made larger, and not turned") {
  image_viewer viewer{{.title = "still", .width = 400, .height = 300}};
  viewer.show(ramp(400, 300));
  window& w = viewer.on_screen();
  viewer.update();
  const view first = w.seen();
  REQUIRE(while_person_does(viewer,
                            "search --onlyvisible --name '^still' mousemove --window %1 100 100 "
                            "mousedown 1 mousemove --window %1 130 80 mouseup 1"));
  CHECK(eventually([&] { return are_same(w.seen(), pan(first, {.right = 30, .down = -20})); },
                   viewer));
  // The wheel enlarges where the mouse is, and the title follows.
  const auto title = [] {
    return answer_of("search --onlyvisible --name '^still' getwindowname %1");
  };
  REQUIRE(eventually([&] { return title() == "still (100, 100): 1800"; }, viewer));
  REQUIRE(while_person_does(viewer,
                            "search --onlyvisible --name '^still' mousemove --window %1 40 50"));
  REQUIRE(eventually([&] { return title() == "still (10, 70): 1500"; }, viewer));
  REQUIRE(while_person_does(viewer, "click --repeat 9 4"));
  CHECK(eventually([&] { return w.seen().camera.fx > 2 * first.camera.fx; }, viewer));
  CHECK(title() == "still (10, 70): 1500");
  w.look(first);
  CHECK(eventually([&] { return title() == "still (40, 50): 1390"; }, viewer));
  CHECK_THROWS_AS(viewer.show(image<rgb>{}), invalid_input);
}

TEST_CASE("what is on the screen becomes a film, which ends when it is told or the window closes") {
  const test::temporary_folder folder;
  window w{some_scene(), {.title = "filmed", .width = 320, .height = 200}};
  const view first = w.seen();
  w.update();
  w.stop_recording();  // There is none, which is no harm.
  CHECK_THROWS_AS(w.record(folder / "film.avi"), invalid_input);
  CHECK_FALSE(w.is_recording());

  w.record(folder / "film.y4m", {.frames_per_second = 50});
  CHECK(w.is_recording());
  CHECK_THROWS_AS(w.record(folder / "other.y4m"), invalid_input);
  const auto begin = std::chrono::steady_clock::now();
  for (const view& v : turntable(first, 8)) {
    w.look(v);
    w.update();
  }
  eventually(
      [&] { return std::chrono::steady_clock::now() - begin > std::chrono::milliseconds{300}; }, w);
  REQUIRE(eventually([&] { return is_on_screen(w); }, w));
  w.stop_recording();
  CHECK_FALSE(w.is_recording());
  const auto frames = frames_of(folder / "film.y4m", 320, 200);
  CHECK(frames.size() >= 15);
  // The last one is what is on the screen: of the last view, drawn finely.
  write_video(w.current(), std::vector{w.seen()}, folder / "last.y4m");
  CHECK(frames.back() == frames_of(folder / "last.y4m", 320, 200).at(0));

  w.record(folder / "closed.y4m");
  w.close();
  CHECK_FALSE(w.update());
  CHECK(frames_of(folder / "closed.y4m", 320, 200).size() >= 1);
  {
    window given_up{some_scene(), {.title = "given up", .width = 320, .height = 200}};
    given_up.record(folder / "given_up.y4m");
  }
  CHECK(folder.count() == 3);
}
