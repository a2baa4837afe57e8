// SPDX-License-Identifier: MIT
//
// Where the library was built without windows.
module;
#include <stdexcept>
module drawing;

void expect_screen() {
  throw std::runtime_error{
      "this program was built without windows, which need GLFW (libglfw3-dev); cilantro picture "
      "and cilantro html draw into a file"};
}
void show_on_screen(const scene&, const view&, const render_options&) {
  expect_screen();
}
