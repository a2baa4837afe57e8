// SPDX-License-Identifier: MIT
//
// Real scans and pairs with ground truth.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

Eigen::MatrixXd numbers_in(const std::filesystem::path& path, index_t rows, index_t columns) {
  std::ifstream in{path};
  Eigen::MatrixXd values(rows, columns);
  for (index_t i = 0; i < rows; ++i)
    for (index_t k = 0; k < columns; ++k) {
      in >> values(i, k);
      if (in.peek() == ',') in.get();
    }
  REQUIRE(in);
  return values;
}

/// Text of a PLY file whose numbers have more digits than the float that its header promises.
Eigen::Matrix3Xd points_in_double(const std::filesystem::path& path) {
  std::ifstream in{path};
  std::string line;
  index_t count = 0;
  while (std::getline(in, line) && !line.starts_with("end_header"))
    if (line.starts_with("element vertex ")) count = std::stol(line.substr(15));
  Eigen::Matrix3Xd points(3, count);
  for (index_t i = 0; i < count; ++i) in >> points(0, i) >> points(1, i) >> points(2, i);
  REQUIRE(in);
  return points;
}

}  // namespace

TEST_CASE("exact transforms are found among up to nine wrong pairs of ten") {
  const auto folder = test::data_file("registration/teaser_exact");
  SKIP_WITHOUT(folder);
  std::string table = "\noutliers  pairs  inliers  samples  error of R, t, s\n";
  for (int k = 1; k <= 6; ++k) {
    const auto at = *folder / ("benchmark_" + std::to_string(k));
    const auto source = points_in_double(at / "src.ply"), target = points_in_double(at / "dst.ply");
    const double scale = numbers_in(at / "s_ref.csv", 1, 1)(0, 0);
    const Eigen::Matrix3d rotation = numbers_in(at / "R_ref.csv", 3, 3);
    const Eigen::Vector3d translation = numbers_in(at / "t_ref.csv", 3, 1);
    const double outliers[] = {0, 0.1, 0.3, 0.5, 0.9, 0.9};
    const double share = 1 - outliers[k - 1];
    // With probability 0.999 a sample of three has no outlier after so many, and an exact
    // transform needs one such sample only.
    const auto limit =
        index_t(share == 1 ? 1 : std::ceil(std::log(0.001) / std::log(1 - share * share * share)));
    const auto found = ransac(similarity_family(source, target),
                              {.max_residual = k == 6 ? 0.03 : 1e-6, .max_iterations = 8 * limit});
    REQUIRE(found);
    const double s = std::cbrt(found->model.linear().determinant());
    const double off_r = (found->model.linear() / s - rotation).norm();
    const double off_t = (found->model.translation() - translation).norm();
    char line[200];
    std::snprintf(line, sizeof line, "%7.0f%%  %5d  %7d  %7d  %.1e %.1e %.1e\n",
                  100 * outliers[k - 1], int(source.cols()), int(found->inliers.size()),
                  int(found->iterations), off_r, off_t, std::abs(s - scale));
    table += line;
    if (k == 6) {
      CHECK(off_r < 0.05);
      CHECK(off_t < 0.05);
      continue;
    }
    CHECK(off_r < 1e-9);
    CHECK(off_t < 1e-9);
    CHECK(std::abs(s - scale) < 1e-9);
    CHECK(double(found->inliers.size()) >= share * double(source.cols()) - 1e-9);
    if (share >= 0.2) CHECK(found->iterations <= 2 * limit);
  }
  MESSAGE(table);
}

TEST_CASE("four of five pairs wrong: the exact transform is found within 861 samples") {
  const auto source = test::random_points<test::d3>(500, 3);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    auto target = test::random_points<test::d3>(500, 100 + seed, -3, 3);
    const Eigen::Isometry3d truth = Eigen::Translation3d{1, 2, 3} *
                                    Eigen::AngleAxisd{1 + double(seed), Eigen::Vector3d::UnitX()} *
                                    Eigen::Isometry3d::Identity();
    target.leftCols(100) = transform_points(truth, source.leftCols(100));
    const auto found = ransac(rigid_family(source, target), {.max_residual = 1e-6, .seed = seed});
    REQUIRE(found);
    CHECK(found->inliers.size() == 100);
    CHECK((found->model.matrix() - truth.matrix()).norm() < 1e-9);
    CHECK(found->iterations <= 861);
  }
}

