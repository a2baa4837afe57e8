// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "common_options.hpp"

import cilantro;
import tool;
using namespace cilantro;

namespace {

using json = nlohmann::ordered_json;

struct info_settings {
  std::string file;
  depth_settings depth;
  bool as_json = false, quiet = false;
};

template <class T>
const char* name_of() {
  if constexpr (std::is_same_v<T, float>) return "float";
  if constexpr (std::is_same_v<T, double>) return "double";
  constexpr bool is_signed = std::is_signed_v<T>;
  switch (sizeof(T)) {
    case 1:
      return is_signed ? "int8" : "uint8";
    case 2:
      return is_signed ? "int16" : "uint16";
    case 4:
      return is_signed ? "int32" : "uint32";
    default:
      return is_signed ? "int64" : "uint64";
  }
}

json describe(const attribute& a) {
  json description{{"name", a.name}};
  std::visit(
      [&]<class T>(const std::vector<T>& values) {
        description["type"] = name_of<T>();
        bool any = false;
        T low{}, high{};
        for (const T v : values) {
          if (std::isnan(double(v))) continue;
          low = any ? std::min(low, v) : v;
          high = any ? std::max(high, v) : v;
          any = true;
        }
        if (any) {
          description["min"] = low;
          description["max"] = high;
        }
      },
      a.values);
  return description;
}

template <class S>
json describe(const std::string& file, const point_cloud<S, 3>& cloud) {
  json description{
      {"file", file}, {"points", cloud.size()}, {"invalid", count_non_finite(cloud.points)}};
  if (cloud.is_organized()) {
    description["width"] = cloud.width;
    description["height"] = cloud.height;
  }
  Eigen::AlignedBox3d box;
  for (const auto& p : as_points(cloud.points))
    if (is_finite(p)) box.extend(p.template cast<double>() + cloud.origin);
  if (!box.isEmpty()) {
    description["min"] = {box.min().x(), box.min().y(), box.min().z()};
    description["max"] = {box.max().x(), box.max().y(), box.max().z()};
  }
  if (cloud.has_origin())
    description["origin"] = {cloud.origin.x(), cloud.origin.y(), cloud.origin.z()};
  description["normals"] = cloud.has_normals();
  description["colors"] = cloud.has_colors();
  description["attributes"] = json::array();
  for (const auto& a : cloud.attributes) description["attributes"].push_back(describe(a));
  description["comments"] = cloud.comments;
  return description;
}

/// Of tiles, what their index says.
json describe_tiles(const std::string& folder) {
  const auto tiles = open_tiles<double>(folder);
  json description{{"folder", folder},
                   {"points", tiles.size()},
                   {"files", tiles.files().size()},
                   {"tiles", tiles.tiles().size()},
                   {"edge", tiles.edge()}};
  if (!tiles.tiles().empty()) {
    const auto box = tiles.bounds();
    description["min"] = {box.lower[0], box.lower[1], box.lower[2]};
    description["max"] = {box.upper[0], box.upper[1], box.upper[2]};
  }
  return description;
}

json describe_input(const info_settings& settings) {
  if (means_tiles(settings.file)) return describe_tiles(settings.file);
  const auto input = read_input(settings.file, settings.depth, settings.quiet);
  return std::visit([&](const auto& cloud) { return describe(settings.file, cloud); }, input.cloud);
}

void print(const json& description) {
  for (const auto& [key, value] : description.items()) {
    if (key == "attributes" || key == "comments") {
      for (const auto& entry : value)
        std::cout << (key == "comments" ? "comment" : "attribute") << ": "
                  << entry.dump(-1, ' ', false, json::error_handler_t::replace) << '\n';
      continue;
    }
    std::cout << key << ": " << value.dump(-1, ' ', false, json::error_handler_t::replace) << '\n';
  }
}

}  // namespace

void add_info(CLI::App& app) {
  const auto settings = std::make_shared<info_settings>();
  auto* command = app.add_subcommand("info", "Says what a file holds");
  command->add_option("FILE", settings->file, "A cloud, a depth image, or a folder of tiles")
      ->required();
  add_depth_options(*command, settings->depth);
  command->add_flag("--json", settings->as_json, "As one JSON object");
  command->add_flag("--quiet", settings->quiet, "No progress");
  command->callback([settings] {
    const auto description = describe_input(*settings);
    if (settings->as_json)
      std::cout << description.dump(2, ' ', false, json::error_handler_t::replace) << '\n';
    else
      print(description);
  });
}
