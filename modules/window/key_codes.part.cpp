// SPDX-License-Identifier: MIT
//
// From the codes of GLFW to keys. Internal.
module;
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

module cilantro.window:key_codes;

import cilantro.standard;
import :key;

namespace cilantro {

/// The key that has `code` on a keyboard as it is in the United States.
std::optional<key> key_of(int code) {
  const auto within = [&](int first, int last, key from) -> std::optional<key> {
    if (code < first || last < code) return std::nullopt;
    return key(int(from) + code - first);
  };
  if (const auto found = within(GLFW_KEY_A, GLFW_KEY_Z, key::a)) return found;
  if (const auto found = within(GLFW_KEY_0, GLFW_KEY_9, key::digit_0)) return found;
  if (const auto found = within(GLFW_KEY_KP_0, GLFW_KEY_KP_9, key::digit_0)) return found;
  if (const auto found = within(GLFW_KEY_F1, GLFW_KEY_F12, key::f1)) return found;
  switch (code) {
    case GLFW_KEY_KP_ADD:
      return key::plus;
    case GLFW_KEY_MINUS:
    case GLFW_KEY_KP_SUBTRACT:
      return key::minus;
    case GLFW_KEY_COMMA:
      return key::comma;
    case GLFW_KEY_PERIOD:
      return key::period;
    case GLFW_KEY_SPACE:
      return key::space;
    case GLFW_KEY_ENTER:
    case GLFW_KEY_KP_ENTER:
      return key::enter;
    case GLFW_KEY_TAB:
      return key::tab;
    case GLFW_KEY_BACKSPACE:
      return key::backspace;
    case GLFW_KEY_INSERT:
      return key::insert;
    case GLFW_KEY_DELETE:
      return key::remove;
    case GLFW_KEY_ESCAPE:
      return key::escape;
    case GLFW_KEY_LEFT:
      return key::left;
    case GLFW_KEY_RIGHT:
      return key::right;
    case GLFW_KEY_UP:
      return key::up;
    case GLFW_KEY_DOWN:
      return key::down;
    case GLFW_KEY_HOME:
      return key::home;
    case GLFW_KEY_END:
      return key::end;
    case GLFW_KEY_PAGE_UP:
      return key::page_up;
    case GLFW_KEY_PAGE_DOWN:
      return key::page_down;
    default:
      return std::nullopt;
  }
}

/// The key by what is written on it; where that is no key of ours, as on the digits of a French
/// keyboard, by where it is.
std::optional<key> key_of(int code, int scancode) {
  const char* name = glfwGetKeyName(code, scancode);
  if (name == nullptr || name[0] == 0 || name[1] != 0) return key_of(code);
  const char c = name[0];
  if (c >= 'a' && c <= 'z') return key_of(GLFW_KEY_A + (c - 'a'));
  if (c >= '0' && c <= '9') return key_of(GLFW_KEY_0 + (c - '0'));
  switch (c) {
    case '+':
      return key::plus;
    case '-':
      return key::minus;
    case ',':
      return key::comma;
    case '.':
      return key::period;
    default:
      return key_of(code);
  }
}

}  // namespace cilantro
