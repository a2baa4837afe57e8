// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import tool;
using namespace cilantro;

namespace {

struct crop_settings {
  std::string input, output, hull;
  std::vector<double> box, ball, cylinder;
  double margin = 0;
  bool outside = false, quiet = false;
  depth_settings depth;
};

/// What all options that are given have in common.
struct crop_region {
  std::optional<box> in_box;
  std::optional<ball> in_ball;
  std::optional<cylinder> in_cylinder;
  std::optional<convex_polytope<3>> in_hull;
  double margin = 0;

  [[nodiscard]] bool contains(const Eigen::Vector3d& point) const {
    return (!in_box || in_box->contains(point)) && (!in_ball || in_ball->contains(point)) &&
           (!in_cylinder || in_cylinder->contains(point)) &&
           (!in_hull || in_hull->contains(point, margin));
  }
};

crop_region region_of(const crop_settings& settings) {
  const auto expect_numbers = [](const std::vector<double>& numbers, const char* of) {
    if (std::ranges::any_of(numbers, [](double n) { return !std::isfinite(n); }))
      throw std::runtime_error{std::string{of} + " must be a number"};
  };
  expect_numbers({settings.margin}, "the margin");
  expect_numbers(settings.ball, "what says where the ball is");
  expect_numbers(settings.cylinder, "what says where the cylinder is");
  crop_region region{.margin = settings.margin};
  if (const auto& b = settings.box; !b.empty()) {
    region.in_box = box{.lower = {b[0], b[1], b[2]}, .upper = {b[3], b[4], b[5]}};
    region.in_box->check(3);
  }
  if (const auto& b = settings.ball; !b.empty())
    region.in_ball = ball{.center = {b[0], b[1], b[2]}, .radius = b[3]};
  if (const auto& c = settings.cylinder; !c.empty()) {
    region.in_cylinder =
        cylinder{.base = {c[0], c[1], c[2]}, .top = {c[3], c[4], c[5]}, .radius = c[6]};
    region.in_cylinder->check(3);
  }
  if (!settings.hull.empty()) {
    const auto other = read_input(settings.hull, settings.depth, settings.quiet);
    region.in_hull = std::visit([](const auto& cloud) { return convex_hull(cloud); }, other.cloud);
    if (region.in_hull->empty())
      throw std::runtime_error{settings.hull + ": no point, and so no hull"};
  }
  return region;
}

}  // namespace

void add_crop(CLI::App& app) {
  const auto settings = std::make_shared<crop_settings>();
  auto* command = app.add_subcommand("crop", "Keeps what is in a box, a ball, a cylinder, a hull");
  command->add_option("FILE", settings->input, "A cloud or a depth image")->required();
  command->add_option("-o,--output", settings->output, "Where to write what is kept")->required();
  auto* where = command->add_option_group("region", "One or more, which the points must all be in");
  where->add_option("--box", settings->box, "x,y,z,x,y,z: from the least corner to the greatest")
      ->delimiter(',')
      ->expected(6);
  where->add_option("--ball", settings->ball, "x,y,z,radius")->delimiter(',')->expected(4);
  where
      ->add_option("--cylinder", settings->cylinder,
                   "x,y,z,x,y,z,radius: from the middle of one end to that of the other")
      ->delimiter(',')
      ->expected(7);
  auto* hull = where->add_option("--hull", settings->hull, "The convex hull of another cloud");
  where->require_option(1, 0);
  command->add_option("--margin", settings->margin, "By which the facets of the hull are moved out")
      ->needs(hull);
  command->add_flag("--outside", settings->outside, "Keeps what is outside instead");
  add_depth_options(*command, settings->depth);
  command->add_flag("--quiet", settings->quiet, "No progress and no report");
  command->callback([settings] {
    const auto region = region_of(*settings);
    const auto input = read_input(settings->input, settings->depth, settings->quiet);
    std::visit(
        [&](const auto& cloud) {
          const auto kept =
              settings->outside ? cloud | remove_inside(region) : cloud | crop(region);
          write_cloud(kept, settings->output);
          if (!settings->quiet)
            std::cerr << kept.size() << " of " << cloud.size() << " points in " << settings->output
                      << '\n';
        },
        input.cloud);
  });
}
