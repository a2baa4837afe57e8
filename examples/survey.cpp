// SPDX-License-Identifier: MIT
//
// A survey larger than memory, tile by tile: a step of yours, which says how far it looks, and what
// each tile adds to a grid of terrain.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <limits>
#include <string>

import cilantro;
using namespace cilantro;

/// Two strips of a hilly terrain in coordinates of a map, flown over with some overlap.
void make_survey(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const int strip : {0, 1}) {
    point_cloud<double, 3> flown;
    flown.points.resize(3, 20'000);
    for (index_t i = 0; i < flown.size(); ++i) {
      random_stream random{static_cast<std::uint64_t>(strip), static_cast<std::uint64_t>(i)};
      const double x = random.uniform(0, 200), y = 80 * strip + random.uniform(0, 100);
      // One point of a hundred is of a plant.
      const double z = 300 + 10 * std::sin(x / 50) + (i % 100 == 0 ? random.uniform(4, 8) : 0);
      flown.points.col(i) << 690'000 + x, 5'330'000 + y, z;
    }
    write_las(flown, folder / ("strip" + std::to_string(strip) + ".las"));
  }
}

/// Drops points that are `high` above the lowest within `distance`.
auto remove_plants(double distance, float high) {
  return with_reach(distance, [=](const point_cloud<float, 3>& cloud) {
    const kd_tree tree{cloud.points};
    return select(cloud, [&](index_t i) {
      float lowest = cloud.points(2, i);
      for (const auto& near : tree.find(cloud.points.col(i), radius{distance}))
        lowest = std::min(lowest, cloud.points(2, near.index));
      return cloud.points(2, i) < lowest + high;
    });
  });
}

int main() {
  make_survey("survey_strips");
  const auto survey = open_tiles<float>("survey_strips/*.las", {.edge = 50, .memory = 500_MB});
  const auto area = survey.bounds();
  std::filesystem::remove_all("survey_ground");
  const auto ground = survey | voxel_downsample(1) | remove_plants(9, 3) |
                      estimate_normals(knn{10}) | write_tiles("survey_ground");

  // The greatest height of each square metre.
  Eigen::MatrixXd terrain =
      Eigen::MatrixXd::Constant(201, 181, -std::numeric_limits<double>::infinity());
  for_each_tile(ground, halo{0}, [&](const auto& tile) {
    for (const index_t i : tile.inside) {
      const Eigen::Vector3d place =
          tile.cloud.points.col(i).template cast<double>() + tile.cloud.origin;
      auto& height = terrain(static_cast<index_t>(place.x() - area.lower[0]),
                             static_cast<index_t>(place.y() - area.lower[1]));
      height = std::max(height, place.z());
    }
  });
  std::cout << survey.size() << " points in " << survey.tiles().size() << " tiles, "
            << ground.size() << " on the ground, which is at most " << terrain.maxCoeff()
            << " high\n";
  return ground.size() < survey.size() && terrain.maxCoeff() < 310.5 ? 0 : 1;
}
