// SPDX-License-Identifier: MIT
//
// Features of surfaces, against a plain computation by the definition and values of Open3D.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// The histograms of θ, α and φ of a point and its neighbours within `distance`, as fractions.
Eigen::VectorXd plain_histograms(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& normals,
                                 index_t i, double distance) {
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(33);
  double count = 0;
  for (index_t j = 0; j < points.cols(); ++j) {
    Eigen::Vector3d way = points.col(j) - points.col(i);
    const double length = way.norm();
    if (length == 0 || length > distance) continue;
    way /= length;
    Eigen::Vector3d u = normals.col(i), other = normals.col(j);
    double phi = u.dot(way);
    if (std::abs(phi) < std::abs(other.dot(way))) {
      phi = -other.dot(way);
      std::swap(u, other);
      way = -way;
    }
    const Eigen::Vector3d v = way.cross(u).normalized(), w = u.cross(v);
    const auto add = [&](int histogram, double fraction) {
      sums[histogram * 11 + std::clamp(int(std::floor(11 * fraction)), 0, 10)] += 1;
    };
    add(0, (std::atan2(w.dot(other), u.dot(other)) + std::numbers::pi) / (2 * std::numbers::pi));
    add(1, (v.dot(other) + 1) / 2);
    add(2, (phi + 1) / 2);
    ++count;
  }
  return count > 0 ? Eigen::VectorXd{sums / count} : sums;
}

/// The mean of the histograms of the neighbours, by the inverse of their squared distance.
Eigen::VectorXd plain_blend(const Eigen::Matrix3Xd& points, const Eigen::MatrixXd& own, index_t i,
                            double distance) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(33);
  for (index_t j = 0; j < points.cols(); ++j) {
    const double square = (points.col(j) - points.col(i)).squaredNorm();
    if (square > 0 && square <= distance * distance) sum += own.col(j) / square;
  }
  for (int h = 0; h < 3; ++h)
    if (const double total = sum.segment(11 * h, 11).sum(); total > 0)
      sum.segment(11 * h, 11) /= total;
  return sum;
}

/// The mean over all columns of the sums of absolute differences.
double mean_difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().colwise().sum().mean();
}

/// A bumpy surface with about a hundred neighbours in a radius of 0.5.
template <class Space>
auto surface(index_t count = 2000) {
  return test::bumpy_surface<Space>(count, 3);
}

}  // namespace

TEST_CASE_TEMPLATE("features are what the definition says", S, float, double) {
  const auto cloud = surface<test::space<S, 3>>(600);
  const Eigen::Matrix3Xd points = cloud.points.template cast<double>(),
                         normals = cloud.normals.template cast<double>();
  const double distance = 0.7;
  Eigen::MatrixXd own(33, points.cols()), expected(33, points.cols());
  for (index_t i = 0; i < points.cols(); ++i)
    own.col(i) = plain_histograms(points, normals, i, distance);
  for (index_t i = 0; i < points.cols(); ++i)
    expected.col(i) = (own.col(i) + plain_blend(points, own, i, distance)) / 2;
  const Eigen::MatrixXf found = fpfh(cloud, radius{distance}, {.oriented = true});
  REQUIRE(found.rows() == 33);
  REQUIRE(found.cols() == cloud.size());
  // Single precision puts a pair in a thousand into the next bin.
  CHECK(mean_difference(found.template cast<double>(), expected) < 2e-3);
  CHECK((found.middleRows(11, 11).colwise().sum().array() - 1).abs().maxCoeff() < 1e-5F);
}

TEST_CASE("features are those that Open3D has computed of a room") {
  const auto folder = test::data_file("registration/open3d_feature");
  SKIP_WITHOUT(folder);
  const auto cloud = read_cloud<float, 3>(*folder / "cloud_bin_0.pcd");
  std::ifstream in{*folder / "cloud_bin_0.fpfh.bin", std::ios::binary};
  std::int32_t rows = 0, columns = 0;
  in.read(reinterpret_cast<char*>(&rows), sizeof rows);
  in.read(reinterpret_cast<char*>(&columns), sizeof columns);
  REQUIRE(rows == 33);
  REQUIRE(columns == cloud.size());
  Eigen::MatrixXd theirs(rows, columns);
  in.read(reinterpret_cast<char*>(theirs.data()), std::streamsize(sizeof(double)) * theirs.size());
  // Theirs are the neighbours' part alone, in per cent.
  const auto found = fpfh(cloud, radius{0.25}, {.oriented = true});
  const Eigen::Matrix3Xd points = cloud.points.cast<double>(),
                         normals = cloud.normals.cast<double>();
  double sum = 0;
  int count = 0;
  for (index_t i = 0; i < columns; i += 16, ++count) {
    const Eigen::VectorXd own = plain_histograms(points, normals, i, 0.25);
    sum += (2 * found.col(i).cast<double>() - own - theirs.col(i) / 100).cwiseAbs().sum();
  }
  MESSAGE("mean difference of a feature, whose sum is 3: " << sum / count);
  CHECK(sum / count < 0.01);
}

TEST_CASE_TEMPLATE("features do not change when the surface moves", Space, test::f3, test::d3,
                   test::d2) {
  const auto cloud = surface<Space>();
  for (const bool oriented : {true, false}) {
    const auto before = fpfh(cloud, radius{0.5}, {.oriented = oriented});
    CHECK(before.rows() == (Space::dimension == 3 ? 33 : 22));
    const auto moved = transform(cloud, test::random_rigid<Space>(5, 2, 10));
    const auto after = fpfh(moved, radius{0.5}, {.oriented = oriented});
    CHECK(mean_difference(Eigen::MatrixXd{before.template cast<double>()},
                          Eigen::MatrixXd{after.template cast<double>()}) < 5e-3);
  }
}

