// SPDX-License-Identifier: MIT
//
// A camera that goes around a sphere in rings and looks outwards: a pose graph whose truth is
// known.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common.hpp"

struct graph_pose {
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< Row by row.
  std::array<double, 3> translation = {};

  /// First `other`, then this.
  [[nodiscard]] graph_pose operator*(const graph_pose& other) const {
    graph_pose both;
    for (std::size_t i = 0; i < 3; ++i) {
      both.translation[i] = translation[i];
      for (std::size_t k = 0; k < 3; ++k) {
        both.rotation[3 * i + k] = 0;
        for (std::size_t j = 0; j < 3; ++j)
          both.rotation[3 * i + k] += rotation[3 * i + j] * other.rotation[3 * j + k];
        both.translation[i] += rotation[3 * i + k] * other.translation[k];
      }
    }
    return both;
  }
  [[nodiscard]] graph_pose inverse() const {
    graph_pose back;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        back.rotation[3 * i + k] = rotation[3 * k + i];
        back.translation[i] -= rotation[3 * k + i] * translation[k];
      }
    return back;
  }
};

struct sphere_graph {
  static constexpr int rings = 40, around = 50;
  static constexpr double radius = 10;
  /// The standard deviation of an edge, in radians and in units.
  static constexpr double noise = 0.005;

  /// `transform` moves points of node `source` to the coordinates of node `target`.
  struct edge {
    int source, target;
    graph_pose transform;
  };
  std::vector<graph_pose> truth;
  std::vector<graph_pose> start;  ///< Along the edges from each node to the next.
  std::vector<edge> edges;        ///< To the next node, and to the next ring.

  sphere_graph() {
    for (int ring = 0; ring < rings; ++ring)
      for (int k = 0; k < around; ++k) {
        const double angle = 2 * 3.14159265358979 * k / around;
        const double z = 1.8 * ring / (rings - 1) - 0.9, w = std::sqrt(1 - z * z);
        const double c = std::cos(angle), s = std::sin(angle);
        // Columns: outwards, along the ring, and across.
        truth.push_back({{w * c, -s, -z * c, w * s, c, -z * s, z, 0, w},
                         {radius * w * c, radius * w * s, radius * z}});
      }
    plain_random random;
    for (int i = 0; i < int(truth.size()); ++i)
      for (const int next : {i + 1, i + around})
        if (next < int(truth.size()))
          edges.push_back(
              {next, i,
               error(random) * truth[std::size_t(i)].inverse() * truth[std::size_t(next)]});
    start = truth;
    for (const auto& e : edges)
      if (e.source == e.target + 1)
        start[std::size_t(e.source)] = start[std::size_t(e.target)] * e.transform;
  }

  /// How far nodes are from the truth, root mean square, by `at(node, axis)`.
  template <class At>
  void report(benchmark::State& state, At at) const {
    double sum = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        sum += std::pow(at(i, axis) - truth[i].translation[axis], 2);
    report_result(state, std::sqrt(sum / double(truth.size())));
  }

 private:
  /// A small motion; sums of uniform numbers are nearly normal.
  static graph_pose error(plain_random& random) {
    const auto normal = [&] {
      double sum = -6;
      for (int i = 0; i < 12; ++i) sum += random();
      return noise * sum;
    };
    const double x = normal(), y = normal(), z = normal();
    const double angle = std::sqrt(x * x + y * y + z * z);
    const double a = std::sin(angle) / angle, b = (1 - std::cos(angle)) / (angle * angle);
    return {{1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y,  //
             b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x,  //
             b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y)},
            {normal(), normal(), normal()}};
  }
};

inline const sphere_graph& graph_of_sphere() {
  static const sphere_graph graph;
  return graph;
}
