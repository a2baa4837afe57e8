// SPDX-License-Identifier: MIT
//
// What the tests of clustering, models and embeddings share: labelled points.
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>
export module clustering_support;

import cilantro;
import test_support;

export namespace test {

/// `count` points around each of the columns of `centers`, within a cube of edge 2 · `spread`.
template <class Space, class M>
auto blobs(const M& centers, cilantro::index_t count, double spread, std::uint64_t seed = 0) {
  using S = typename Space::scalar;
  cilantro::point_matrix<S, Space::static_dimension> points(Space::dimension,
                                                            centers.cols() * count);
  cilantro::random_stream random{seed};
  for (cilantro::index_t i = 0; i < points.cols(); ++i)
    for (cilantro::index_t d = 0; d < points.rows(); ++d)
      points(d, i) = static_cast<S>(double(centers(d, i / count)) + spread * random.uniform(-1, 1));
  return points;
}

/// The corners of a cube of the given edge, as many as asked for.
template <class Space>
auto corners(cilantro::index_t count, double edge) {
  cilantro::point_matrix<typename Space::scalar, Space::static_dimension> points(Space::dimension,
                                                                                 count);
  for (cilantro::index_t c = 0; c < count; ++c)
    for (cilantro::index_t d = 0; d < Space::dimension; ++d)
      points(d, c) = static_cast<typename Space::scalar>((c >> d) % 2 == 1 ? edge : 0);
  return points;
}

/// Whether two labelings are the same up to the names of the labels.
template <class A, class B>
bool same_partition(const A& a, const B& b) {
  std::map<std::int32_t, std::int32_t> there, back;
  if (std::size(a) != std::size(b)) return false;
  for (std::size_t i = 0; i < std::size(a); ++i) {
    if (there.emplace(a[i], b[i]).first->second != b[i]) return false;
    if (back.emplace(b[i], a[i]).first->second != a[i]) return false;
  }
  return true;
}

struct labelled_points {
  Eigen::MatrixXd points;
  std::vector<std::int32_t> labels;
  cilantro::index_t classes = 0;
};

/// An ARFF file with numbers, and a class in the last column or, if so said, in the first.
labelled_points read_arff(const std::filesystem::path& path, bool class_first = false) {
  std::ifstream in{path};
  std::vector<std::vector<double>> rows;
  std::vector<std::string> names;
  std::string line;
  for (bool data = false; std::getline(in, line);) {
    if (line.empty() || line[0] == '%') continue;
    if (line[0] == '@') {
      data = data || line.starts_with("@data") || line.starts_with("@DATA");
      continue;
    }
    if (!data) continue;
    std::erase_if(line, [](char c) { return c == '\r' || c == ' '; });
    std::vector<std::string> cells;
    std::istringstream split{line};
    for (std::string cell; std::getline(split, cell, ',');) cells.push_back(cell);
    if (cells.size() < 2) continue;
    names.push_back(class_first ? cells.front() : cells.back());
    cells.erase(class_first ? cells.begin() : cells.end() - 1);
    rows.emplace_back();
    for (const auto& cell : cells) rows.back().push_back(std::stod(cell));
  }
  labelled_points all;
  const std::set<std::string> classes{names.begin(), names.end()};
  all.classes = static_cast<cilantro::index_t>(classes.size());
  all.points.resize(std::ssize(rows.front()), std::ssize(rows));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t d = 0; d < rows[i].size(); ++d)
      all.points(std::ptrdiff_t(d), std::ptrdiff_t(i)) = rows[i][d];
    all.labels.push_back(std::int32_t(std::distance(classes.begin(), classes.find(names[i]))));
  }
  return all;
}

/// Each row brought to mean 0 and variance 1.
void standardize(Eigen::MatrixXd& points) {
  for (auto row : points.rowwise()) {
    row.array() -= row.mean();
    row /= std::sqrt(row.squaredNorm() / double(row.size()));
  }
}

}  // namespace test