TEST_CASE("signs of normals count only where they are said to mean something") {
  const auto cloud = surface<test::f3>();
  auto flipped = cloud;
  for (index_t i = 0; i < cloud.size(); ++i)
    if (random_stream{9, std::uint64_t(i)}.uniform() < 0.5) flipped.normals.col(i) *= -1;
  const auto difference = [&](bool oriented) {
    return mean_difference(fpfh(cloud, radius{0.5}, {.oriented = oriented}).cast<double>(),
                           fpfh(flipped, radius{0.5}, {.oriented = oriented}).cast<double>());
  };
  CHECK(difference(false) < 1e-3);
  CHECK(difference(true) > 0.5);

  // Inside out, a ball is a hollow.
  auto hollow = cloud;
  hollow.normals *= -1;
  CHECK(mean_difference(fpfh(cloud, radius{0.5}, {.oriented = true}).cast<double>(),
                        fpfh(hollow, radius{0.5}, {.oriented = true}).cast<double>()) > 0.5);
}

TEST_CASE("features of chosen points are those of all points there") {
  const auto cloud = surface<test::f3>();
  const auto all = fpfh(cloud, radius{0.5});
  const index_list at{7, 1999, 0, 7};
  const auto some = fpfh(cloud, radius{0.5}, {.at = at});
  REQUIRE(some.cols() == 4);
  for (index_t i = 0; i < 4; ++i) CHECK(test::same_bits(some.col(i), all.col(at[i])));
  CHECK(fpfh(cloud, radius{0.5}, {.at = index_list{}}).cols() == 0);
  CHECK_THROWS_AS((void)fpfh(cloud, radius{0.5}, {.at = index_list{2000}}), invalid_input);
  CHECK_THROWS_AS((void)fpfh(cloud, radius{0.5}, {.at = index_list{-1}}), invalid_input);
}

TEST_CASE("points without neighbours, normals or a place have no feature, and harm no other") {
  auto cloud = surface<test::f3>(500);
  const auto before = fpfh(cloud, radius{0.5});
  point_cloud<float, 3> more = cloud;
  more.points.conservativeResize(3, 504);
  more.normals.conservativeResize(3, 504);
  more.points.col(500) << 100, 0, 0;  // Far away.
  more.normals.col(500) << 1, 0, 0;
  more.points.col(501) << test::nan<float>, 0, 0;
  more.normals.col(501) << 1, 0, 0;
  more.points.col(502) = cloud.points.col(3) * 1.01F;
  more.normals.col(502).setZero();  // Unknown.
  more.points.col(503) = cloud.points.col(3) * 1.01F;
  more.normals.col(503).setConstant(test::nan<float>);
  const auto after = fpfh(more, radius{0.5});
  CHECK(after.rightCols(4).isZero(0));
  // Sums are in the order in which a tree of other points finds the same neighbours.
  CHECK(mean_difference(before.cast<double>(), after.leftCols(500).cast<double>()) < 1e-5);

  // The same place many times.
  point_cloud<float, 3> one;
  one.points = Eigen::Matrix3Xf::Ones(3, 20);
  one.normals = Eigen::Vector3f{0, 0, 1}.replicate(1, 20);
  CHECK(fpfh(one, radius{0.5}).isZero(0));
  CHECK(fpfh(one, knn{5}).isZero(0));
}

TEST_CASE("wrong input to features gets a sentence") {
  const auto cloud = surface<test::f3>(50);
  const point_cloud<float, 3> bare{.points = cloud.points};
  CHECK_THROWS_WITH_AS((void)fpfh(bare, radius{0.5}), "fpfh: the points have no normals",
                       invalid_input);
  CHECK_THROWS_AS((void)fpfh(cloud.points, cloud.normals.leftCols(3).eval(), radius{0.5}),
                  invalid_input);
  CHECK_THROWS_AS((void)fpfh(cloud.normals, (3 * cloud.points).eval(), radius{0.5}), invalid_input);
  const Eigen::MatrixXf four = Eigen::MatrixXf::Ones(4, 10);
  CHECK_THROWS_AS((void)fpfh(four, (four / 2).eval(), radius{0.5}), invalid_input);
  const point_cloud<float, 3> none;
  CHECK(fpfh(none, radius{0.5}).cols() == 0);
  CHECK(fpfh(Eigen::MatrixXf(3, 0), Eigen::MatrixXf(3, 0), radius{0.5}).cols() == 0);
}

TEST_CASE("a dimension known at run time, any number of threads and any vectors give the same") {
  const auto cloud = surface<test::f3>();
  const auto expected = fpfh(cloud, radius{0.5}, {.threads = 1});
  CHECK(test::same_bits(expected, fpfh(cloud, radius{0.5}, {.threads = 4})));
  const Eigen::MatrixXf points = cloud.points, normals = cloud.normals;
  CHECK(test::same_bits(expected, fpfh(points, normals, radius{0.5})));
  for (const auto target : test::available_targets()) {
    const test::using_target used{target};
    CHECK(test::same_bits(expected, fpfh(cloud, radius{0.5})));
  }
}
