// SPDX-License-Identifier: MIT
// message: no member named 'draw' in 'thing'
import cilantro.visualization;

struct thing {};

int main() {
  return static_cast<int>(cilantro::scene{}.set("thing", thing{}).layers().size());
}
