// SPDX-License-Identifier: MIT
//
// A neighbour searcher of your own that answers queries by blocks, as one on a graphics card or on
// another machine would: the library hands it many queries at once wherever it has many.
#include <algorithm>
#include <cstdint>
#include <iostream>
#include <vector>

import cilantro;
import simulated_room;
using namespace cilantro;

/// Compares each query with all points. `answer` stands for what runs elsewhere: it takes queries
/// one after another and returns what is found for all of them.
class block_searcher {
 public:
  using scalar = double;
  static constexpr int static_dimension = 3;

  explicit block_searcher(const Eigen::Matrix3Xd& points) : points_{points} {}

  [[nodiscard]] index_t size() const { return points_.cols(); }
  [[nodiscard]] index_t dimension() const { return 3; }

  void find(const Eigen::Vector3d& query, neighborhood_spec spec,
            std::vector<neighbor<double>>& out) const {
    const auto found = answer(query, {0}, spec);
    const auto block = found.view();
    out.assign(block[0].begin(), block[0].end());
  }
  void visit_all(points_view<double, 3> queries, neighborhood_spec spec,
                 const neighborhood_visitor<double>& visit, const visit_options& options) const {
    constexpr std::size_t block_size = 512;
    std::vector<std::int32_t> names;
    Eigen::Matrix3Xd block(3, block_size);
    const auto send = [&] {
      if (options.monitor.stop.stop_requested()) throw cancelled{};
      visit(answer(block.leftCols(std::ssize(names)), names, spec).view());
      names.clear();
    };
    for (std::int32_t q = 0; q < queries.size(); ++q) {
      if (!options.wanted.empty() && options.wanted[std::size_t(q)] == 0) continue;
      block.col(std::ssize(names)) = queries[q];
      names.push_back(q);
      if (names.size() == block_size) send();
    }
    if (!names.empty()) send();
  }

 private:
  [[nodiscard]] found_block<double> answer(const Eigen::Ref<const Eigen::Matrix3Xd>& queries,
                                           const std::vector<std::int32_t>& names,
                                           neighborhood_spec spec) const {
    found_block<double> found;
    std::vector<neighbor<double>> near;
    for (index_t i = 0; i < queries.cols(); ++i) {
      near.clear();
      for (index_t p = 0; p < points_.cols(); ++p)
        if (const double distance = (points_.col(p) - queries.col(i)).norm();
            distance <= spec.max_distance())
          near.push_back({p, distance});
      const auto count = std::min<index_t>(std::ssize(near), spec.max_count());
      std::ranges::partial_sort(near, near.begin() + count, [](const auto& a, const auto& b) {
        return a.distance != b.distance ? a.distance < b.distance : a.index < b.index;
      });
      near.resize(std::size_t(count));
      found.add(names[std::size_t(i)], near);
    }
    return found;
  }

  Eigen::Matrix3Xd points_;
};

int main() {
  const auto frame = simulate(0, {.width = 64, .height = 48});
  const auto cloud = cloud_from_depth(frame.depth, frame.camera) | voxel_downsample(0.1);
  const block_searcher searcher{cloud.points};
  for (const auto& sentence : check_neighbor_searcher(searcher, cloud.points))
    std::cout << sentence << '\n';

  const auto near = find_neighborhoods(searcher, cloud, knn{8});
  const auto parts = dbscan(searcher, cloud, {.radius = 0.25, .min_points = 5});
  std::cout << near.total() << " neighbours, " << parts.size() << " dense parts\n";
  const bool same = std::ranges::equal(near.indices(),
                                       find_neighborhoods(kd_tree{cloud}, cloud, knn{8}).indices());
  return same && !parts.empty() ? 0 : 1;
}
