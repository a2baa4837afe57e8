// SPDX-License-Identifier: MIT
#include <iostream>

import cilantro;
import cilantro.window;

int main() {
  using namespace cilantro;
  const scene all = scene{}.set("text", label{"here", {0, 0, 0}});
  if (!can_open_window()) {
    std::cout << "without a display, a picture of " << render(all, fit(all)).width() << " pixels\n";
    return 0;
  }
  window w{all};
  return w.update() ? 0 : 1;
}
