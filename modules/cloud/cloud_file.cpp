// SPDX-License-Identifier: MIT
module;
#include <cctype>
#include <filesystem>
#include <string>
module cilantro.cloud;

namespace cilantro {
namespace {

enum class ending { ply, pcd, text, csv, pts };

ending ending_of(const std::filesystem::path& path, const char* who) {
  std::string name = path.extension().string();
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (name == ".ply") return ending::ply;
  if (name == ".pcd") return ending::pcd;
  if (name == ".xyz" || name == ".txt" || name == ".asc") return ending::text;
  if (name == ".csv") return ending::csv;
  if (name == ".pts") return ending::pts;
  throw invalid_input{std::string{who} + ": \"" + path.string() + "\" does not end in " +
                      known_cloud_files()};
}

}  // namespace

std::string known_cloud_files() {
  return ".ply, .pcd, .xyz, .txt, .asc, .csv or .pts";
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_cloud(const std::filesystem::path& path, const read_options& options) {
  switch (ending_of(path, "read_cloud")) {
    case ending::ply:
      return read_ply<S, D>(path, options);
    case ending::pcd:
      return read_pcd<S, D>(path, options);
    case ending::text:
    case ending::csv:
    case ending::pts:
      break;
  }
  return read_text<S, D>(path, {.origin = options.origin, .monitor = options.monitor});
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_cloud(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
                 const task_monitor& monitor) {
  switch (ending_of(path, "write_cloud")) {
    case ending::ply:
      return write_ply(cloud, path, {.monitor = monitor});
    case ending::pcd:
      return write_pcd(cloud, path, {.monitor = monitor});
    case ending::text:
      return write_text(cloud, path, {.monitor = monitor});
    case ending::csv:
      return write_text(cloud, path, {.separator = ',', .monitor = monitor});
    case ending::pts:
      if constexpr (D == 3)
        return write_pts(cloud, path, monitor);
      else
        throw invalid_input{"write_cloud: the points of a PTS file have three coordinates"};
  }
}

#define CILANTRO_INSTANTIATE(S, D)                                                                \
  template point_cloud<S, D> read_cloud<S, D>(const std::filesystem::path&, const read_options&); \
  template void write_cloud(const point_cloud<S, D>&, const std::filesystem::path&,               \
                            const task_monitor&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
