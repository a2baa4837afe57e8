// SPDX-License-Identifier: MIT
//
// Machines where there can be no window. Before a display is found for the first time, so no other
// test must come first.
#include <doctest/doctest.h>

#include <cstdlib>
#include <string>

import cilantro.window;

using namespace cilantro;

TEST_CASE("without a display, a sentence says so, and what draws without one") {
  const std::string display = std::getenv("DISPLAY");
  for (const char* name : {"", ":9999"}) {
    if (*name != 0)
      setenv("DISPLAY", name, 1);
    else
      unsetenv("DISPLAY");
    CHECK(!can_open_window());
    std::string said;
    try {
      const window w;
    } catch (const window_error& error) {
      said = error.what();
    }
    CHECK(said.find("no display (X11") != std::string::npos);
    CHECK(said.find("write_picture(") != std::string::npos);
    CHECK(said.find("write_html(") != std::string::npos);
  }
  setenv("DISPLAY", display.c_str(), 1);
  CHECK(can_open_window());
}
