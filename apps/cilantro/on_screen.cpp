// SPDX-License-Identifier: MIT
module;
#include <iostream>
module drawing;

import cilantro.window;

void show_on_screen(const scene& all, const view& from, const render_options& drawing) {
  window w{all, {.width = from.camera.width, .height = from.camera.height, .drawing = drawing}};
  w.look(from);
  w.on_pick([](const picked& found) {
    std::cout << found.layer << ": point " << found.index << " at " << found.place.transpose()
              << std::endl;
  });
  w.wait();
}
