// SPDX-License-Identifier: MIT
//
// Answers scripts/differential.py: answers QUESTION POINTS.npy ANSWER.npy [NUMBER...]. Points and
// answers are rows.
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <vector>

import cilantro;
using namespace cilantro;

namespace {

using matrix = Eigen::MatrixXd;
using numbers = std::vector<double>;
template <class S>
using points_of = Eigen::Matrix<S, dynamic, dynamic>;

matrix column_of(const auto& values) {
  matrix column(std::ssize(values), 1);
  index_t i = 0;
  for (const auto value : values) column(i++, 0) = double(value);
  return column;
}

template <class S>
matrix neighbors_of(const points_of<S>& points, const neighborhood_spec& spec, index_t width) {
  const kd_tree tree{points};
  const auto near = find_neighborhoods(tree, points, spec);
  matrix answer = matrix::Constant(points.cols(), 2 * width, -1);
  for (index_t q = 0; q < near.size(); ++q) {
    index_t k = 0;
    for (const auto& [index, distance] : near[q]) {
      if (k == width) break;
      answer(q, k) = double(index);
      answer(q, width + k++) = double(distance);
    }
  }
  return answer;
}

template <class S>
matrix answer_of(const std::string& question, const points_of<S>& points, const numbers& n) {
  if (question == "knn") return neighbors_of<S>(points, knn{index_t(n[0])}, index_t(n[0]));
  if (question == "radius") {
    const kd_tree tree{points};
    matrix counts(points.cols(), 1);
    const auto near = find_neighborhoods(tree, points, radius{n[0]});
    for (index_t q = 0; q < near.size(); ++q) counts(q, 0) = double(near[q].size());
    return counts;
  }
  if (question == "moments") {
    const auto found = *mean_and_covariance(points);
    matrix answer(points.rows() + 1, points.rows());
    answer << found.mean.template cast<double>().transpose(), found.covariance;
    return answer;
  }
  if (question == "principal") {
    const auto found = *principal_components(points);
    matrix answer(points.rows() + 1, points.rows());
    answer << found.eigenvalues.transpose(), found.axes.template cast<double>().transpose();
    return answer;
  }
  if (question == "normals") {
    const auto found = estimate_normals(points, knn{index_t(n[0])});
    matrix answer(points.cols(), points.rows() + 1);
    answer << found.normals.template cast<double>().transpose(),
        found.curvature.template cast<double>();
    return answer;
  }
  if (question == "icp") {
    const Eigen::Matrix3Xd target = points.template cast<double>();
    const Eigen::Vector3d middle = target.rowwise().mean();
    const Eigen::Isometry3d turn = Eigen::Translation3d{middle} *
                                   Eigen::AngleAxisd{n[2], Eigen::Vector3d::UnitZ()} *
                                   Eigen::Translation3d{-middle};
    return align(transform_points(turn, target), target,
                 {.metric = point_to_point{},
                  .max_distance = n[1],
                  .max_iterations = int(n[0]),
                  .tolerance = 0})
        .transform.matrix();
  }
  if (question == "outliers")
    return column_of(
        statistical_outliers(points, {.neighbors = index_t(n[0]), .deviations = n[1]}).kept);
  if (question == "dbscan") {
    const auto found = dbscan(points, {.radius = n[0], .min_points = index_t(n[1])});
    matrix answer(points.cols(), 2);
    answer << column_of(found.labels()), column_of(found.is_core);
    return answer;
  }
  if (question == "components")
    return column_of(connected_components(points, radius{n[0]}).labels());
  if (question == "voxels")
    return voxel_downsample(points, n[0]).template cast<double>().transpose();
  throw invalid_input{"there is no question " + question};
}

}  // namespace

int main(int count, char** words) try {
  if (count < 5)
    throw invalid_input{"answers float|double QUESTION POINTS.npy ANSWER.npy [NUMBER...]"};
  numbers n;
  for (int i = 5; i < count; ++i) n.push_back(std::strtod(words[i], nullptr));
  const matrix rows = read_matrix<double>(words[3]);
  const matrix answer = std::string{words[1]} == "float"
                            ? answer_of<float>(words[2], rows.transpose().cast<float>(), n)
                            : answer_of<double>(words[2], rows.transpose(), n);
  write_matrix(answer, words[4]);
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
