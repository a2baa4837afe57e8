// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import tool;
using namespace cilantro;

namespace {

using json = nlohmann::ordered_json;

struct hull_settings {
  std::string input, output;
  double tolerance = 0;
  int threads = 0;
  bool as_json = false, quiet = false;
  depth_settings depth;
};

const char* name_of(polytope_status status) {
  switch (status) {
    case polytope_status::empty:
      return "empty";
    case polytope_status::flat:
      return "flat";
    default:
      return "bounded";
  }
}

/// A flat hull as triangles: its edges form one ring.
Eigen::Matrix3Xi fan_of(const convex_polytope<3>& polygon) {
  index_list ring{0};
  std::vector<index_list> beside(polygon.vertices().size());
  for (const auto& edge : polygon.facets()) {
    beside[edge.vertices[0]].push_back(edge.vertices[1]);
    beside[edge.vertices[1]].push_back(edge.vertices[0]);
  }
  while (std::ssize(ring) < std::ssize(beside)) {
    const auto& ways = beside[ring.back()];
    ring.push_back(ring.size() > 1 && ways[0] == ring[ring.size() - 2] ? ways[1] : ways[0]);
  }
  Eigen::Matrix3Xi triangles(3, std::ssize(ring) - 2);
  for (index_t k = 0; k < triangles.cols(); ++k)
    triangles.col(k) << ring[0], ring[k + 1], ring[k + 2];
  return triangles;
}

template <class S>
void run(const hull_settings& settings, const point_cloud<S, 3>& cloud) {
  const auto hull =
      convex_hull(cloud, {.tolerance = settings.tolerance, .threads = settings.threads});
  // A polygon's boundary is its perimeter, and a segment's its two ends.
  const double area = hull.affine_dimension() == 3   ? hull.area()
                      : hull.affine_dimension() == 2 ? hull.measure()
                                                     : 0;
  json description{{"status", name_of(hull.status())},
                   {"vertices", hull.vertices().size()},
                   {"facets", hull.facets().size()},
                   {"area", area},
                   {"volume", hull.volume()}};
  if (hull.affine_dimension() == 2) description["perimeter"] = hull.area();
  if (hull.affine_dimension() == 1) description["length"] = hull.measure();
  if (const auto center = hull.centroid())
    description["centroid"] = {center->x(), center->y(), center->z()};
  description["left_out"] = hull.non_finite();
  if (settings.as_json)
    std::cout << description.dump(2) << '\n';
  else
    for (const auto& [key, value] : description.items())
      std::cout << key << ": " << value.dump() << '\n';
  if (settings.output.empty()) return;
  const auto corners = select(cloud, hull.indices());
  const std::filesystem::path output = settings.output;
  if (!CLI::detail::to_lower(output.extension().string()).ends_with(".ply"))
    return write_cloud(corners, output);
  Eigen::MatrixXi triangles;
  if (hull.affine_dimension() == 3)
    triangles = hull.simplices();
  else if (hull.affine_dimension() == 2)
    triangles = fan_of(hull);
  write_ply(corners, output, {.triangles = std::move(triangles)});
}

}  // namespace

void add_hull(CLI::App& app) {
  const auto settings = std::make_shared<hull_settings>();
  auto* command = app.add_subcommand("hull", "Measures the convex hull of a cloud");
  command->add_option("FILE", settings->input, "A cloud or a depth image")->required();
  command->add_option("-o,--output", settings->output,
                      "Where to write the points that are corners; as .ply with the faces");
  command
      ->add_option("--tolerance", settings->tolerance,
                   "Points that are this near to a plane count as flat; 0: as rounding asks for")
      ->check(CLI::NonNegativeNumber);
  add_common_options(*command, *settings);
  command->callback([settings] {
    const auto input = read_input(settings->input, settings->depth, settings->quiet);
    std::visit([&](const auto& cloud) { run(*settings, cloud); }, input.cloud);
  });
}
