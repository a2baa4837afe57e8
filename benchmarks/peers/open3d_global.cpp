// SPDX-License-Identifier: MIT
//
// The pairs that slow programs try, by Open3D: global_open3d pairs FOLDER OUT ransac|fgr
//                                              global_open3d figures FOLDER
#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/CorrespondenceChecker.h>
#include <open3d/pipelines/registration/FastGlobalRegistration.h>
#include <open3d/pipelines/registration/Feature.h>
#include <open3d/pipelines/registration/GeneralizedICP.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/utility/Logging.h>
#include <open3d/utility/Random.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "global_pairs.hpp"

namespace {

namespace registration = open3d::pipelines::registration;
using open3d::geometry::KDTreeSearchParamHybrid;
using open3d::geometry::PointCloud;

PointCloud cloud_of(const std::vector<float>& xyz) {
  PointCloud made;
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3)
    made.points_.emplace_back(double(xyz[i]), double(xyz[i + 1]), double(xyz[i + 2]));
  return made;
}
void estimate_normals(PointCloud& cloud) {
  cloud.EstimateNormals(KDTreeSearchParamHybrid{global_normals, 30});
  cloud.OrientNormalsTowardsCameraLocation({0, 0, 0});
}
std::shared_ptr<registration::Feature> features_of(const PointCloud& cloud) {
  return registration::ComputeFPFHFeature(cloud, KDTreeSearchParamHybrid{global_features, 100});
}
rows_of_matrix rows_of(const Eigen::Matrix4d& matrix) {
  rows_of_matrix rows;
  for (int i = 0; i < 16; ++i) rows[std::size_t(i)] = matrix(i / 4, i % 4);
  return rows;
}

/// As its documentation does it.
registration::RegistrationResult by_samples(const PointCloud& source, const PointCloud& target,
                                            const registration::Feature& source_features,
                                            const registration::Feature& target_features) {
  const double distance = 1.5 * global_voxel;
  const registration::CorrespondenceCheckerBasedOnEdgeLength lengths{0.9};
  const registration::CorrespondenceCheckerBasedOnDistance distances{distance};
  return registration::RegistrationRANSACBasedOnFeatureMatching(
      source, target, source_features, target_features, true, distance,
      registration::TransformationEstimationPointToPoint{false}, 3, {lengths, distances},
      registration::RANSACConvergenceCriteria{100000, 0.999});
}
registration::RegistrationResult by_graduation(const PointCloud& source, const PointCloud& target,
                                               const registration::Feature& source_features,
                                               const registration::Feature& target_features) {
  registration::FastGlobalRegistrationOption option;
  option.use_absolute_scale_ = true;
  option.maximum_correspondence_distance_ = global_voxel;
  return registration::FastGlobalRegistrationBasedOnFeatureMatching(source, target, source_features,
                                                                    target_features, option);
}

void align_pairs(const std::string& folder, const std::string& out, const std::string& how) {
  const auto task = read_global_task(folder);
  std::vector<PointCloud> clouds;
  for (const auto& frame : task.frames) clouds.push_back(cloud_of(frame));
  found_writer results{out};
  std::vector<std::shared_ptr<registration::Feature>> features;
  const stopwatch describing;
  for (auto& cloud : clouds) {
    estimate_normals(cloud);
    features.push_back(features_of(cloud));
  }
  results.features(clouds.size(), describing);
  for (const auto& pair : task.pairs) {
    if (!pair.is_sampled) continue;
    const auto &source = clouds[pair.source], &target = clouds[pair.target];
    open3d::utility::random::Seed(0);
    const stopwatch finding;
    const auto rough = (how == "fgr" ? by_graduation : by_samples)(
        source, target, *features[pair.source], *features[pair.target]);
    const std::array spent{finding.wall(), finding.processor()};
    const stopwatch refining;
    const auto fine =
        registration::RegistrationICP(source, target, planes_within, rough.transformation_,
                                      registration::TransformationEstimationPointToPlane{});
    const std::array then{refining.wall(), refining.processor()};
    const auto finer = registration::RegistrationGeneralizedICP(source, target, generalized_within,
                                                                rough.transformation_);
    results.pair(pair, spent, then, rough.fitness_ > 0.3 ? "fits" : "fits not",
                 {rows_of(rough.transformation_), rows_of(fine.transformation_),
                  rows_of(finer.transformation_)});
  }
}

void print_figures(const std::string& folder) {
  const auto task = read_global_task(folder);
  double normals = 0, features = 0;
  for (std::size_t f = 0; f < task.frames.size(); f += 6) {
    double best[2] = {1e300, 1e300};
    for (int i = 0; i < 5; ++i) {
      auto cloud = cloud_of(task.frames[f]);
      const stopwatch first;
      estimate_normals(cloud);
      best[0] = std::min(best[0], first.processor());
      const stopwatch second;
      (void)features_of(cloud);
      best[1] = std::min(best[1], second.processor());
    }
    normals += best[0];
    features += best[1];
  }
  const double frames = double((task.frames.size() + 5) / 6);
  std::printf("Open3D: normals %.2f ms, features %.2f ms a frame\n", normals / frames,
              features / frames);
}

}  // namespace

int main(int count, char** arguments) {
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  const std::vector<std::string> given(arguments + 1, arguments + count);
  if (given.size() == 4 && given[0] == "pairs") {
    align_pairs(given[1], given[2], given[3]);
  } else if (given.size() == 2 && given[0] == "figures") {
    print_figures(given[1]);
  } else {
    std::fprintf(stderr, "the head of open3d_global.cpp says how\n");
    return 1;
  }
  return 0;
}
