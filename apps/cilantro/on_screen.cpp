// SPDX-License-Identifier: MIT
module;
#include <iostream>
#include <stdexcept>
module drawing;

import cilantro.window;

void expect_screen() {
  if (!can_open_window())
    throw std::runtime_error{
        "there can be no window here, for want of a display or a driver; cilantro picture and "
        "cilantro html draw into a file"};
}

void show_on_screen(const scene& all, const view& from, const render_options& drawing) {
  expect_screen();
  window w{all, {.width = from.camera.width, .height = from.camera.height, .drawing = drawing}};
  w.look(from);
  w.on_pick([](const picked& found) {
    std::cout << found.layer << ": point " << found.index << " at " << found.place.transpose()
              << std::endl;
  });
  w.wait();
}
