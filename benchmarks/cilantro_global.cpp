// SPDX-License-Identifier: MIT
//
// Pairs of frames from anywhere, and what is generated. `benchmarks/run.sh global` runs it:
//
//   global_cilantro pairs FOLDER OUT THREADS viewpoints|plain [graph|samples|graduated]
//   global_cilantro figures FOLDER
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "global_pairs.hpp"

import cilantro;
using namespace cilantro;

namespace {

using cloud_type = point_cloud<float, 3>;

cloud_type cloud_of(const std::vector<float>& xyz) {
  return {.points = Eigen::Map<const Eigen::Matrix3Xf>{xyz.data(), 3, std::ssize(xyz) / 3}};
}
rows_of_matrix rows_of(const Eigen::Isometry3f& transform) {
  rows_of_matrix rows;
  for (int i = 0; i < 16; ++i) rows[std::size_t(i)] = double(transform.matrix()(i / 4, i % 4));
  return rows;
}

void align_pairs(const std::string& folder, const std::string& out, int threads, bool viewpoints,
                 const std::string& solver) {
  const auto task = read_global_task(folder);
  std::vector<cloud_type> clouds;
  for (const auto& frame : task.frames) clouds.push_back(cloud_of(frame));
  found_writer results{out};
  std::vector<described_surface<float, 3>> described;
  surface_options how{.voxel = global_voxel, .threads = threads};
  if (viewpoints) how.viewpoint = coordinates{0, 0, 0};
  (void)describe_surface(clouds[0], how);
  const stopwatch describing;
  for (const auto& cloud : clouds) described.push_back(describe_surface(cloud, how));
  results.features(clouds.size(), describing);

  std::vector<cloud_type> with_normals;
  for (const auto& cloud : clouds)
    with_normals.push_back(cloud | estimate_normals(radius{global_normals}));
  global_options options{.threads = threads};
  if (solver == "samples") options.solver = sampled_pairs{};
  if (solver == "graduated") options.solver = graduated_pairs{};
  for (const auto& pair : task.pairs) {
    if (solver != "graph" && !pair.is_sampled) continue;
    const auto i = index_t(pair.target), j = index_t(pair.source);
    const stopwatch finding;
    const auto found = align_globally(described[j], described[i], options);
    const std::array spent{finding.wall(), finding.processor()};
    const stopwatch refining;
    const auto fine =
        align(with_normals[j], with_normals[i],
              {.initial = found.transform, .max_distance = planes_within, .threads = threads});
    const std::array then{refining.wall(), refining.processor()};
    const auto finer = align(with_normals[j], with_normals[i],
                             {.metric = generalized_icp{},
                              .initial = found.transform,
                              .max_distance = generalized_within,
                              .threads = threads});
    results.pair(pair, spent, then, std::string{to_string(found.status)}.c_str(),
                 {rows_of(found.transform), rows_of(fine.transform), rows_of(finer.transform)});
  }
}

/// The least of five, in milliseconds of all threads.
template <class F>
double least(F run) {
  double best = 1e300;
  for (int i = 0; i < 5; ++i) {
    const stopwatch watch;
    run();
    best = std::min(best, watch.processor());
  }
  return best;
}

void print_features(const std::string& folder) {
  const auto task = read_global_task(folder);
  double normals = 0, features = 0, points = 0;
  for (std::size_t f = 0; f < task.frames.size(); f += 6) {
    const auto cloud = cloud_of(task.frames[f]);
    const auto with_normals =
        cloud | estimate_normals(radius{global_normals}, {.viewpoint = {{0, 0, 0}}, .threads = 1});
    normals += least([&] {
      (void)(cloud |
             estimate_normals(radius{global_normals}, {.viewpoint = {{0, 0, 0}}, .threads = 1}));
    });
    features += least([&] {
      (void)fpfh(with_normals, radius{global_features}, {.oriented = true, .threads = 1});
    });
    points += double(cloud.size());
  }
  const double frames = double((task.frames.size() + 5) / 6);
  std::printf("normals %.2f ms, features %.2f ms a frame of %.0f points\n", normals / frames,
              features / frames, points / frames);

  const auto read = [&](const char* name) {
    const auto values = floats_in(folder + "/" + name);
    return Eigen::MatrixXf{
        Eigen::Map<const Eigen::MatrixXf>{values.data(), 33, std::ssize(values) / 33}};
  };
  const auto a = read("features_a.f32"), b = read("features_b.f32");
  correspondences<float> products;
  const double by_products = least([&] { products = match_features(a, b, {.threads = 1}); });
  index_t mutual = 0;
  const double by_trees = least([&] {
    const kd_tree tree_a{a}, tree_b{b};
    const auto onto_b = tree_b.find_all(a, knn{1}, {.threads = 1}),
               onto_a = tree_a.find_all(b, knn{1}, {.threads = 1});
    mutual = 0;
    for (index_t i = 0; i < a.cols(); ++i) mutual += onto_a[onto_b[i][0].index][0].index == i;
  });
  std::printf(
      "matching %td by %td features of 33 dimensions: %.1f ms by products (%zu pairs), %.1f by "
      "trees (%td pairs)\n",
      a.cols(), b.cols(), by_products, products.size(), by_trees, mutual);
}

/// Points in a unit cube, and the same moved, with noise; the partners of wrong pairs are anywhere.
template <int D>
void print_generated(index_t count, index_t right, double noise, int seeds) {
  int found_right = 0, unique = 0, false_unique = 0;
  double all = 0, longest = 0, worst = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    random_stream random{std::uint64_t(seed), 7};
    point_matrix<double, D> source(D, count), target(D, count);
    Eigen::Matrix<double, D, D> any;
    for (auto& x : any.reshaped()) x = random.normal();
    const Eigen::Matrix<double, D, D> turn = nearest_rotation(any);
    point_vector<double, D> shift;
    for (auto& x : shift) x = random.uniform(-5, 5);
    correspondences<double> pairs;
    for (index_t i = 0; i < count; ++i) {
      point_vector<double, D> p, other;
      for (auto& x : p) x = random.uniform(0, 1);
      for (auto& x : other) x = random.uniform(0, 1);
      const bool is_right = (i * right) / count != ((i + 1) * right) / count;
      source.col(i) = p;
      target.col(i) = turn * (is_right ? p : other) + shift;
      if (is_right)
        for (auto& x : target.col(i)) x += noise * random.normal();
      pairs.push_back({std::int32_t(i), std::int32_t(i), 0});
    }
    const stopwatch watch;
    const auto found =
        align_globally(source, target, pairs, {.max_distance = 3 * noise, .threads = 1});
    all += watch.processor();
    longest = std::max(longest, watch.processor());
    const double error =
        (found.transform.linear() - turn).norm() + (found.transform.translation() - shift).norm();
    const bool good = right > 0 && error < 6 * noise;
    found_right += good;
    unique += found.is_unique() && good;
    false_unique += found.is_unique() && !good;
    if (good) worst = std::max(worst, error);
  }
  std::printf(
      "%dD, %td pairs, %td right, noise %g: %d of %d right, %d unique and right, %d false; %.1f ms "
      "in the "
      "mean, %.1f at most; at most %.4f off\n",
      D, count, right, noise, found_right, seeds, unique, false_unique, all / seeds, longest,
      worst);
}

void print_figures(const std::string& folder) {
  print_features(folder);
  print_generated<3>(5000, 50, 0.01, 100);
  print_generated<3>(5000, 25, 0.01, 20);
  print_generated<3>(1000, 50, 0.01, 20);
  print_generated<3>(5000, 5000, 0.01, 5);
  print_generated<3>(5000, 0, 0.01, 20);
  print_generated<2>(5000, 50, 0.01, 20);
  print_generated<3>(20000, 200, 0.005, 3);
}

}  // namespace

int main(int count, char** arguments) {
  const std::vector<std::string> given(arguments + 1, arguments + count);
  if (given.size() >= 5 && given[0] == "pairs") {
    align_pairs(given[1], given[2], std::stoi(given[3]), given[4] == "viewpoints",
                given.size() > 5 ? given[5] : "graph");
  } else if (given.size() == 2 && given[0] == "figures") {
    print_figures(given[1]);
  } else {
    std::fprintf(stderr, "the head of cilantro_global.cpp says how\n");
    return 1;
  }
  return 0;
}
