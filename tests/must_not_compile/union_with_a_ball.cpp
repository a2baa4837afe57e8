// SPDX-License-Identifier: MIT
// message: 'cilantro::ball' does not satisfy 'FlatSidedSet'
import cilantro;

int main() {
  const cilantro::convex_polytope<3> cube{cilantro::box{{0, 0, 0}, {1, 1, 1}}};
  return (cube | cilantro::ball{{0, 0, 0}, 1}).empty();
}
