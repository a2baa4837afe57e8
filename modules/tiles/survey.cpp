// SPDX-License-Identifier: MIT
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
  survey.bounds = survey.files.bounds();
  for (const auto& file : survey.files) {
    survey.points += file.points;
    for (const auto& [key, count] : file.squares) all[key] += count;
  }
  for (const auto& [key, count] : all) survey.tiles.push_back({key.x, key.y, count});
}

template <int D>
double points_within(const survey_files<D>& files, const tile_area& area) {
  // Where a box ends in the area, and where the area ends in it.
  const auto overlap = [&](const extent<D>& box, int d) {
    return std::min(box.upper[d], area.upper[d]) - std::max(box.lower[d], area.lower[d]);
  };
  double points = 0;
  files.for_each_run(
      [&](const extent<D>& box) { return overlap(box, 0) >= 0 && overlap(box, 1) >= 0; },
      [&](const point_run<D>& run) {
        double share = 1;
        for (int d = 0; d < 2; ++d)
          if (const double size = run.box.upper[d] - run.box.lower[d]; size > 0)
            share *= overlap(run.box, d) / size;
        points += double(run.count) * share;
      });
  return points;
}

template <int D>
std::string description_of(const survey_files<D>& files) {
  // As one number (FNV-1a).
  std::uint64_t hash = 14695981039346656037u, points = 0;
  const auto take = [&](std::string_view text) {
    for (const unsigned char c : text) hash = (hash ^ c) * 1099511628211u;
  };
  for (index_t f = 0; f < static_cast<index_t>(files.size()); ++f) {
    const auto& file = files[f];
    points += file.points;
    std::string line = file.path.filename().string() + ' ' + std::to_string(file.bytes) + ' ' +
                       std::to_string(file.modified);
    for (int d = 0; d < D; ++d)
      line += ' ' + in_digits(files.bounds(f).lower[d]) + ' ' + in_digits(files.bounds(f).upper[d]);
    take(line + '\n');
  }
  return std::to_string(files.size()) + " files with " + std::to_string(points) + " points from " +
         (files.empty() ? "nowhere" : files.front().path.filename().string()) + ", file number " +
         std::to_string(hash);
}

template <Scalar S, int D>
std::string description_of(const std::vector<tile_step<S, D>>& steps) {
  std::string line;
  for (const auto& step : steps) {
    line += " | " + step.name + " (" + in_digits(step.reach.distance) + ", " +
            std::to_string(step.reach.neighbors) + ")";
    if (!step.about.empty()) line += ' ' + step.about;
  }
  return line;
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
  template double bytes_per_point<S, D>(const point_parts&);                                   \
  template std::string description_of(const std::vector<tile_step<S, D>>&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE
template double points_within(const survey_files<2>&, const tile_area&);
template double points_within(const survey_files<3>&, const tile_area&);
template std::string description_of(const survey_files<2>&);
template std::string description_of(const survey_files<3>&);
template void join_files(tile_survey<2>&);
template void join_files(tile_survey<3>&);
template void expect_unchanged(const survey_file<2>&);
template void expect_unchanged(const survey_file<3>&);

}  // namespace cilantro
