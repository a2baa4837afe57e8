// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "common.hpp"

import cilantro;
using namespace cilantro;

namespace {

/// Two clouds of which one is bent onto the other.
struct bending_pair {
  std::string name;
  double spacing = 0, max_distance = 0;
  bool have_truth = false;  ///< Point i of the source belongs onto point i of the target.
  std::vector<float> source, target, target_normals;

  [[nodiscard]] points_view<float, 3> moving() const {
    return {source.data(), std::ssize(source) / 3};
  }
  [[nodiscard]] points_view<float, 3> onto() const {
    return {target.data(), std::ssize(target) / 3};
  }
  [[nodiscard]] points_view<float, 3> normals() const {
    return {target_normals.data(), std::ssize(target_normals) / 3};
  }
};

using field = warp_field<float, 3>;

/// How well the source lies on the target: distances along the normals of the nearest target points
/// that are no farther than 2 cm, in millimetres, and the share of the points that have one.
void report_fit(benchmark::State& state, const bending_pair& pair, const field& found) {
  const oriented_points_view<float, 3> target{pair.onto(), pair.normals()};
  const nearest_neighbor_searcher searcher{pair.moving(), target, {.max_distance = 0.02}};
  correspondences<float> pairs;
  searcher.find(found, pairs);
  double sum = 0;
  for (const auto& [s, t, distance] : pairs) {
    const double along = (found(s, pair.moving()[s]) - pair.onto()[t])
                             .cast<double>()
                             .dot(pair.normals()[t].cast<double>());
    sum += along * along;
  }
  state.counters["plane_rms_mm"] =
      1000 * std::sqrt(sum / double(std::max<index_t>(1, std::ssize(pairs))));
  state.counters["share"] = double(pairs.size()) / double(pair.moving().size());
  double off = 0;
  for (index_t i = 0; i < pair.moving().size(); ++i) {
    const auto p = found(i, pair.moving()[i]);
    off += pair.have_truth ? double((p - pair.onto()[i]).squaredNorm())
                           : double((p - pair.moving()[i]).squaredNorm());
  }
  off = 1000 * std::sqrt(off / double(pair.moving().size()));
  if (pair.have_truth) state.counters["error_mm"] = off;
  report_result(state, off);
}

void whole(benchmark::State& state, const bending_pair& pair) {
  const oriented_points_view<float, 3> source{pair.moving(), points_view<float, 3>{}};
  const oriented_points_view<float, 3> target{pair.onto(), pair.normals()};
  non_rigid_result<float, 3> found;
  for (auto _ : state)
    found = align_non_rigid(source, target,
                            {.spacing = pair.spacing, .max_distance = pair.max_distance});
  state.counters["nodes"] = double(found.transform.graph().nodes().size());
  state.counters["iterations"] = found.iterations;
  report_fit(state, pair, found.transform);
}

/// A search and a step, all points and nodes, from a field that has been there before.
void one_iteration(benchmark::State& state, const bending_pair& pair) {
  const oriented_points_view<float, 3> source{pair.moving(), points_view<float, 3>{}};
  const oriented_points_view<float, 3> target{pair.onto(), pair.normals()};
  const nearest_neighbor_searcher searcher{source, target, {.max_distance = pair.max_distance}};
  const deformation_graph graph{pair.moving(), {.spacing = pair.spacing}};
  const warp_estimator estimator{
      source, target, graph, point_to_plane{}, {.robust = welsch{pair.spacing / 4}}};
  decltype(searcher)::memory near;
  decltype(estimator)::memory memory;
  correspondences<float> pairs;
  field now = estimator.identity();
  const auto improve = [&] {
    searcher.find(now, near, pairs);
    now = estimator.estimate(now, pairs, memory).transform;
  };
  for (int i = 0; i < 10; ++i) improve();
  const field settled = now;
  for (auto _ : state) improve();
  state.counters["nodes"] = double(graph.nodes().size());
  report_fit(state, pair, settled);
}

const std::vector<bending_pair>& bending_pairs() {
  static const std::vector<bending_pair> pairs = [] {
    std::vector<bending_pair> all;
    std::ifstream in{data_path("bending_pairs.txt")};
    for (bending_pair pair;
         in >> pair.name >> pair.spacing >> pair.max_distance >> pair.have_truth;) {
      pair.source = read_floats((pair.name + "_source.f32").c_str());
      pair.target = read_floats((pair.name + "_target.f32").c_str());
      pair.target_normals = read_floats((pair.name + "_normals.f32").c_str());
      all.push_back(pair);
    }
    return all;
  }();
  return pairs;
}

/// One for each pair; none where the data is not there.
const bool registered = [] {
  for (const auto& pair : bending_pairs())
    for (const auto& [name, run] :
         {std::pair{"align_non_rigid_", &whole}, std::pair{"warp_iteration_", &one_iteration}})
      benchmark::RegisterBenchmark((name + pair.name).c_str(),
                                   [run, &pair](benchmark::State& state) { run(state, pair); })
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime()
          ->MeasureProcessCPUTime();
  return true;
}();

}  // namespace
