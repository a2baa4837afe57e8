// SPDX-License-Identifier: MIT
//
// What the mouse does, by a mouse.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

import window_support;
import cilantro.window;

using namespace cilantro;

namespace {

constexpr double pi = std::numbers::pi;
const window_options wide{.title = "mouse", .width = 1000, .height = 600};

/// Presses a button at (300, 300), moves the mouse, and lets go.
std::string drag(int button, int right, int down, const std::string& held = "") {
  const auto at = [](int x, int y) {
    return "mousemove --window %1 " + std::to_string(x) + " " + std::to_string(y) + " ";
  };
  const std::string number = std::to_string(button);
  return at_window("mouse") + at(300, 300) +
         (held.empty() ? "" : "keydown --window 0 " + held + " ") + "mousedown --window 0 " +
         number + " " + at(300 + right / 2, 300 + down) + at(300 + right, 300 + down) +
         "mouseup --window 0 " + number + (held.empty() ? "" : " keyup --window 0 " + held);
}

}  // namespace

TEST_CASE("a drag with the left button turns by half a circle a width") {
  window w{some_scene(), wide};
  const view first = w.seen();
  REQUIRE(while_person_does(w, drag(1, 100, 0)));
  const view right = orbit(first, {.right = -0.1 * pi});
  CHECK(eventually([&] { return are_same(w.seen(), right); }, w));
  CHECK(eventually([&] { return is_on_screen(w); }, w));
  REQUIRE(while_person_does(w, drag(1, -40, 60)));
  const view up = orbit(right, {.right = 0.04 * pi, .up = 0.06 * pi});
  CHECK(eventually([&] { return are_same(w.seen(), up); }, w));
}

TEST_CASE("a drag with the right button, or with shift, moves what is seen along") {
  for (const auto& [button, held] : {std::pair{3, ""}, std::pair{2, ""}, std::pair{1, "shift"}}) {
    window w{some_scene(), wide};
    const view first = w.seen();
    REQUIRE(while_person_does(w, drag(button, 70, -30, held)));
    CHECK(
        eventually([&] { return are_same(w.seen(), pan(first, {.right = 70, .down = -30})); }, w));
  }
}

TEST_CASE("the wheel makes it a tenth larger, or smaller") {
  window w{some_scene(), wide};
  const view first = w.seen();
  REQUIRE(while_person_does(
      w,
      at_window("mouse") + "mousemove --window %1 300 300 click --window 0 4 click --window 0 4"));
  CHECK(eventually([&] { return are_same(w.seen(), zoom(first, 1.1 * 1.1)); }, w));
  REQUIRE(while_person_does(w, at_window("mouse") + "click --window 0 5 click --window 0 5"));
  CHECK(eventually([&] { return are_same(w.seen(), first); }, w));
}

TEST_CASE("a wheel that is turned during a drag does not end it") {
  window w{some_scene(), wide};
  const view first = w.seen();
  REQUIRE(while_person_does(
      w, at_window("mouse") +
             "mousemove --window %1 300 300 mousedown --window 0 1 mousemove --window %1 350 300 "
             "click 4 mousemove --window %1 400 300 mouseup --window 0 1"));
  const view then = orbit(zoom(orbit(first, {.right = -0.05 * pi}), 1.1), {.right = -0.05 * pi});
  CHECK(eventually([&] { return are_same(w.seen(), then); }, w));
}

TEST_CASE("a click says what was clicked, and turns nothing") {
  window w{some_scene(), wide};
  const view first = w.seen();
  std::optional<picked> found;
  w.on_pick([&](const picked& what) { found = what; });
  REQUIRE(eventually([&] { return is_on_screen(w); }, w));
  // By a hand that is not quite still.
  REQUIRE(while_person_does(w, at_window("mouse") +
                                   "mousemove --window %1 479 309 mousedown --window 0 1 "
                                   "mousemove --window %1 480 310 mouseup --window 0 1"));
  REQUIRE(eventually([&] { return found.has_value(); }, w));
  const auto expected = pick(w.current(), first, 480, 310);
  REQUIRE(expected);
  CHECK(found->layer == "sheet");
  CHECK(found->index == expected->index);
  CHECK(found->place == expected->place);
  CHECK(are_same(w.seen(), first));

  // The background is nothing.
  found.reset();
  bool is_handled = false;
  w.on(key::x, [&] { is_handled = true; });
  REQUIRE(while_person_does(
      w, at_window("mouse") + "mousemove --window %1 5 590 click --window 0 1 key --window 0 x"));
  REQUIRE(eventually([&] { return is_handled; }, w));
  CHECK(!found);
}

TEST_CASE("a double click brings what was clicked into the middle, where it is turned around") {
  window w{some_scene(), wide};
  const auto clicked = pick(w.current(), w.seen(), 560, 330);
  REQUIRE(clicked);
  const view first = w.seen();
  REQUIRE(while_person_does(
      w, at_window("mouse") +
             "mousemove --window %1 560 330 click --window 0 --repeat 2 --delay 20 1"));
  const auto error = [&] {
    const view now = w.seen();
    return (now.eye() + now.distance * now.ahead() - clicked->place).norm();
  };
  CHECK(eventually([&] { return error() < 1e-9; }, w));
  CHECK(w.seen().ahead().isApprox(first.ahead()));
}

TEST_CASE("what a callback throws comes from update, and the window goes on") {
  window w{some_scene(), wide};
  w.on_pick([](const picked&) { throw std::runtime_error{"not this one"}; });
  REQUIRE(person_does(
      at_window("mouse") +
      "mousemove --window %1 480 310 click --window 0 1 mousemove --window %1 490 320"));
  std::string said;
  CHECK(eventually([&] {
    try {
      w.update();
    } catch (const std::runtime_error& error) {
      said = error.what();
    }
    return !said.empty();
  }));
  CHECK(said == "not this one");
  CHECK(w.update());
}
