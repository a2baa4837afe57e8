// SPDX-License-Identifier: MIT
//
// How much memory each step holds at its peak, beside its input, in units of input and output.
// Ends with 1 if a step holds more than twice input plus output, but for those that say why they
// may. Linux only.
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

import cilantro;
using namespace cilantro;

namespace {

constexpr index_t point_count = 4'000'000;
constexpr double point_bytes = 12.0 * double(point_count);

/// A line of /proc/self/status, in bytes.
double status(const char* key) {
  std::ifstream in{"/proc/self/status"};
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(key)) return 1024 * std::atof(line.c_str() + std::string{key}.size() + 1);
  return 0;
}

point_cloud<float, 3> surface() {
  point_cloud<float, 3> cloud;
  cloud.points.resize(3, point_count);
  random_stream random{1};
  for (auto p : cloud.points.colwise()) {
    const double x = random.uniform(0, 20), y = random.uniform(0, 20);
    p << float(x), float(y), float(0.2 * x * (20 - x) / 20 + 0.01 * random.normal());
  }
  return cloud;
}

/// Runs `step` in a process of its own, after `prepare`, which returns the input's bytes; `step`
/// returns those of the output. Returns the peak over input plus output, or −1.
double measure(const std::function<double()>& prepare, const std::function<double()>& step) {
  int ends[2];
  if (::pipe(ends) != 0) return -1;
  if (::fork() == 0) {
    // Every block on pages of its own, which go back when it is freed.
    ::mallopt(M_MMAP_THRESHOLD, 1 << 16);
    const double input = prepare();
    std::ofstream{"/proc/self/clear_refs"} << "5";
    const double before = status("VmRSS");
    const double output = step();
    const double share = (status("VmHWM") - before) / (input + output);
    if (::write(ends[1], &share, sizeof share) != sizeof share) ::_exit(1);
    ::_exit(0);
  }
  ::close(ends[1]);
  double share = -1;
  if (::read(ends[0], &share, sizeof share) != sizeof share) share = -1;
  ::close(ends[0]);
  ::wait(nullptr);
  return share;
}

}  // namespace

int main() {
  const auto folder = std::filesystem::temp_directory_path() / "cilantro_memory_of_steps";
  std::filesystem::create_directories(folder);
  for (const char* name : {"a.ply", "a.pcd", "a.las", "a.xyz"})
    write_cloud(surface(), folder / name);
  write_pcd(surface(), folder / "b.pcd", {.format = pcd_format::binary_compressed});

  point_cloud<float, 3> cloud;
  const auto make = [&] {
    cloud = surface();
    return point_bytes;
  };
  const auto on_cloud = [&](auto step, double output_bytes_a_point) {
    return [&cloud, step, output_bytes_a_point] {
      const auto result = step(cloud);
      return output_bytes_a_point * double(result.size());
    };
  };
  const auto reading = [&](const char* name) {
    return [path = folder / name] { return 12.0 * double(read_cloud<float>(path).size()); };
  };
  const auto file = [&](const char* name) {
    return [path = folder / name] { return double(std::filesystem::file_size(path)); };
  };
  struct row {
    const char* name;
    std::function<double()> prepare, step;
    double allowed = 2;
  };
  const row rows[] = {
      {"kd_tree", make, [&] { return double(kd_tree{cloud.points}.memory()); }},
      {"voxel_downsample", make, on_cloud([](auto& c) { return voxel_downsample(c, 0.005); }, 12)},
      {"estimate_normals", make,
       [&] {
         (void)estimate_normals(cloud.points, knn{10});
         return 16.0 * double(point_count);
       }},
      {"statistical_outliers", make,
       on_cloud([](auto& c) { return remove_statistical_outliers(c, {.deviations = 3}); }, 12)},
      {"radius_outliers", make,
       on_cloud([](auto& c) { return remove_radius_outliers(c, {.radius = 0.05}); }, 12)},
      {"random_sample", make, on_cloud([](auto& c) { return random_sample(c, 1'000'000); }, 12)},
      {"farthest_point_sample", make,
       on_cloud([](auto& c) { return farthest_point_sample(c, 3); }, 12)},
      {"orient_consistently", make,
       [&] {
         cloud.normals = point_matrix<float, 3>::Random(3, point_count);
         const auto turned = orient_consistently(std::move(cloud), knn{6});
         return 24.0 * double(turned.size());
       },
       3.5},  // All edges of the graph have to be sorted.
      {"connected_components", make,
       [&] {
         const auto parts = connected_components(cloud.points, knn{30});
         return 4.0 * double(parts.labels().size());
       },
       3},  // A tree of all points, and a set for each.
      {"dbscan", make,
       [&] {
         const auto found = dbscan(cloud.points, {.radius = 0.02});
         return 5.0 * double(found.labels().size());
       },
       3},
      {"kmeans", make,
       [&] {
         const auto found = kmeans(cloud.points, 20, {.max_iterations = 3});
         return 4.0 * double(found.labels().size());
       },
       3},  // Two bounds a point.
      {"ransac, a plane", make,
       [&] {
         const auto found = ransac(hyperplane_family{cloud.points}, {.max_residual = 0.05});
         return 8.0 * double(found->inliers.size());
       }},
      {"cloud_from_depth", [] { return 2.0 * 4000 * 2000; },
       [] {
         const image<std::uint16_t> depth(4000, 2000, 1500);
         const pinhole_camera<float> camera{4000, 2000, 2000, 2000, 2000, 1000};
         return 12.0 * double(cloud_from_depth(depth, camera).size());
       }},
      {"read_ply", file("a.ply"), reading("a.ply")},
      {"read_pcd", file("a.pcd"), reading("a.pcd")},
      {"read_pcd, compressed", file("b.pcd"), reading("b.pcd")},
      {"read_las", file("a.las"), reading("a.las")},
      {"read_text", file("a.xyz"), reading("a.xyz")},
      {"write_ply", make,
       [&] {
         write_ply(cloud, folder / "c.ply");
         return point_bytes;
       }},
      {"write_las", make,
       [&] {
         write_las(cloud, folder / "c.las");
         return point_bytes;
       }},
      {"write_pcd, compressed", make,
       [&] {
         write_pcd(cloud, folder / "c.pcd", {.format = pcd_format::binary_compressed});
         return double(std::filesystem::file_size(folder / "c.pcd"));
       }},
  };
  bool good = true;
  for (const auto& r : rows) {
    const double share = measure(r.prepare, r.step);
    good = good && share >= 0 && share <= r.allowed;
    std::printf("%-24s %5.2f x (input + output)\n", r.name, share);
  }
  std::filesystem::remove_all(folder);
  return good ? 0 : 1;
}
