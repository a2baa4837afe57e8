// SPDX-License-Identifier: MIT
//
// Windows, held against what is on the screen.
#include <doctest/doctest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

import window_support;
import cilantro.window;

using namespace cilantro;

namespace {

const window_options small{.title = "small", .width = 400, .height = 300};

}  // namespace

TEST_CASE("what is on the screen is what render draws, pixel by pixel") {
  for (const render_options& drawing :
       {render_options{}, render_options{.background = {250, 250, 240}, .supersampling = 2},
        render_options{.blend = false, .edges = 0, .legends = false}}) {
    window w{some_scene(), {.title = "pixels", .width = 640, .height = 480, .drawing = drawing}};
    CHECK(w.seen().camera.width == 640);
    CHECK(w.seen().camera.height == 480);
    CHECK(are_same(w.seen(), fit(some_scene(), {.width = 640, .height = 480})));
    CHECK(eventually([&] { return is_on_screen(w, drawing); }, w));
  }
}

TEST_CASE("another size shows the same view, scaled") {
  window w{some_scene(), {.title = "size", .width = 640, .height = 480}};
  const view first = w.seen();
  REQUIRE(eventually([&] { return is_on_screen(w); }, w));
  for (const auto& [width, height] :
       std::vector<std::pair<int, int>>{{900, 480}, {333, 500}, {640, 480}}) {
    REQUIRE(while_person_does(w, at_window("size") + "windowsize %1 " + std::to_string(width) +
                                     " " + std::to_string(height)));
    REQUIRE(eventually(
        [&] { return w.seen().camera.width == width && w.seen().camera.height == height; }, w));
    CHECK(eventually([&] { return is_on_screen(w); }, w));
    CHECK(render(w.current(), w.seen()) ==
          render(w.current(), first, {.width = width, .height = height}));
  }
  CHECK(are_same(w.seen(), first));
}

TEST_CASE("the first scene that is not empty is fitted, and later ones are seen from there") {
  window w{{}, small};
  w.update();
  w.show(scene{});
  w.update();
  w.show(some_scene());
  const view first = w.seen();
  CHECK(are_same(first, fit(some_scene(), {.width = 400, .height = 300})));
  w.show(some_scene(2));
  CHECK(are_same(w.seen(), first));
  CHECK(w.current().layers()[0].content->bounds().max().z() > 1);
  CHECK(eventually([&] { return is_on_screen(w); }, w));
}

TEST_CASE("a view that was looked at stays, also for the first scene") {
  window w{{}, small};
  const view mine = look_at({3, 0, 2}, {0, 0, 0}, {0, 0, 1}, {.width = 400, .height = 300});
  w.look(mine);
  w.show(some_scene());
  CHECK(are_same(w.seen(), mine));
  CHECK(eventually([&] { return is_on_screen(w); }, w));
}

TEST_CASE("two windows at once show two scenes") {
  window a{some_scene(), {.title = "one", .width = 400, .height = 300}};
  window b{some_scene(1), {.title = "other", .width = 500, .height = 200}};
  REQUIRE(person_does(at_window("other") + "windowmove %1 600 400"));
  CHECK(eventually([&] { return is_on_screen(a) && is_on_screen(b, {}, 600, 400); }, a, b));
  a.close();
  CHECK(!a.update());
  CHECK(b.update());
}

TEST_CASE("twenty windows in turn") {
  for (int i = 0; i < 20; ++i) {
    window w{some_scene(0.1 * i), small};
    REQUIRE(eventually([&] { return is_on_screen(w); }, w));
  }
}

TEST_CASE("a window may be moved, and keeps what it was told") {
  std::vector<window> all;
  {
    window w{some_scene(), small};
    w.update();
    all.push_back(std::move(w));
  }
  all.emplace_back(some_scene(), window_options{.title = "moved", .width = 300, .height = 300});
  all.erase(all.begin());
  bool is_pressed = false;
  all[0].on(key::s, [&] { is_pressed = true; });
  REQUIRE(while_person_does(all[0],
                            at_window("moved") + "mousemove --window %1 100 100 key --window 0 s"));
  CHECK(eventually([&] { return is_pressed; }, all[0]));
}

