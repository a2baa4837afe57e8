// SPDX-License-Identifier: MIT
//
// Sets of points with known classes: how well each algorithm finds them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import clustering_support;
import test_support;

using namespace cilantro;

namespace {

struct agreement {
  double ari = -1, nmi = 0;
};

agreement judge(const clusters& found, const test::labelled_points& truth) {
  return {adjusted_rand_index(found.labels(), truth.labels),
          normalized_mutual_information(found.labels(), truth.labels)};
}

/// The median distance to the k-th other point.
double spacing(const Eigen::MatrixXd& points, index_t k) {
  std::vector<double> all;
  for (const auto& near : find_neighborhoods(kd_tree{points}, points, knn{k + 1}))
    all.push_back(near[k].distance);
  std::ranges::nth_element(all, all.begin() + std::ssize(all) / 2);
  return all[all.size() / 2];
}

/// The best that one parameter of an algorithm can do, out of a geometric series.
template <class F>
agreement best_of(double from, double to, int steps, const test::labelled_points& truth, F run) {
  agreement best;
  if (from == to) steps = 1;
  for (int k = 0; k < steps; ++k) {
    const auto score =
        judge(run(from * std::pow(to / from, double(k) / std::max(1, steps - 1))), truth);
    if (score.ari > best.ari) best = score;
  }
  return best;
}

/// Edges of a neighbour graph, weighed by the spacing around their ends.
sparse_matrix affinity(const Eigen::MatrixXd& points, index_t neighbors) {
  const auto graph = neighbor_graph(points, knn{neighbors});
  std::vector<double> scale;
  for (const auto& near : graph)
    scale.push_back(near.empty() ? 1 : near[std::ssize(near) / 2].distance);
  return pair_matrix(graph, [&](index_t i, index_t j, double distance) {
    const double s = scale[std::size_t(i)] * scale[std::size_t(j)];
    return s > 0 ? std::exp(-distance * distance / s) : 1.0;
  });
}

struct expected {
  const char* name;
  // The least that each has to reach; −1 where the algorithm does not suit the set. (k-means of
  // iris and of standardised wine has the values of the textbooks, 0.730 and 0.897.)
  double kmeans, spectral, dbscan, hdbscan, mean_shift;
};

}  // namespace

TEST_CASE("the classes of labelled sets are found by the algorithms that suit them") {
  const auto folder = test::data_file("reference/clustering");
  SKIP_WITHOUT(folder);
  const expected sets[] = {
      {"3-spiral", -1, -1, 1, 0.98, -1},
      {"D31", 0.95, 0.94, -1, -1, 0.94},
      {"R15", 0.99, 0.98, 0.91, 0.94, 0.99},
      {"aggregation", 0.76, 0.99, 0.87, 0.8, 0.99},
      {"chainlink", -1, 1, 1, 1, -1},
      {"compound", 0.53, -1, 0.96, 0.83, -1},
      {"donut2", -1, 0.99, 0.98, 0.97, 0.97},
      {"flame", -1, 0.94, 0.88, -1, 0.88},
      {"hepta", 1, 1, 1, 1, 1},
      {"iris", 0.73, 0.75, -1, -1, -1},
      {"jain", -1, 1, 0.93, 0.93, -1},
      {"s-set1", 0.99, 0.98, 0.95, 0.95, 0.99},
      {"s-set2", 0.95, 0.95, -1, -1, 0.96},
      {"smile1", -1, 1, 1, 1, 1},
      {"target", -1, 1, 0.99, 0.96, -1},
      {"tetra", 1, 1, 0.9, -1, 0.99},
      {"twodiamonds", 1, 1, 0.87, -1, 1},
      {"wine", 0.89, 0.87, -1, -1, -1},
  };
  std::string table =
      "\nset          classes  points  k-means      spectral     DBSCAN       HDBSCAN*     mean "
      "shift (ARI NMI)\n";
  for (const auto& set : sets) {
    CAPTURE(set.name);
    const std::string name = set.name;
    auto data = test::read_arff(*folder / (name + ".arff"), name == "wine");
    if (name == "wine") test::standardize(data.points);
    const double near = spacing(data.points, 4);
    const agreement found[] = {
        judge(kmeans(data.points, data.classes, {.restarts = 50}), data),
        // Of large sets with one graph, for the time it takes.
        best_of(data.points.cols() > 2000 ? 10 : 5, 10, 3, data,
                [&](double k) -> clusters {
                  return spectral_clustering(affinity(data.points, index_t(k)),
                                             {.clusters = data.classes, .kmeans_restarts = 30});
                }),
        best_of(near / 2, 8 * near, 40, data,
                [&](double r) -> clusters { return dbscan(data.points, {.radius = r}); }),
        best_of(4, std::max(5.0, double(data.points.cols()) / 4), 12, data,
                [&](double size) -> clusters {
                  return hdbscan(data.points, knn{30},
                                 {.min_cluster_size = index_t(size), .min_points = 5});
                }),
        best_of(2 * near, 20 * near, 8, data, [&](double h) -> clusters {
          // From all points; of many only from some, which are enough to find the modes.
          if (data.points.cols() <= 1000)
            return mean_shift(data.points, h, flat_kernel{}, {.max_iterations = 100});
          const index_t step = data.points.cols() / 500;
          Eigen::MatrixXd seeds(data.points.rows(), data.points.cols() / step);
          for (index_t i = 0; i < seeds.cols(); ++i) seeds.col(i) = data.points.col(i * step);
          return mean_shift(data.points, seeds, h, flat_kernel{}, {.max_iterations = 100});
        })};
    char line[200];
    std::snprintf(line, sizeof line, "%-12s %7d %7d", set.name, int(data.classes),
                  int(data.points.cols()));
    table += line;
    for (const auto& [ari, nmi] : found) {
      std::snprintf(line, sizeof line, "  %5.3f %5.3f", ari, nmi);
      table += line;
    }
    table += '\n';
    CHECK(found[0].ari >= set.kmeans);
    CHECK(found[1].ari >= set.spectral);
    CHECK(found[2].ari >= set.dbscan);
    CHECK(found[3].ari >= set.hdbscan);
    CHECK(found[4].ari >= set.mean_shift);
  }
  MESSAGE(table);
}
