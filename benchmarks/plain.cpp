// SPDX-License-Identifier: MIT
//
// What a careful user writes without a library: nanoflann, Eigen, an ordered map, and OpenMP over
// points. For files, the bound: what reading or writing the same bytes costs.
#include <omp.h>

#include <Eigen/Dense>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <nanoflann.hpp>
#include <numeric>
#include <utility>
#include <vector>

#include "common.hpp"

namespace {

struct adaptor {
  const std::vector<float>& xyz = frame();
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return xyz.size() / 3; }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t d) const { return xyz[3 * i + d]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
#if NANOFLANN_VERSION >= 0x150
using search_result = nanoflann::ResultItem<std::uint32_t, float>;
#else
using search_result = std::pair<std::uint32_t, float>;
#endif
using tree_type = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, adaptor>,
                                                      adaptor, 3, std::uint32_t>;

struct indexed_frame {
  adaptor points;
  tree_type tree{3, points, nanoflann::KDTreeSingleIndexAdaptorParams(10)};
  [[nodiscard]] int size() const { return int(points.xyz.size() / 3); }
  [[nodiscard]] const float* operator[](int i) const { return points.xyz.data() + 3 * i; }
};

void tree_build(benchmark::State& state) {
  for (auto _ : state) {
    const indexed_frame indexed;
    benchmark::DoNotOptimize(indexed.tree.vAcc.data());
  }
  report_result(state, double(frame().size() / 3));
}
CILANTRO_BENCHMARK(tree_build);

template <int K>
void knn_search(benchmark::State& state) {
  const indexed_frame indexed;
  const int n = indexed.size();
  double sum = 0;
  for (auto _ : state) {
    std::vector<std::uint32_t> indices(std::size_t(n) * K);
    std::vector<float> distances(indices.size());
#pragma omp parallel for schedule(dynamic, 256)
    for (int i = 0; i < n; ++i) {
      float* d = distances.data() + std::size_t(i) * K;
      indexed.tree.knnSearch(indexed[i], K, indices.data() + std::size_t(i) * K, d);
      for (int k = 0; k < K; ++k) d[k] = std::sqrt(d[k]);
    }
    benchmark::DoNotOptimize(distances.data());
    state.PauseTiming();
    sum = std::accumulate(distances.begin(), distances.end(), 0.0);
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void knn_of_all(benchmark::State& state) {
  knn_search<neighbor_count>(state);
}
CILANTRO_BENCHMARK(knn_of_all);
void knn_30_of_all(benchmark::State& state) {
  knn_search<many_neighbors>(state);
}
CILANTRO_BENCHMARK(knn_30_of_all);

void radius_of_all(benchmark::State& state) {
  const indexed_frame indexed;
  const int n = indexed.size();
  double sum = 0;
  for (auto _ : state) {
    std::vector<std::vector<search_result>> found(std::size_t{0} + n);
#pragma omp parallel for schedule(dynamic, 256)
    for (int i = 0; i < n; ++i) {
      indexed.tree.radiusSearch(indexed[i], voxel_edge * voxel_edge, found[std::size_t(i)], {});
      for (auto& [index, distance] : found[std::size_t(i)]) distance = std::sqrt(distance);
    }
    benchmark::DoNotOptimize(found.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& near : found)
      for (const auto& [index, distance] : near) sum += distance;
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(radius_of_all);

/// In any order and not kept: only the sum of the distances of each point.
void radius_any_order(benchmark::State& state) {
  const indexed_frame indexed;
  const int n = indexed.size();
  std::vector<float> sums(std::size_t{0} + n);
#if NANOFLANN_VERSION >= 0x150
  const nanoflann::SearchParameters unsorted{0, false};
#else
  const nanoflann::SearchParams unsorted{32, 0, false};
#endif
  for (auto _ : state) {
#pragma omp parallel
    {
      std::vector<search_result> found;
#pragma omp for schedule(dynamic, 256)
      for (int i = 0; i < n; ++i) {
        indexed.tree.radiusSearch(indexed[i], voxel_edge * voxel_edge, found, unsorted);
        float sum = 0;
        for (const auto& [index, distance] : found) sum += std::sqrt(distance);
        sums[std::size_t(i)] = sum;
      }
    }
  }
  report_result(state, std::accumulate(sums.begin(), sums.end(), 0.0));
}
CILANTRO_BENCHMARK(radius_any_order);

void normals(benchmark::State& state) {
  double sum = 0;
  for (auto _ : state) {
    const indexed_frame indexed;
    const int n = indexed.size();
    Eigen::Matrix3Xf normals(3, n);
    Eigen::VectorXf curvature(n);
#pragma omp parallel for schedule(dynamic, 256)
    for (int i = 0; i < n; ++i) {
      std::array<std::uint32_t, neighbor_count> near;
      std::array<float, neighbor_count> distances;
      indexed.tree.knnSearch(indexed[i], neighbor_count, near.data(), distances.data());
      Eigen::Matrix<float, 3, neighbor_count> members;
      for (int k = 0; k < neighbor_count; ++k)
        members.col(k) = Eigen::Map<const Eigen::Vector3f>(indexed[int(near[std::size_t(k)])]);
      members.colwise() -= members.rowwise().mean().eval();
      const Eigen::Matrix3f covariance = members * members.transpose();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver{covariance};
      normals.col(i) = solver.eigenvectors().col(0);
      if (normals.col(i).dot(Eigen::Map<const Eigen::Vector3f>(indexed[i])) > 0)
        normals.col(i) *= -1;
      curvature[i] = solver.eigenvalues()[0] / solver.eigenvalues().sum();
    }
    benchmark::DoNotOptimize(normals.data());
    benchmark::DoNotOptimize(curvature.data());
    state.PauseTiming();
    sum = normals.row(2).cast<double>().cwiseAbs().sum();
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(normals);

void voxels(benchmark::State& state) {
  double count = 0;
  for (auto _ : state) {
    std::map<std::array<std::int64_t, 3>, std::pair<Eigen::Vector3f, int>> cells;
    for (std::size_t i = 0; i < frame().size(); i += 3) {
      const float* p = frame().data() + i;
      const std::array cell{std::int64_t(std::floor(p[0] / voxel_edge)),
                            std::int64_t(std::floor(p[1] / voxel_edge)),
                            std::int64_t(std::floor(p[2] / voxel_edge))};
      auto& [sum, members] = cells.try_emplace(cell, Eigen::Vector3f::Zero(), 0).first->second;
      sum += Eigen::Vector3f{p[0], p[1], p[2]};
      ++members;
    }
    Eigen::Matrix3Xf reduced(3, cells.size());
    int c = 0;
    for (const auto& [cell, sum] : cells) reduced.col(c++) = sum.first / float(sum.second);
    benchmark::DoNotOptimize(reduced.data());
    count = double(reduced.cols());
  }
  report_result(state, count);
}
CILANTRO_BENCHMARK(voxels);

std::vector<char> file_bytes(const char* name = "large.ply") {
  std::FILE* file = std::fopen(data_path(name).c_str(), "rb");
  std::fseek(file, 0, SEEK_END);
  std::vector<char> bytes(std::size_t(std::ftell(file)));
  std::rewind(file);
  if (std::fread(bytes.data(), 1, bytes.size(), file) != bytes.size()) std::abort();
  std::fclose(file);
  return bytes;
}

void bytes_read(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(file_bytes().data());
}
CILANTRO_BENCHMARK(bytes_read);

/// Numbers out of text by `from_chars`, one after another, whatever the lines.
void xyz_read(benchmark::State& state) {
  double sum = 0;
  for (auto _ : state) {
    const auto bytes = file_bytes("large.xyz");
    std::vector<float> values;
    const char* const end = bytes.data() + bytes.size();
    for (const char* at = bytes.data(); at != end;) {
      if (*at == ' ' || *at == '\n') {
        ++at;
        continue;
      }
      double value = 0;
      at = std::from_chars(at, end, value).ptr;
      values.push_back(float(value));
    }
    benchmark::DoNotOptimize(values.data());
    state.PauseTiming();
    sum = std::accumulate(values.begin(), values.end(), 0.0);
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(xyz_read);

void bytes_write(benchmark::State& state) {
  const auto bytes = file_bytes();
  for (auto _ : state) {
    std::FILE* file = std::fopen(data_path("written.bytes.part").c_str(), "wb");
    if (std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size()) std::abort();
    std::fclose(file);
    std::rename(data_path("written.bytes.part").c_str(), data_path("written.bytes").c_str());
  }
}
CILANTRO_BENCHMARK(bytes_write);

/// Lloyd's iteration as everybody writes it, all distances each time.
void kmeans_100(benchmark::State& state) {
  const auto& xyz = frame();
  const auto n = static_cast<std::ptrdiff_t>(xyz.size() / 3);
  using point = Eigen::Map<const Eigen::Vector3f>;
  double inertia = 0;
  for (auto _ : state) {
    Eigen::Matrix3Xf centers(3, kmeans_clusters);
    for (int c = 0; c < kmeans_clusters; ++c)
      centers.col(c) = point{xyz.data() + 3 * (c * (n / kmeans_clusters))};
    std::vector<int> label(std::size_t{0} + std::size_t(n));
    std::vector<float> cost(label.size());
    const auto assign = [&] {
#pragma omp parallel for
      for (std::ptrdiff_t i = 0; i < n; ++i) {
        int best = 0;
        float least = 1e30f;
        for (int c = 0; c < kmeans_clusters; ++c) {
          const float d = (point{xyz.data() + 3 * i} - centers.col(c)).squaredNorm();
          if (d < least) {
            least = d;
            best = c;
          }
        }
        label[std::size_t(i)] = best;
        cost[std::size_t(i)] = least;
      }
    };
    for (int step = 0; step < kmeans_steps; ++step) {
      assign();
      Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, kmeans_clusters);
      Eigen::VectorXd count = Eigen::VectorXd::Zero(kmeans_clusters);
      for (std::ptrdiff_t i = 0; i < n; ++i) {
        sum.col(label[std::size_t(i)]) += point{xyz.data() + 3 * i}.cast<double>();
        ++count[label[std::size_t(i)]];
      }
      for (int c = 0; c < kmeans_clusters; ++c)
        if (count[c] > 0) centers.col(c) = (sum.col(c) / count[c]).cast<float>();
    }
    assign();
    inertia = std::accumulate(cost.begin(), cost.end(), 0.0);
  }
  report_result(state, inertia);
}
CILANTRO_BENCHMARK(kmeans_100);

}  // namespace

BENCHMARK_MAIN();
