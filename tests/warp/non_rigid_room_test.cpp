// SPDX-License-Identifier: MIT
//
// A room in which something bends, with the exact truth.
#include <cmath>

#include "spaces.hpp"

import cilantro;
import simulated_room;
import test_support;

using namespace cilantro;

TEST_CASE("a curtain that billows in a room is followed, and the room stays") {
  constexpr double seconds = 1;
  const auto seen_at = [](double when) {
    return simulate(0, {.width = 320, .height = 240, .noise = 0.002, .curtain_seconds = when});
  };
  const auto before = seen_at(0), after = seen_at(seconds);
  const auto source = unproject<double>(before.depth, before.camera),
             target = unproject<double>(after.depth, after.camera);
  const auto found = align_non_rigid(source, target, {.spacing = 0.15, .max_distance = 0.3});
  const auto moved = moved_points(found.transform, source);

  struct mean {
    double sum = 0;
    index_t count = 0;
    void add(const Eigen::Vector3d& p) { sum += p.squaredNorm(), ++count; }
    [[nodiscard]] double root() const { return std::sqrt(sum / double(count)); }
  };
  mean cloth, cloth_at_first, room;
  for (index_t i = 0; i < source.cols(); ++i) {
    const Eigen::Vector3d truth = moved_in_room(before.points.col(i), before.objects[i], seconds);
    if (!source.col(i).allFinite()) continue;
    if (before.objects[i] == curtain_object) {
      cloth.add(moved.col(i) - truth);
      cloth_at_first.add(source.col(i) - truth);
    } else {
      room.add(moved.col(i) - truth);
    }
  }
  REQUIRE(cloth.count > 3000);
  CHECK(cloth_at_first.root() > 0.07);
  CHECK(cloth.root() < 0.25 * cloth_at_first.root());
  CHECK(room.root() < 0.01);  // Most of which is noise: 8 mm on the far wall.
}