TEST_CASE("a window is closed by close, and stays so") {
  window w{some_scene(), small};
  CHECK(w.update());
  w.close();
  CHECK(!w.update());
  w.show(some_scene(1));
  CHECK(!w.update());
  w.wait();
}

TEST_CASE("a window may go while a picture of it is drawn") {
  for (int i = 0; i < 3; ++i) {
    window w{some_scene(), {.width = 640, .height = 480, .drawing = {.supersampling = 8}}};
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds{200};
    while (std::chrono::steady_clock::now() < end) w.update();
  }
}

TEST_CASE("a step shows a cloud until the window is closed, and hands it on") {
  // No other thread has windows: a person closes the one that is there.
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Random(3, 200)};
  const auto before = cloud.points;
  person_closes("scan",
                [&] { cloud = std::move(cloud) | show("scan", {.color = rgb{255, 0, 0}}); });
  CHECK(cloud.points == before);
  person_closes("all of it", [&] { show(some_scene(), {.title = "all of it"}); });
}

TEST_CASE("the title is that of the options, or the names of the layers") {
  const window w{some_scene(), {.width = 300, .height = 200}};
  CHECK(person_does(at_window("sheet, box, text") + "getwindowname %1"));
}

TEST_CASE("options that make no sense are refused") {
  CHECK_THROWS_AS((window{{}, {.width = 0}}), invalid_input);
  CHECK_THROWS_AS((window{{}, {.height = 1 << 20}}), invalid_input);
  CHECK_THROWS_AS((window{{}, {.drawing = {.width = 100, .height = 100}}}), invalid_input);
  CHECK_THROWS_AS((window{{}, {.drawing = {.supersampling = 9}}}), invalid_input);
  CHECK_THROWS_AS((window{{}, {.drawing = {.monitor = {.progress = [](double) {}}}}}),
                  invalid_input);
  window w{some_scene(), small};
  view wrong = w.seen();
  wrong.up = wrong.ahead();
  CHECK_THROWS_AS(w.look(wrong), invalid_input);
  wrong = w.seen();
  wrong.distance = 0;
  CHECK_THROWS_AS(w.look(wrong), invalid_input);
}

TEST_CASE("what was moved from says so, and a film that has ended may be stopped") {
  window first{some_scene(), small};
  window second = std::move(first);
  CHECK_THROWS_AS(first.update(), invalid_input);
  CHECK_THROWS_AS(first.show(scene{}), invalid_input);
  CHECK_THROWS_AS((void)first.seen(), invalid_input);
  CHECK_THROWS_AS(first.close(), invalid_input);
  CHECK_THROWS_AS((void)first.drawn_by(), invalid_input);
  CHECK(second.update());
  second.stop_recording();
  first = std::move(second);
  CHECK(first.update());

  image_viewer one{small};
  image_viewer other = std::move(one);
  CHECK_THROWS_AS(one.update(), invalid_input);
  CHECK_THROWS_AS(one.show(image<rgb>(3, 2)), invalid_input);
  CHECK(other.update());
}

TEST_CASE("a wait ends at once if there is something to do, whoever noted it") {
  window a{some_scene(), {.title = "a", .width = 200, .height = 100}};
  window b{some_scene(), {.title = "b", .width = 200, .height = 100}};
  // Until both have drawn all that there is.
  const auto first = std::chrono::steady_clock::now();
  eventually([&] { return std::chrono::steady_clock::now() - first > std::chrono::seconds{1}; }, a,
             b);
  a.show(some_scene(0.5));
  b.update();  // Which takes notice of all events.
  const auto begin = std::chrono::steady_clock::now();
  a.wait_for_change();
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds{5});  // Not ten.
}

TEST_CASE("a window that becomes too large for its supersampling goes on") {
  window w{some_scene(),
           {.title = "large", .width = 200, .height = 100, .drawing = {.supersampling = 8}}};
  w.update();
  REQUIRE(while_person_does(w, at_window("large") + "windowsize %1 1500 900"));
  CHECK(eventually(
      [&] { return w.seen().camera.width == 1500 && is_on_screen(w, {.supersampling = 7}); }, w));
}
