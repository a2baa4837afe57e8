// SPDX-License-Identifier: MIT
#include <iostream>
#include <scan_tools.hpp>

#ifdef __clang__
#error "this is the part that GCC builds"
#endif

int main() {
  std::vector<scan_tools::point> scan;
  for (int i = 0; i < 10000; ++i)
    scan.push_back({0.01f * float(i % 100), 0.01f * float(i / 100), 0});
  const auto surface = scan_tools::surface_of(scan, 0.05, 8);
  bool up = surface.points.size() == 400 && surface.normals.size() == 400;
  for (const auto& normal : surface.normals) up = up && normal[2] > 0.999f;
  bool refused = false;
  try {
    scan_tools::surface_of(scan, -1, 8);
  } catch (const std::invalid_argument& error) {
    refused = true;
    std::cout << "refused: " << error.what() << '\n';
  }
  std::cout << surface.points.size() << " points, " << (up ? "all" : "not all") << " facing up\n";
  return up && refused ? 0 : 1;
}
