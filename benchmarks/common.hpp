// SPDX-License-Identifier: MIT
//
// What all benchmark programs share: the data, and the counter by which their results are compared.
#pragma once

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "pictures.hpp"

/// Edge of the voxels, in metres; neighbours of a point.
inline constexpr float voxel_edge = 0.01f;
inline constexpr int neighbor_count = 10, many_neighbors = 30;
/// Other voxels: of the frame, and of the large cloud.
inline constexpr float small_voxel_edge = 0.005f, large_voxel_edge = 0.02f;
/// What statistical outlier removal is asked with.
inline constexpr int outlier_neighbors = 20;
inline constexpr double outlier_deviations = 2;
/// Smooth segmentation: neighbours, the angle between normals (10 degrees), the smallest part.
inline constexpr int segment_neighbors = 30;
inline constexpr float segment_angle = 0.17453293f;
inline constexpr int segment_min_size = 50;
/// Clusters by density, and by distance.
inline constexpr double density_radius = 0.02;
inline constexpr int density_points = 10;
inline constexpr int kmeans_clusters = 100, kmeans_steps = 20;
/// The plane of a frame: samples, and the distance of an inlier.
inline constexpr int plane_samples = 200;
inline constexpr double plane_distance = 0.02;
/// The depth image of depth.u16.
inline constexpr int image_width = 640, image_height = 480;
inline constexpr float focal_length = 585;

inline std::string data_path(const char* name) {
  const char* folder = std::getenv("CILANTRO_BENCHMARK_DATA");
  return std::string{folder ? folder : "."} + "/" + name;
}

inline std::vector<float> read_floats(const char* name) {
  std::ifstream in{data_path(name), std::ios::binary};
  const std::vector<char> bytes{std::istreambuf_iterator<char>{in}, {}};
  if (bytes.empty()) {
    std::fprintf(stderr, "no data: run benchmarks/run.sh\n");
    std::exit(1);
  }
  const auto* first = reinterpret_cast<const float*>(bytes.data());
  return std::vector<float>{first, first + bytes.size() / sizeof(float)};
}

/// The frame, or what CILANTRO_BENCHMARK_FRAME names in its place: x, y and z of one point after
/// another.
inline const std::vector<float>& frame() {
  static const std::vector<float> points = [] {
    const char* name = std::getenv("CILANTRO_BENCHMARK_FRAME");
    return read_floats((std::string{name ? name : "frame"} + ".f32").c_str());
  }();
  return points;
}

/// A large cloud, and its normals.
inline const std::vector<float>& large_points() {
  static const std::vector<float> points = read_floats("large.f32");
  return points;
}
inline const std::vector<float>& large_normals() {
  static const std::vector<float> normals = read_floats("large_normals.f32");
  return normals;
}

/// A depth image in millimetres, row by row.
inline const std::vector<std::uint16_t>& depth_image() {
  static const std::vector<std::uint16_t> pixels = [] {
    std::ifstream in{data_path("depth.u16"), std::ios::binary};
    std::vector<std::uint16_t> all(std::size_t{image_width} * image_height);
    in.read(reinterpret_cast<char*>(all.data()), std::streamsize(all.size() * 2));
    return all;
  }();
  return pixels;
}

/// Two scans to be aligned by point-to-plane ICP: coordinates of one point after another. Some have
/// colours, too.
struct registration_pair {
  std::string name;
  double max_distance = 0;
  int iterations = 0;
  bool has_colors = false;
  std::vector<float> source, target, target_normals, source_colors, target_colors;
  std::array<double, 16> truth = {};  ///< From the source to the target, row by row.
};

inline const std::vector<registration_pair>& registration_pairs() {
  static const std::vector<registration_pair> pairs = [] {
    std::vector<registration_pair> all;
    std::ifstream in{data_path("pairs.txt")};
    for (registration_pair pair;
         in >> pair.name >> pair.max_distance >> pair.iterations >> pair.has_colors;) {
      for (double& x : pair.truth) in >> x;
      pair.source = read_floats((pair.name + "_source.f32").c_str());
      pair.target = read_floats((pair.name + "_target.f32").c_str());
      pair.target_normals = read_floats((pair.name + "_normals.f32").c_str());
      if (pair.has_colors) {
        pair.source_colors = read_floats((pair.name + "_source_colors.f32").c_str());
        pair.target_colors = read_floats((pair.name + "_target_colors.f32").c_str());
      }
      all.push_back(pair);
      pair = {};
    }
    return all;
  }();
  return pairs;
}

