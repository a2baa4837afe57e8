// SPDX-License-Identifier: MIT
//
// What the programs of `run.sh global` share: frames of a depth camera, the pairs of them that are
// to be aligned from anywhere, and the lines that say what was found.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

/// The edge of the voxels, in metres; radii of normals and features; the distance of a right pair;
/// and the one within which a transform is refined.
inline constexpr double global_voxel = 0.05, global_normals = 0.1, global_features = 0.25,
                        planes_within = 0.1, generalized_within = 0.05;

using rows_of_matrix = std::array<double, 16>;

/// A pair of frames, from the second to the first.
struct frame_pair {
  std::size_t target = 0, source = 0;
  double overlap = 0;
  bool is_sampled = false;  ///< Whether slow programs try it, too.
};

struct global_task {
  std::vector<std::string> names;
  std::vector<std::vector<float>> frames;  ///< x, y and z of one voxel after another.
  std::vector<frame_pair> pairs;
};

inline std::vector<float> floats_in(const std::string& path) {
  std::ifstream in{path, std::ios::binary};
  const std::vector<char> bytes{std::istreambuf_iterator<char>{in}, {}};
  if (bytes.empty()) {
    std::fprintf(stderr, "%s: no data: run benchmarks/run.sh global\n", path.c_str());
    std::exit(1);
  }
  const auto* first = reinterpret_cast<const float*>(bytes.data());
  return std::vector<float>{first, first + bytes.size() / sizeof(float)};
}

inline global_task read_global_task(const std::string& folder) {
  global_task task;
  std::ifstream names{folder + "/frames.txt"};
  for (std::string name; names >> name;) {
    task.names.push_back(name);
    task.frames.push_back(floats_in(folder + "/" + name + ".f32"));
  }
  std::ifstream pairs{folder + "/pairs.txt"};
  for (frame_pair pair; pairs >> pair.target >> pair.source >> pair.overlap >> pair.is_sampled;) {
    std::string rest;
    std::getline(pairs, rest);
    task.pairs.push_back(pair);
  }
  return task;
}

/// Time in milliseconds, by the clock and of all threads of this process.
struct stopwatch {
  std::chrono::steady_clock::time_point began = std::chrono::steady_clock::now();
  std::clock_t used = std::clock();

  [[nodiscard]] double wall() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began)
        .count();
  }
  [[nodiscard]] double processor() const {
    return 1e3 * double(std::clock() - used) / CLOCKS_PER_SEC;
  }
};

/// One line a pair, which global.py reads.
class found_writer {
 public:
  explicit found_writer(const std::string& path) : out_{std::fopen(path.c_str(), "w")} {
    if (!out_) std::exit(1);
  }
  ~found_writer() { std::fclose(out_); }
  found_writer(const found_writer&) = delete;
  found_writer& operator=(const found_writer&) = delete;

  void features(std::size_t frames, const stopwatch& watch) {
    std::fprintf(out_, "features %.3f %.3f\n", watch.wall() / double(frames),
                 watch.processor() / double(frames));
  }
  /// The pair, the times of finding it and of refining it by planes, what the program calls the
  /// result, and the transforms: as found, refined by planes, and by generalised ICP.
  void pair(const frame_pair& pair, const std::array<double, 2>& found,
            const std::array<double, 2>& refined, const char* status,
            const std::array<rows_of_matrix, 3>& transforms) {
    std::fprintf(out_, "pair %zu %zu %.3f %.3f %.3f %.3f %s", pair.target, pair.source, found[0],
                 found[1], refined[0], refined[1], status);
    for (const auto& matrix : transforms)
      for (const double x : matrix) std::fprintf(out_, " %.9g", x);
    std::fprintf(out_, "\n");
  }

 private:
  std::FILE* out_;
};