TEST_CASE("the table of a scene is its plane, and what stands on it are its components") {
  const auto folder = test::data_file("reference/mosd");
  SKIP_WITHOUT(folder);
  std::string table = "\nscene    truth            points  found  IoU\n";
  const auto row = [&](const std::string& scene, const std::string& what, index_t points,
                       index_t found, double iou) {
    char line[200];
    std::snprintf(line, sizeof line, "%-8s %-15s %7d %6d  %.3f\n", scene.c_str(), what.c_str(),
                  int(points), int(found), iou);
    table += line;
  };
  for (const std::string scene : {"learn0", "learn33"}) {
    const auto cloud = read_pcd<float>(*folder / (scene + ".pcd"));
    const auto labels = cloud.attribute_as<std::uint32_t>("label");
    std::map<std::uint32_t, index_list> truth;
    for (index_t i = 0; i < cloud.size(); ++i)
      if (labels[std::size_t(i)] > 0) {
        const auto l = labels[std::size_t(i)];
        truth[l < 10 ? 1 : l].push_back(std::int32_t(i));
      }
    const auto overlap = [](index_list a, index_list b) {
      std::ranges::sort(a);
      std::ranges::sort(b);
      index_list both;
      std::ranges::set_intersection(a, b, std::back_inserter(both));
      return double(both.size()) / double(a.size() + b.size() - both.size());
    };

    const auto plane = ransac(hyperplane_family{cloud}, {.max_residual = 0.012});
    REQUIRE(plane);
    // The side on which the camera is.
    const double side = plane->model.offset > 0 ? 1 : -1;
    const auto rest = [&](index_t i) {
      return is_finite(cloud.points.col(i)) &&
             side * plane->model.signed_distance(cloud.points.col(i)) > 0.012;
    };
    index_list above;
    for (index_t i = 0; i < cloud.size(); ++i)
      if (rest(i)) above.push_back(std::int32_t(i));
    const auto objects = select(cloud, above);
    const auto parts = connected_components(objects, radius{0.01}, {.min_cluster_size = 300});
    double sum = 0;
    for (const auto& [label, members] : truth) {
      double best = label == 1 ? overlap(members, plane->inliers) : 0;
      index_t size = label == 1 ? std::ssize(plane->inliers) : 0;
      for (index_t c = 0; label != 1 && c < parts.size(); ++c) {
        index_list found;
        for (const auto p : parts[c]) found.push_back(above[std::size_t(p)]);
        const double iou = overlap(members, found);
        if (iou > best) {
          best = iou;
          size = std::ssize(found);
        }
      }
      row(scene, label == 1 ? "table" : "object " + std::to_string(label), std::ssize(members),
          size, best);
      CHECK(best > (label == 1 ? 0.98 : 0.3));
      sum += best;
    }
    // Two of the objects touch each other, and are one part.
    CHECK(sum / double(truth.size()) > 0.85);
  }
  MESSAGE(table);
}

TEST_CASE("the plane of a terrain is right at the coordinates of a map") {
  for (const std::string name : {"samp11-utm-ground", "samp54-utm-ground"}) {
    const auto file = test::data_file("reference/terrain_ground/" + name + ".pcd");
    SKIP_WITHOUT(file);
    const auto cloud = read_pcd<float>(*file);
    // As the file has them, without an origin: in float, far from 0.
    const Eigen::Matrix3Xf far =
        (cloud.points.cast<double>().colwise() + cloud.full_origin()).cast<float>();
    const Eigen::Vector3d middle = far.cast<double>().rowwise().mean();
    CHECK(middle.head<2>().norm() > 1e5);
    const ransac_options options{.max_residual = 2};
    const auto in_place = ransac(hyperplane_family{far}, options);
    // The truth: in double, around the middle.
    const Eigen::Matrix3Xd centred = far.cast<double>().colwise() - middle;
    const auto truth = ransac(hyperplane_family{centred}, options);
    REQUIRE((in_place && truth));
    CHECK(angle_between(in_place->model.normal, truth->model.normal) < 1e-5);
    CHECK(in_place->model.signed_distance(middle) ==
          doctest::Approx(truth->model.offset).epsilon(0.01).scale(0.01));
    CHECK(std::abs(double(in_place->inliers.size()) - double(truth->inliers.size())) <=
          0.001 * double(truth->inliers.size()));
    CHECK(in_place->model.normal.z() > 0.9);
  }
}

TEST_CASE("the planes of recorded scans hold their inliers tightly") {
  for (const std::string name : {"sac_plane_test", "noisy_slice_displaced"}) {
    const auto file = test::data_file("reference/pcl_planes/" + name + ".pcd");
    SKIP_WITHOUT(file);
    const auto cloud = read_pcd<float>(*file);
    const auto found = ransac(hyperplane_family{cloud}, {.max_residual = 0.03});
    REQUIRE(found);
    MESSAGE(name << ": " << found->inliers.size() << " of " << cloud.size() << " points, rmse "
                 << found->rmse);
    CHECK(double(found->inliers.size()) > 0.5 * double(cloud.size()));
  }
}