/// Numbers in [0, 1) that are the same everywhere.
class plain_random {
 public:
  explicit plain_random(std::uint64_t seed = 1) : state_{seed} {}
  double operator()() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return double(state_ >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

/// A cloud again and again, each time moved by up to half a voxel, until there are enough points.
struct many_points {
  explicit many_points(const std::vector<float>& cloud) : cloud{&cloud} {}
  std::array<float, 3> operator[](std::size_t i) const {
    const std::size_t size = cloud->size() / 3, from = 3 * (i % size);
    std::array<float, 3> p{(*cloud)[from], (*cloud)[from + 1], (*cloud)[from + 2]};
    if (i < size) return p;
    plain_random random{i};
    for (float& x : p) x += voxel_edge * float(random() - 0.5);
    return p;
  }
  const std::vector<float>* cloud;
  std::ptrdiff_t count = picture_points;
};
/// Uniform in a cube, as many as a frame has; and on the unit sphere.
inline const std::vector<float>& cube_points() {
  static const std::vector<float> points = [] {
    plain_random random;
    std::vector<float> all(3 * 270000);
    for (float& x : all) x = float(random());
    return all;
  }();
  return points;
}
inline const std::vector<float>& sphere_points() {
  static const std::vector<float> points = [] {
    plain_random random;
    std::vector<float> all;
    while (all.size() < 3 * 30000) {
      const double x = 2 * random() - 1, y = 2 * random() - 1, z = 2 * random() - 1;
      const double length = std::sqrt(x * x + y * y + z * z);
      if (length > 1 || length < 0.1) continue;
      all.insert(all.end(), {float(x / length), float(y / length), float(z / length)});
    }
    return all;
  }();
  return points;
}
/// Corners of boxes with edges of 0.4 to 1, whose lower corners are in a cube of the given edge.
inline std::vector<std::array<std::array<double, 3>, 2>> random_boxes(int count, double spread) {
  plain_random random;
  std::vector<std::array<std::array<double, 3>, 2>> boxes(count);
  for (auto& [low, high] : boxes)
    for (int d = 0; d < 3; ++d) {
      low[d] = spread * random();
      high[d] = low[d] + 0.4 + 0.6 * random();
    }
  return boxes;
}

/// A number that programs which did the same work agree on.
inline void report_result(benchmark::State& state, double result) {
  state.counters["result"] = result;
}

/// What has been found, by `at(row, column)`: how far the source was moved, in millimetres, which
/// all should agree on; and how far that is from the truth.
template <class At>
void report_pose(benchmark::State& state, const registration_pair& pair, At at) {
  double moved = 0, off = 0, turned = 0;
  const auto square = [](double x) { return x * x; };
  for (int i = 0; i < 3; ++i) {
    const auto truth = [&](int k) { return pair.truth[std::size_t(4 * i + k)]; };
    moved += square(at(i, 3));
    off += square(at(i, 3) - truth(3));
    for (int k = 0; k < 3; ++k) turned += square(at(i, k) - truth(k));
  }
  report_result(state, 1000 * std::sqrt(moved));
  state.counters["error_mm"] = 1000 * std::sqrt(off);
  // The Frobenius norm of what differs between two rotations is √8 sin(θ/2).
  state.counters["error_deg"] = 2 * std::asin(std::sqrt(turned / 8)) * 180 / 3.14159265358979;
}

using registration_benchmark = void(benchmark::State& state, const registration_pair& pair);

inline void register_icp(const std::string& name, registration_benchmark* run,
                         const registration_pair& pair) {
  benchmark::RegisterBenchmark((name + pair.name).c_str(),
                               [run, &pair](benchmark::State& state) { run(state, pair); })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime()
      ->MeasureProcessCPUTime();
}

/// In place of BENCHMARK_MAIN, since pairs are known at run time: a benchmark `icp_NAME` for each
/// pair of scans, and `colored_icp_NAME` for each with colours.
inline int run_benchmarks(int argc, char** argv, registration_benchmark* icp,
                          registration_benchmark* colored_icp = nullptr) {
  benchmark::Initialize(&argc, argv);
  for (const auto& pair : registration_pairs()) register_icp("icp_", icp, pair);
  for (const auto& pair : registration_pairs())
    if (colored_icp && pair.has_colors) register_icp("colored_icp_", colored_icp, pair);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

#define CILANTRO_BENCHMARK(function) \
  BENCHMARK(function)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime()
