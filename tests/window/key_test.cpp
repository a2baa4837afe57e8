// SPDX-License-Identifier: MIT
//
// What keys do, by keys.
#include <doctest/doctest.h>

#include <stdexcept>
#include <string>
#include <vector>

import window_support;
import cilantro.window;

using namespace cilantro;

namespace {

const window_options options{.title = "keys", .width = 500, .height = 400};

std::string press(const std::string& keys) {
  return at_window("keys") + "mousemove --window %1 200 200 key --window 0 --delay 20 " + keys;
}

}  // namespace

TEST_CASE("r shows all of it again") {
  window w{some_scene(), options};
  const view first = w.seen();
  w.look(zoom(orbit(first, {.right = 1, .up = -0.2}), 3));
  REQUIRE(while_person_does(w, press("r")));
  CHECK(eventually([&] { return are_same(w.seen(), first); }, w));
}

TEST_CASE("o makes rays parallel, and what is looked at keeps its size, there and back") {
  window w{some_scene(), options};
  const view first = w.seen();
  REQUIRE(while_person_does(w, press("o")));
  REQUIRE(eventually([&] { return w.seen().orthographic; }, w));
  CHECK(w.seen().camera.fx * first.distance == doctest::Approx(first.camera.fx));
  CHECK(eventually([&] { return is_on_screen(w); }, w));
  REQUIRE(
      while_person_does(w, at_window("keys") + "mousemove --window %1 200 200 click --window 0 4"));
  REQUIRE(while_person_does(w, press("o")));
  REQUIRE(eventually([&] { return !w.seen().orthographic; }, w));
  CHECK(are_same(w.seen(), zoom(first, 1.1)));
}

TEST_CASE("e, b and l take edges, mixing and texts away, and bring them back") {
  window w{some_scene(), options};
  for (const auto& [name, drawing] : std::vector<std::pair<std::string, render_options>>{
           {"e", {.edges = 0}},
           {"b", {.blend = false}},
           {"l", {.labels = false, .legends = false}}}) {
    REQUIRE(while_person_does(w, press(name)));
    CHECK(eventually([&] { return is_on_screen(w, drawing); }, w));
    REQUIRE(while_person_does(w, press(name)));
    CHECK(eventually([&] { return is_on_screen(w); }, w));
  }
}

TEST_CASE("a digit hides a layer, also of later scenes, and shows it again") {
  window w{some_scene(), options};
  const auto is_hidden = [&] { return w.current().layers()[1].is_hidden; };
  REQUIRE(while_person_does(w, press("2 7")));
  CHECK(eventually(is_hidden, w));
  CHECK(!w.current().layers()[0].is_hidden);
  w.show(some_scene(1));
  CHECK(is_hidden());
  CHECK(eventually([&] { return is_on_screen(w); }, w));
  w.show(scene{}.set("another", label{"a", {0, 0, 0}}));
  w.update();
  w.show(some_scene());
  REQUIRE(while_person_does(w, press("2")));
  CHECK(eventually([&] { return !is_hidden(); }, w));
}

TEST_CASE("q and Escape close the window, and so does the desktop") {
  for (const std::string& name : {"q", "Escape"}) {
    window w{some_scene(), options};
    REQUIRE(while_person_does(w, press(name)));
    CHECK(eventually([&] { return !w.update(); }));
  }
  window w{some_scene(), options};
  w.update();
  REQUIRE(desktop_closes("keys"));
  CHECK(eventually([&] { return !w.update(); }));
}

TEST_CASE("keys do what they are told to, in the order in which they are pressed") {
  window w{some_scene(), options};
  std::string pressed;
  w.on(key::s, [&] { pressed += "s"; });
  w.on(key::q, [&] { pressed += "q"; });  // Instead of closing.
  w.on(key::left, [&] { pressed += "<"; });
  w.on(key::f5, [&] {
    pressed += "5";
    w.on(key::f5, [&] { pressed += "6"; });
  });
  w.on(key::space, [&] { pressed += "_"; });
  w.on(key::digit_1, [&] { pressed += "1"; });
  w.on(key::minus, [&] { pressed += "-"; });
  w.on(key::escape, {});
  REQUIRE(
      while_person_does(w, press("s q Escape Left F5 F5 space ctrl+s alt+s KP_1 1 minus shift+s")));
  CHECK(eventually([&] { return pressed == "sq<56_11-s"; }, w));
  CHECK(pressed == "sq<56_11-s");
  CHECK(!w.current().layers()[0].is_hidden);
}

TEST_CASE("keys are meant by what is written on them, and digits also where these need Shift") {
  REQUIRE(has_keyboard("fr"));
  {
    window w{some_scene(), options};
    std::string pressed;
    w.on(key::a, [&] { pressed += "a"; });
    w.on(key::q, [&] { pressed += "q"; });
    w.on(key::m, [&] { pressed += "m"; });
    w.on(key::digit_1, [&] { pressed += "1"; });
    REQUIRE(while_person_does(w, press("a q m ampersand")));
    CHECK(eventually([&] { return pressed.size() == 4; }, w));
    CHECK(pressed == "aqm1");
  }
  REQUIRE(has_keyboard("us"));
}

TEST_CASE("what a key throws comes from update, and what was pressed after it is not lost") {
  window w{some_scene(), options};
  bool is_pressed = false;
  w.on(key::x, [] { throw std::runtime_error{"no such key"}; });
  w.on(key::y, [&] { is_pressed = true; });
  REQUIRE(person_does(press("x y")));
  bool is_thrown = false;
  CHECK(eventually([&] {
    try {
      w.update();
    } catch (const std::runtime_error&) {
      is_thrown = true;
    }
    return is_thrown && is_pressed;
  }));
}

TEST_CASE("a callback may close its window, or show another scene") {
  window w{some_scene(), options};
  w.on(key::n, [&] { w.show(some_scene(1)); });
  w.on(key::c, [&] { w.close(); });
  REQUIRE(while_person_does(w, press("n")));
  CHECK(eventually([&] { return w.current().layers()[0].content->bounds().max().z() > 0.5; }, w));
  REQUIRE(while_person_does(w, press("c")));
  CHECK(eventually([&] { return !w.update(); }));
}
