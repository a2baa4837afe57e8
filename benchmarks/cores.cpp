// SPDX-License-Identifier: MIT
//
// What main steps would take with more cores than there are. Each block of a parallel section runs
// on one thread and is timed by the processor time that it takes; a section then takes as long as
// when so many threads take its blocks in turn, and what is outside of sections stays. Memory that
// threads share, and their starts, are not in the model.
//
//   cores [NAME] [sections]    steps whose names begin so; with the times of each section
#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel_backend.hpp"

import cilantro;

using namespace cilantro;

namespace {

constexpr std::array thread_counts{2, 8, 16};

double milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) * 1e3 + double(now.tv_nsec) * 1e-6;
}

struct section {
  double whole = 0;                                    ///< On one thread.
  std::array<double, thread_counts.size()> many = {};  ///< On so many.
};

std::vector<section> sections;
bool in_section = false, is_measuring = false;
double counting = 0;  // What this program itself takes between sections.

/// How long blocks take if each goes to the thread that is free first.
double span_of(const std::vector<double>& blocks, int threads) {
  std::priority_queue<double, std::vector<double>, std::greater<>> ends;
  for (int t = 0; t < threads; ++t) ends.push(0);
  double span = 0;
  for (const double block : blocks) {
    const double end = ends.top() + block;
    ends.pop();
    ends.push(end);
    span = std::max(span, end);
  }
  return span;
}

struct timed_job {
  const detail::block_job& job;
  std::vector<double> blocks = {};
};

}  // namespace

// The linker sends calls of the seam to OpenMP here.
// NOLINTBEGIN(bugprone-reserved-identifier)
bool real_run_blocks(const detail::block_job&) asm(
    "__real__ZN8cilantro6detail10run_blocksERKNS0_9block_jobE");
bool wrapped_run_blocks(const detail::block_job&) asm(
    "__wrap__ZN8cilantro6detail10run_blocksERKNS0_9block_jobE");
// NOLINTEND(bugprone-reserved-identifier)

bool wrapped_run_blocks(const detail::block_job& job) {
  detail::block_job alone = job;
  alone.threads = 1;
  if (!is_measuring || in_section) return real_run_blocks(alone);
  timed_job timed{job};
  alone.context = &timed;
  alone.run = [](void* context, std::ptrdiff_t block) {
    auto& all = *static_cast<timed_job*>(context);
    const double begin = milliseconds();
    all.job.run(all.job.context, block);
    all.blocks.push_back(milliseconds() - begin);
  };
  alone.stop_requested = nullptr;
  alone.report = nullptr;
  in_section = true;
  const double begin = milliseconds();
  const bool finished = real_run_blocks(alone);
  const double end = milliseconds();
  section now{end - begin, {}};
  in_section = false;
  for (std::size_t t = 0; t < thread_counts.size(); ++t)
    now.many[t] = span_of(timed.blocks, thread_counts[t]);
  sections.push_back(now);
  counting += milliseconds() - end;
  return finished;
}

int main(int argc, char** argv) {
  const std::string wanted = argc > 1 ? argv[1] : "";
  const bool shows_sections = argc > 2;
  constexpr index_t n = 1'000'000;
  Eigen::Matrix3Xf points(3, n);
  for (index_t i = 0; i < n; ++i) {
    random_stream random{1, std::uint64_t(i)};
    const double x = random.uniform(0, 10), y = random.uniform(0, 10);
    points.col(i) << float(x), float(y),
        float(0.3 * std::sin(x) * std::cos(y) + 0.01 * random.normal());
  }
  const kd_tree tree{points};
  const point_cloud<float, 3> target{.points = points,
                                     .normals = estimate_normals(points, knn{10}).normals};
  point_cloud<float, 3> source{.points = points};
  source.points.colwise() += Eigen::Vector3f{0.02f, 0.01f, 0.005f};
  const auto folder = std::filesystem::temp_directory_path() / "cilantro_cores";
  std::filesystem::create_directories(folder);
  write_text(target, folder / "a.xyz");
  write_ply(target, folder / "a.ply", {.format = ply_format::ascii});
  write_pcd(target, folder / "a.pcd", {.format = pcd_format::ascii});

  const std::vector<std::pair<std::string, std::function<void(int)>>> steps{
      {"tree", [&](int threads) { kd_tree{points, {.threads = threads}}; }},
      {"10 nearest",
       [&](int threads) { (void)find_neighborhoods(tree, points, knn{10}, {.threads = threads}); }},
      {"normals",
       [&](int threads) { (void)estimate_normals(points, knn{10}, {.threads = threads}); }},
      {"outliers",
       [&](int threads) {
         (void)statistical_outliers(points, {.neighbors = 10, .threads = threads});
       }},
      {"voxels of 2 cm",
       [&](int threads) { (void)voxel_downsample(points, 0.02, {.threads = threads}); }},
      {"voxels of 50 cm",
       [&](int threads) { (void)voxel_downsample(points, 0.5, {.threads = threads}); }},
      {"align",
       [&](int threads) {
         (void)align(source, target, {.max_distance = 0.1, .threads = threads});
       }},
      {"text",
       [&](int threads) { (void)read_cloud<float>(folder / "a.xyz", {.threads = threads}); }},
      {"ascii PLY",
       [&](int threads) { (void)read_cloud<float>(folder / "a.ply", {.threads = threads}); }},
      {"ascii PCD",
       [&](int threads) { (void)read_cloud<float>(folder / "a.pcd", {.threads = threads}); }},
  };
  for (const auto& [name, step] : steps) {
    if (!name.starts_with(wanted)) continue;
    constexpr int rounds = 3;
    double one = std::numeric_limits<double>::infinity(), whole = one, serial = 0;
    std::vector<section> best;
    for (int round = 0; round < rounds; ++round) {
      double begin = milliseconds();
      step(1);
      one = std::min(one, milliseconds() - begin);
      sections.clear();
      counting = 0;
      is_measuring = true;
      begin = milliseconds();
      step(thread_counts.back());
      const double took = milliseconds() - begin - counting;
      is_measuring = false;
      if (took >= whole) continue;
      whole = serial = took;
      for (const section& s : sections) serial -= s.whole;
      best = sections;
    }
    std::printf("%-16s 1: %7.1f ms", name.c_str(), one);
    for (std::size_t t = 0; t < thread_counts.size(); ++t) {
      double time = serial;
      for (const section& s : best) time += s.many[t];
      std::printf("   %d: %6.1f ms, %4.1f x", thread_counts[t], time, one / time);
    }
    std::printf("   %zu sections, %.1f ms outside\n", best.size(), serial);
    if (shows_sections)
      for (const section& s : best) std::printf("    %8.2f -> %8.2f ms\n", s.whole, s.many.back());
  }
  std::filesystem::remove_all(folder);
}
