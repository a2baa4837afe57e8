// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>
module cilantro.tiles;

import cilantro.eigen;
import :survey;

namespace cilantro {

template <Scalar S, int D>
void describe_points(const point_cloud<S, D>& cloud, double edge, bool is_local,
                     survey_file<D>& file) {
  const auto origin = cloud.full_origin();
  for (index_t i = 0; i < cloud.size(); ++i) {
    if (i % points_of_a_run == 0) file.runs.emplace_back();
    auto& run = file.runs.back();
    ++run.count;
    // As a writer adds the origin, and a reader takes it away.
    point_vector<double, D> place = world_of<S, D>(cloud.points.col(i), origin);
    if (!is_local) place = world_of<S, D>((place - origin).template cast<S>(), origin);
    if (!is_finite(place)) continue;
    run.box.add(place);
    ++file.squares[key_of(place, edge)];
  }
  file.points = static_cast<std::uint64_t>(cloud.size());
}

template <int D>
void join_files(tile_survey<D>& survey) {
  square_counts all;
  for (const auto& file : survey.files) {
    survey.points += file.points;
    for (const auto& run : file.runs) survey.bounds.add(run.box);
    for (const auto& [key, count] : file.squares) all[key] += count;
  }
  for (const auto& [key, count] : all) survey.tiles.push_back({key.x, key.y, count});
}

template <int D>
void expect_unchanged(const survey_file<D>& file) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file.path, error);
  if (error) throw io_error{file.path, "cannot be read: " + error.message()};
  const auto modified = std::filesystem::last_write_time(file.path, error);
  if (bytes != file.bytes ||
      (file.modified != 0 && !error && modified.time_since_epoch().count() != file.modified))
    throw io_error{file.path, "has changed since the tiles were opened"};
}

template <Scalar S, int D>
point_parts parts_of(const point_cloud<S, D>& cloud) {
  point_parts parts{cloud.has_normals(), cloud.has_colors(), {}, cloud.comments};
  for (const auto& a : cloud.attributes) parts.attributes.emplace_back(a.name, a.values.index());
  return parts;
}

template <Scalar S, int D>
void conform(point_cloud<S, D>& piece, const point_parts& parts,
             const std::filesystem::path& path) {
  const auto lacks = [&](const std::string& what) {
    throw io_error{path, "has no " + what + ", which the first file has"};
  };
  piece.width = piece.height = 0;
  piece.comments = parts.comments;
  if (piece.empty()) return;
  if (parts.normals && !piece.has_normals()) lacks("normals");
  if (!parts.normals) piece.normals.resize(D, 0);
  if (parts.colors && !piece.has_colors()) lacks("colours");
  if (!parts.colors) piece.colors.resize(3, 0);
  std::vector<attribute> kept;
  for (const auto& [name, type] : parts.attributes) {
    const auto found = std::ranges::find(piece.attributes, name, &attribute::name);
    if (found == piece.attributes.end() || found->values.index() != type)
      lacks("attribute \"" + name + "\" of that type");
    kept.push_back(std::move(*found));
  }
  piece.attributes = std::move(kept);
}

namespace {

template <std::size_t I = 0>
attribute_values values_from(std::size_t type, index_t count) {
  if constexpr (I < std::variant_size_v<attribute_values>) {
    if (type != I) return values_from<I + 1>(type, count);
    return std::variant_alternative_t<I, attribute_values>(static_cast<std::size_t>(count));
  } else {
    throw std::logic_error{"attributes have no type of this number"};
  }
}

}  // namespace

attribute_values values_of_type(std::size_t type, index_t count) {
  return values_from(type, count);
}

template <Scalar S, int D>
double bytes_per_point(const point_parts& parts) {
  double bytes = D * sizeof(S) * (parts.normals ? 2 : 1) + (parts.colors ? 12 : 0);
  for (const auto& [name, type] : parts.attributes)
    bytes += std::visit([](const auto& v) { return double(sizeof(*v.data())); },
                        values_of_type(type, 0));
  // As measured: the points as they are read, put together and changed, a tree with neighbourhoods
  // beside them, and what the allocator keeps.
  constexpr double of_a_tree = 160;
  return 8 * bytes + 2 * D * sizeof(S) + of_a_tree;
}

#define CILANTRO_INSTANTIATE(S, D)                                                             \
  template void describe_points(const point_cloud<S, D>&, double, bool, survey_file<D>&);      \
  template void conform(point_cloud<S, D>&, const point_parts&, const std::filesystem::path&); \
  template point_parts parts_of(const point_cloud<S, D>&);                                     \
  template double bytes_per_point<S, D>(const point_parts&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE
template void join_files(tile_survey<2>&);
template void join_files(tile_survey<3>&);
template void expect_unchanged(const survey_file<2>&);
template void expect_unchanged(const survey_file<3>&);

}  // namespace cilantro
