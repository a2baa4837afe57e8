// SPDX-License-Identifier: MIT
//
// Windows and threads, and windows that wait.
#include <doctest/doctest.h>
#include <sys/resource.h>

#include <chrono>
#include <string>
#include <thread>

import window_support;
import cilantro.window;

using namespace cilantro;

namespace {

const window_options small{.title = "threads", .width = 300, .height = 200};

double processor_seconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return double(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * double(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

}  // namespace

TEST_CASE("another thread shows a thousand scenes while the window is updated") {
  window w{{}, small};
  const scene last = some_scene(0.5);
  std::jthread other{[&] {
    const scene one = some_scene();
    for (int i = 0; i < 999; ++i) w.show(one);
    w.show(last);
  }};
  CHECK(eventually(
      [&] {
        return w.current().layers().size() == 3 &&
               w.current().layers()[0].content.get() == last.layers()[0].content.get();
      },
      w));
  CHECK(eventually([&] { return is_on_screen(w); }, w));
}

TEST_CASE("a scene from another thread ends a wait") {
  window w{{}, small};
  const scene next = some_scene();
  const auto expected = render(next, fit(next, {.width = 300, .height = 200}));
  bool is_shown = false;
  std::jthread other{[&] {
    std::this_thread::sleep_for(std::chrono::milliseconds{500});
    w.show(next);
    // A wait without an event would last longer.
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{8};
    while (!is_shown && std::chrono::steady_clock::now() < end)
      is_shown = on_screen(0, 0, 300, 200) == expected;
    person_does(at_window("threads") + "mousemove --window %1 100 100 key --window 0 q");
  }};
  w.wait();
  other.join();
  CHECK(is_shown);
}

TEST_CASE("all but show is for the thread that made the window, in words") {
  window w{some_scene(), small};
  std::string said;
  int refused = 0;
  std::jthread{[&] {
    const auto refuses = [&](auto&& call) {
      try {
        call();
      } catch (const invalid_input& error) {
        said = error.what();
        ++refused;
      }
    };
    refuses([&] { (void)w.update(); });
    refuses([&] { w.wait(); });
    refuses([&] { w.close(); });
    refuses([&] { (void)w.current(); });
    refuses([&] { (void)w.seen(); });
    refuses([&] { w.look({}); });
    refuses([&] { w.on_pick({}); });
    refuses([&] { w.on(key::a, {}); });
    refuses([&] { const window another{{}, small}; });
  }}.join();
  CHECK(refused == 9);
  CHECK(said.find("belong to the thread that made the first") != std::string::npos);
}

TEST_CASE("another thread may have windows when the last one is gone") {
  {
    const window w{some_scene(), small};
  }
  bool is_shown = false;
  std::jthread{[&] {
    window w{some_scene(), small};
    is_shown = eventually([&] { return is_on_screen(w); }, w);
  }}.join();
  CHECK(is_shown);
}

TEST_CASE("a window that waits leaves the processor alone") {
  window w{some_scene(), small};
  REQUIRE(eventually([&] { return is_on_screen(w); }, w));
  double used = 1;
  std::jthread other{[&] {
    std::this_thread::sleep_for(std::chrono::seconds{1});
    const double before = processor_seconds();
    std::this_thread::sleep_for(std::chrono::seconds{2});
    used = processor_seconds() - before;
    person_does(at_window("threads") + "mousemove --window %1 100 100 key --window 0 q");
  }};
  w.wait();
  other.join();
  MESSAGE("processor seconds in two seconds: ", used);
  CHECK(used < 0.02);
}
