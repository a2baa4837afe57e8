// SPDX-License-Identifier: MIT
// message: regions: both sets must have the same dimension
import cilantro;

int main() {
  const cilantro::convex_polytope<2> square{cilantro::box{{0, 0}, {1, 1}}};
  const cilantro::convex_polytope<3> cube{cilantro::box{{0, 0, 0}, {1, 1, 1}}};
  return (square | cube).empty();
}
