// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "common.hpp"

import cilantro;
import cilantro.visualization;
using namespace cilantro;

namespace {

using cloud_type = point_cloud<float, 3>;

const cloud_type& colored_cloud() {
  static const cloud_type cloud = read_ply<float>(data_path("large.ply"));
  return cloud;
}
const cloud_look& round_splats() {
  static const cloud_look look{.size = splat_length{splat_diameter}, .along_normals = false};
  return look;
}
const scene& one_scene() {
  static const scene made = scene{}.set("large", colored_cloud(), round_splats());
  return made;
}
const scene& scene_of_many() {
  static const scene made = [] {
    const many_points many{large_points()};
    cloud_type cloud;
    cloud.points.resize(3, many.count);
    cloud.colors.resize(3, many.count);
    for (index_t i = 0; i < many.count; ++i) {
      const auto p = many[std::size_t(i)];
      cloud.points.col(i) << p[0], p[1], p[2];
      cloud.colors.col(i) = colored_cloud().colors.col(i % colored_cloud().size());
    }
    return scene{}.set("large", cloud, round_splats());
  }();
  return made;
}
const scene& scene_of_discs() {
  static const scene made = [] {
    cloud_type cloud = colored_cloud();
    cloud.normals = Eigen::Map<const Eigen::Matrix3Xf>{large_normals().data(), 3, cloud.size()};
    return scene{}.set("large", cloud, cloud_look{.size = splat_length{splat_diameter}});
  }();
  return made;
}
/// As a cloud looks if nothing is said.
const scene& scene_by_spacing() {
  static const scene made = scene{}.set("large", colored_cloud());
  return made;
}

/// The view of one cloud for all pictures, so that each shows the same. A picture may be kept, to
/// be looked at: in CILANTRO_BENCHMARK_PICTURE.
void picture_of(benchmark::State& state, const scene& all, render_options options) {
  const view from =
      fit(one_scene(), {0, 0, 1}, {0, -1, 0}, {.width = picture_width, .height = picture_height});
  image<rgb> seen;
  for (auto _ : state) {
    seen = render(all, from, options);
    benchmark::DoNotOptimize(seen.pixels().data());
  }
  if (const char* path = std::getenv("CILANTRO_BENCHMARK_PICTURE")) write_png(seen, path);
  report_result(state, double(std::ranges::count_if(seen.pixels(), [&](const rgb& pixel) {
                  return pixel != options.background;
                })));
}

void picture_nearest(benchmark::State& state) {
  picture_of(state, one_scene(), {.blend = false});
}
CILANTRO_BENCHMARK(picture_nearest);
void picture_mixed(benchmark::State& state) {
  picture_of(state, one_scene(), {});
}
CILANTRO_BENCHMARK(picture_mixed);
void picture_by_default(benchmark::State& state) {
  picture_of(state, scene_by_spacing(), {});
}
CILANTRO_BENCHMARK(picture_by_default);
void picture_of_discs(benchmark::State& state) {
  picture_of(state, scene_of_discs(), {.blend = false});
}
CILANTRO_BENCHMARK(picture_of_discs);
void picture_of_discs_mixed(benchmark::State& state) {
  picture_of(state, scene_of_discs(), {});
}
CILANTRO_BENCHMARK(picture_of_discs_mixed);
void picture_of_many(benchmark::State& state) {
  picture_of(state, scene_of_many(), {.blend = false});
}
CILANTRO_BENCHMARK(picture_of_many);
void picture_of_many_mixed(benchmark::State& state) {
  picture_of(state, scene_of_many(), {});
}
CILANTRO_BENCHMARK(picture_of_many_mixed);
void picture_of_many_moving(benchmark::State& state) {
  picture_of(state, scene_of_many(), {.blend = false, .point_budget = moving_points});
}
CILANTRO_BENCHMARK(picture_of_many_moving);

/// Files go where no disk is, if there is such a place.
class written_file {
 public:
  explicit written_file(const std::string& ending) {
    const std::filesystem::path memory = "/dev/shm";
    path = (std::filesystem::exists(memory) ? memory : std::filesystem::temp_directory_path()) /
           ("cilantro_benchmark_" + std::to_string(getpid()) + ending);
  }
  ~written_file() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
  std::filesystem::path path;
};
void report_size(benchmark::State& state, const written_file& file) {
  state.counters["bytes"] = double(std::filesystem::file_size(file.path));
}

void picture_to_png(benchmark::State& state) {
  const view from =
      fit(one_scene(), {0, 0, 1}, {0, -1, 0}, {.width = picture_width, .height = picture_height});
  const auto seen = render(one_scene(), from);
  const written_file file{".png"};
  for (auto _ : state) write_png(seen, file.path);
  report_size(state, file);
}
CILANTRO_BENCHMARK(picture_to_png);
void page_of_large(benchmark::State& state) {
  const written_file file{".html"};
  for (auto _ : state) write_html(one_scene(), file.path);
  report_size(state, file);
}
CILANTRO_BENCHMARK(page_of_large);
void spacing_of_large(benchmark::State& state) {
  for (auto _ : state) {
    scene all;
    all.set("large", colored_cloud(), cloud_look{.size = local_spacing{}});
    benchmark::DoNotOptimize(all.layers().data());
  }
}
CILANTRO_BENCHMARK(spacing_of_large);

}  // namespace
