// SPDX-License-Identifier: MIT
#include <omp.h>
#include <pcl/common/transforms.h>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/region_growing.h>
#include <pcl/segmentation/sac_segmentation.h>
#include <pcl/surface/convex_hull.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "common.hpp"

namespace {

using cloud_type = pcl::PointCloud<pcl::PointXYZ>;

cloud_type::Ptr cloud_of(const std::vector<float>& xyz) {
  cloud_type::Ptr made{new cloud_type};
  for (std::size_t i = 0; i < xyz.size(); i += 3) made->push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
  return made;
}
const cloud_type::Ptr& points() {
  static const cloud_type::Ptr cloud = cloud_of(frame());
  return cloud;
}

void tree_build(benchmark::State& state) {
  for (auto _ : state) {
    pcl::KdTreeFLANN<pcl::PointXYZ> tree;
    tree.setInputCloud(points());
    benchmark::DoNotOptimize(&tree);
  }
  report_result(state, double(points()->size()));
}
CILANTRO_BENCHMARK(tree_build);

/// `find(tree, i, indices, squared_distances)` for every point, keeping what is found.
template <class F>
void search(benchmark::State& state, F find) {
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(points());
  const int n = int(points()->size());
  double sum = 0;
  for (auto _ : state) {
    std::vector<pcl::Indices> indices(std::size_t{0} + n);
    std::vector<std::vector<float>> distances(indices.size());
#pragma omp parallel for schedule(dynamic, 256)
    for (int i = 0; i < n; ++i) {
      find(tree, i, indices[std::size_t(i)], distances[std::size_t(i)]);
      for (float& d : distances[std::size_t(i)]) d = std::sqrt(d);
    }
    benchmark::DoNotOptimize(distances.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& near : distances) sum += std::accumulate(near.begin(), near.end(), 0.0);
    state.ResumeTiming();
  }
  report_result(state, sum);
}

void knn_of_all(benchmark::State& state) {
  search(state, [](const auto& tree, int i, auto& indices, auto& distances) {
    tree.nearestKSearch(*points(), i, neighbor_count, indices, distances);
  });
}
CILANTRO_BENCHMARK(knn_of_all);

void knn_30_of_all(benchmark::State& state) {
  search(state, [](const auto& tree, int i, auto& indices, auto& distances) {
    tree.nearestKSearch(*points(), i, many_neighbors, indices, distances);
  });
}
CILANTRO_BENCHMARK(knn_30_of_all);

void radius_of_all(benchmark::State& state) {
  search(state, [](const auto& tree, int i, auto& indices, auto& distances) {
    tree.radiusSearch(*points(), i, voxel_edge, indices, distances);
  });
}
CILANTRO_BENCHMARK(radius_of_all);

/// `ask(estimation)` says which neighbours count.
template <class F>
void normals_of(benchmark::State& state, F ask) {
  double sum = 0;
  for (auto _ : state) {
    pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimation{
        unsigned(omp_get_max_threads())};
    pcl::search::KdTree<pcl::PointXYZ>::Ptr tree{new pcl::search::KdTree<pcl::PointXYZ>};
    estimation.setInputCloud(points());
    estimation.setSearchMethod(tree);
    ask(estimation);
    estimation.setViewPoint(0, 0, 0);
    pcl::PointCloud<pcl::Normal> found;
    estimation.compute(found);
    benchmark::DoNotOptimize(found.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& n : found)
      if (std::isfinite(n.normal_z)) sum += std::abs(double(n.normal_z));
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void normals(benchmark::State& state) {
  normals_of(state, [](auto& estimation) { estimation.setKSearch(neighbor_count); });
}
CILANTRO_BENCHMARK(normals);
void normals_by_radius(benchmark::State& state) {
  normals_of(state, [](auto& estimation) { estimation.setRadiusSearch(double(voxel_edge)); });
}
CILANTRO_BENCHMARK(normals_by_radius);

void voxels_of(benchmark::State& state, const cloud_type::ConstPtr& cloud, float edge) {
  double count = 0;
  for (auto _ : state) {
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    grid.setInputCloud(cloud);
    grid.setLeafSize(edge, edge, edge);
    cloud_type reduced;
    grid.filter(reduced);
    benchmark::DoNotOptimize(reduced.data());
    count = double(reduced.size());
  }
  report_result(state, count);
}
void voxels(benchmark::State& state) {
  voxels_of(state, points(), voxel_edge);
}
CILANTRO_BENCHMARK(voxels);
void voxels_5_mm(benchmark::State& state) {
  voxels_of(state, points(), small_voxel_edge);
}
CILANTRO_BENCHMARK(voxels_5_mm);
void large_voxels(benchmark::State& state) {
  voxels_of(state, cloud_of(large_points()), large_voxel_edge);
}
CILANTRO_BENCHMARK(large_voxels);

void large_transform(benchmark::State& state) {
  const auto cloud = cloud_of(large_points());
  Eigen::Isometry3f turn = Eigen::Isometry3f::Identity();
  turn.linear() = Eigen::AngleAxisf{0.3f, Eigen::Vector3f::UnitZ()}.toRotationMatrix();
  double last = 0;
  for (auto _ : state) {
    cloud_type moved;
    pcl::transformPointCloud(*cloud, moved, turn.matrix());
    benchmark::DoNotOptimize(moved.data());
    last = double(moved.back().x);
  }
  report_result(state, last);
}
CILANTRO_BENCHMARK(large_transform);

void ply_read(benchmark::State& state) {
  double sum = 0;
  for (auto _ : state) {
    pcl::PointCloud<pcl::PointXYZRGB> cloud;
    pcl::io::loadPLYFile(data_path("large.ply"), cloud);
    benchmark::DoNotOptimize(cloud.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& p : cloud) sum += double(p.x) + double(p.y) + double(p.z);
    state.ResumeTiming();
  }
  report_result(state, sum);
}
CILANTRO_BENCHMARK(ply_read);

void ply_write(benchmark::State& state) {
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  pcl::io::loadPLYFile(data_path("large.ply"), cloud);
  for (auto _ : state) pcl::io::savePLYFileBinary(data_path("written_by_pcl.ply"), cloud);
  report_result(state, double(cloud.size()));
}
CILANTRO_BENCHMARK(ply_write);

void outliers(benchmark::State& state) {
  double count = 0;
  for (auto _ : state) {
    pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
    filter.setInputCloud(points());
    filter.setMeanK(outlier_neighbors);
    filter.setStddevMulThresh(outlier_deviations);
    cloud_type kept;
    filter.filter(kept);
    benchmark::DoNotOptimize(kept.data());
    count = double(kept.size());
  }
  report_result(state, count);
}
CILANTRO_BENCHMARK(outliers);

/// Region growing in two halves, to time the one behind the neighbours alone.
struct growing : pcl::RegionGrowing<pcl::PointXYZ, pcl::Normal> {
  growing() {
    cloud_type::Ptr cloud{new cloud_type};
    pcl::PointCloud<pcl::Normal>::Ptr normals{new pcl::PointCloud<pcl::Normal>};
    for (std::size_t i = 0; i < large_points().size(); i += 3) {
      cloud->push_back({large_points()[i], large_points()[i + 1], large_points()[i + 2]});
      normals->push_back(
          pcl::Normal{large_normals()[i], large_normals()[i + 1], large_normals()[i + 2]});
    }
    setSearchMethod(
        pcl::search::KdTree<pcl::PointXYZ>::Ptr{new pcl::search::KdTree<pcl::PointXYZ>});
    setInputCloud(cloud);
    setInputNormals(normals);
    setNumberOfNeighbours(segment_neighbors);
    setSmoothnessThreshold(segment_angle);
    setSmoothModeFlag(true);
    setCurvatureTestFlag(false);
    setMinClusterSize(segment_min_size);
  }
  void find_neighbors() {
    clusters_.clear();
    point_neighbours_.clear();
    point_labels_.clear();
    num_pts_in_segment_.clear();
    number_of_segments_ = 0;
    initCompute();
    prepareForSegmentation();
    findPointNeighbours();
  }
  double grow() {
    applySmoothRegionGrowingAlgorithm();
    assembleRegions();
    double labeled = 0;
    for (const auto& part : clusters_)
      if (part.indices.size() >= segment_min_size) labeled += double(part.indices.size());
    deinitCompute();
    return labeled;
  }
};

void segment(benchmark::State& state) {
  growing parts;
  double labeled = 0;
  for (auto _ : state) {
    parts.find_neighbors();
    labeled = parts.grow();
  }
  report_result(state, labeled);
}
CILANTRO_BENCHMARK(segment);

void segment_graph(benchmark::State& state) {
  growing parts;
  double labeled = 0;
  for (auto _ : state) {
    state.PauseTiming();
    parts.find_neighbors();
    state.ResumeTiming();
    labeled = parts.grow();
  }
  report_result(state, labeled);
}
CILANTRO_BENCHMARK(segment_graph);

void euclidean_parts(benchmark::State& state) {
  double labeled = 0;
  for (auto _ : state) {
    pcl::EuclideanClusterExtraction<pcl::PointXYZ> extract;
    extract.setSearchMethod(
        pcl::search::KdTree<pcl::PointXYZ>::Ptr{new pcl::search::KdTree<pcl::PointXYZ>});
    extract.setInputCloud(points());
    extract.setClusterTolerance(density_radius);
    extract.setMinClusterSize(segment_min_size);
    std::vector<pcl::PointIndices> parts;
    extract.extract(parts);
    labeled = 0;
    for (const auto& part : parts) labeled += double(part.indices.size());
  }
  report_result(state, labeled);
}
CILANTRO_BENCHMARK(euclidean_parts);

void plane_200(benchmark::State& state) {
  double inliers = 0;
  for (auto _ : state) {
    pcl::SACSegmentation<pcl::PointXYZ> segmentation;
    segmentation.setInputCloud(points());
    segmentation.setModelType(pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setDistanceThreshold(plane_distance);
    segmentation.setMaxIterations(plane_samples);
    segmentation.setProbability(1);  // No stop before the last sample.
    segmentation.setOptimizeCoefficients(true);
    pcl::PointIndices found;
    pcl::ModelCoefficients coefficients;
    segmentation.segment(found, coefficients);
    inliers = double(found.indices.size());
  }
  report_result(state, inliers);
}
CILANTRO_BENCHMARK(plane_200);

void icp_point_to_plane(benchmark::State& state, const registration_pair& pair) {
  using with_normals = pcl::PointCloud<pcl::PointNormal>;
  const auto fill = [](const std::vector<float>& p, const std::vector<float>& n) {
    with_normals::Ptr made{new with_normals};
    for (std::size_t i = 0; i < p.size(); i += 3) {
      pcl::PointNormal point;
      point.getVector3fMap() = Eigen::Vector3f{p[i], p[i + 1], p[i + 2]};
      if (!n.empty()) point.getNormalVector3fMap() = Eigen::Vector3f{n[i], n[i + 1], n[i + 2]};
      made->push_back(point);
    }
    return made;
  };
  const auto source = fill(pair.source, {});
  const auto target = fill(pair.target, pair.target_normals);
  Eigen::Matrix4f found;
  for (auto _ : state) {
    pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
    icp.setInputSource(source);
    icp.setInputTarget(target);
    icp.setMaxCorrespondenceDistance(pair.max_distance);
    icp.setMaximumIterations(pair.iterations);
    // Nothing that would stop it early.
    icp.setTransformationEpsilon(-1);
    icp.setEuclideanFitnessEpsilon(-1);
    icp.getConvergeCriteria()->setRelativeMSE(-1);
    with_normals aligned;
    icp.align(aligned);
    found = icp.getFinalTransformation();
  }
  report_pose(state, pair, [&](int i, int k) { return double(found(i, k)); });
}

/// The sum of all coordinates of a file, which is read again and again.
void read(benchmark::State& state, const char* name) {
  double sum = 0;
  for (auto _ : state) {
    pcl::PointCloud<pcl::PointXYZRGB> cloud;
    pcl::io::loadPCDFile(data_path(name), cloud);
    benchmark::DoNotOptimize(cloud.data());
    state.PauseTiming();
    sum = 0;
    for (const auto& p : cloud) sum += double(p.x) + double(p.y) + double(p.z);
    state.ResumeTiming();
  }
  report_result(state, sum);
}
void pcd_read(benchmark::State& state) {
  read(state, "large.pcd");
}
CILANTRO_BENCHMARK(pcd_read);
void pcd_unpack(benchmark::State& state) {
  read(state, "large_compressed.pcd");
}
CILANTRO_BENCHMARK(pcd_unpack);

void pcd_write(benchmark::State& state) {
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  pcl::io::loadPCDFile(data_path("large.pcd"), cloud);
  for (auto _ : state) pcl::io::savePCDFileBinary(data_path("written_by_pcl.pcd"), cloud);
  report_result(state, double(cloud.size()));
}
CILANTRO_BENCHMARK(pcd_write);

void hull(benchmark::State& state, const std::vector<float>& xyz) {
  const auto cloud = cloud_of(xyz);
  double volume = 0;
  for (auto _ : state) {
    pcl::ConvexHull<pcl::PointXYZ> hull;
    hull.setInputCloud(cloud);
    hull.setDimension(3);
    hull.setComputeAreaVolume(true);
    cloud_type corners;
    std::vector<pcl::Vertices> facets;
    hull.reconstruct(corners, facets);
    volume = hull.getTotalVolume();
  }
  report_result(state, volume);
}
void hull_of_frame(benchmark::State& state) {
  hull(state, frame());
}
CILANTRO_BENCHMARK(hull_of_frame);
void hull_of_cube(benchmark::State& state) {
  hull(state, cube_points());
}
CILANTRO_BENCHMARK(hull_of_cube);
void hull_of_sphere(benchmark::State& state) {
  hull(state, sphere_points());
}
CILANTRO_BENCHMARK(hull_of_sphere);

}  // namespace

int main(int argc, char** argv) {
  return run_benchmarks(argc, argv, icp_point_to_plane);
}
