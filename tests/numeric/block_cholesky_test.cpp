// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

using links = std::vector<std::pair<std::int32_t, std::int32_t>>;

links random_links(std::int32_t nodes, double share, random_stream& random) {
  links found;
  for (std::int32_t i = 0; i < nodes; ++i)
    for (std::int32_t j = 0; j < i; ++j)
      if (random.uniform() < share) found.emplace_back(i, j);
  return found;
}

/// Nodes of a square grid and links to all that are at most `reach` steps away along both axes.
links grid_links(std::int32_t edge, std::int32_t reach) {
  links found;
  for (std::int32_t i = 0; i < edge * edge; ++i)
    for (std::int32_t j = 0; j < i; ++j)
      if (i / edge - j / edge <= reach && std::abs(i % edge - j % edge) <= reach)
        found.emplace_back(j, i);
  return found;
}

/// A symmetric matrix of blocks, and its answers.
struct block_matrix {
  block_pattern pattern;
  index_t block;
  std::vector<double> values;

  block_matrix(index_t nodes, const links& from, index_t size)
      : pattern{nodes, from}, block{size}, values(pattern.blocks() * size * size) {}

  [[nodiscard]] index_t size() const { return pattern.nodes() * block; }
  [[nodiscard]] Eigen::Map<Eigen::MatrixXd> at(index_t row, index_t column) {
    return {values.data() + pattern.slot(row, column) * block * block, block, block};
  }
  template <class Visit>
  void each_block(const Visit& visit) const {
    for (index_t column = 0; column < pattern.nodes(); ++column)
      for (index_t k = pattern.offsets()[column]; k < pattern.offsets()[column + 1]; ++k)
        visit(pattern.rows()[k], column,
              Eigen::Map<const Eigen::MatrixXd>{values.data() + k * block * block, block, block});
  }
  [[nodiscard]] Eigen::MatrixXd dense() const {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(size(), size());
    each_block([&](index_t row, index_t column, const auto& v) {
      all.block(row * block, column * block, block, block) = v;
    });
    for (index_t j = 0; j < size(); ++j)
      for (index_t i = j + 1; i < size(); ++i) all(j, i) = all(i, j);
    return all;
  }
};

/// Each link asks something of its two nodes, and each node a little of itself.
block_matrix random_matrix(index_t nodes, const links& from, index_t block, random_stream& random) {
  block_matrix made{nodes, from, block};
  for (const auto& [a, b] : from) {
    const index_t i = std::max(a, b), j = std::min(a, b);
    Eigen::MatrixXd row(block, 2 * block);
    for (index_t k = 0; k < row.size(); ++k) row.data()[k] = random.uniform() - 0.5;
    const Eigen::MatrixXd product = row.transpose() * row;
    made.at(i, i) += product.topLeftCorner(block, block);
    made.at(i, j) += product.topRightCorner(block, block);
    made.at(j, j) += product.bottomRightCorner(block, block);
  }
  for (index_t i = 0; i < nodes; ++i) made.at(i, i).diagonal().array() += 0.1;
  return made;
}

Eigen::VectorXd random_vector(index_t size, random_stream& random) {
  Eigen::VectorXd v(size);
  for (auto& x : v) x = random.uniform() - 0.5;
  return v;
}

Eigen::VectorXd solved(const block_factor& factor, Eigen::VectorXd right_side) {
  factor.solve(right_side);
  return right_side;
}

/// That unknowns that are not determined are counted and 0, and that the others solve their
/// equations.
void check_determined(const block_matrix& matrix, index_t undetermined) {
  const Eigen::MatrixXd dense = matrix.dense();
  random_stream random{9};
  const Eigen::VectorXd right_side = random_vector(matrix.size(), random);
  const auto factor = block_cholesky{matrix.pattern, matrix.block}.factorize(matrix.values);
  const Eigen::VectorXd x = solved(factor, right_side);
  REQUIRE(x.allFinite());
  CHECK(factor.undetermined() == undetermined);
  CHECK((x.array() == 0).count() == undetermined);
  const Eigen::VectorXd residual = dense * x - right_side;
  for (index_t i = 0; i < x.size(); ++i)
    if (x[i] != 0) CHECK(std::abs(residual[i]) < 1e-9 * (1 + x.norm()));
}

}  // namespace

TEST_CASE("a block pattern has the diagonal and each link once, column by column") {
  const links twice{{2, 0}, {0, 2}, {3, 3}, {3, 1}, {1, 0}, {2, 0}};
  const block_pattern pattern{5, twice};
  CHECK(pattern.nodes() == 5);
  CHECK(pattern.blocks() == 8);
  CHECK(std::ranges::equal(pattern.offsets(), std::vector<index_t>{0, 3, 5, 6, 7, 8}));
  CHECK(std::ranges::equal(pattern.rows(), std::vector<std::int32_t>{0, 1, 2, 1, 3, 2, 3, 4}));
  CHECK(pattern.slot(2, 0) == 2);
  CHECK(pattern.slot(3, 1) == 4);
  CHECK(pattern.slot(4, 4) == 7);
  for (const auto& [row, column] : links{{0, 2}, {3, 0}, {5, 0}, {0, -1}, {-1, -1}})
    CHECK(pattern.slot(row, column) == -1);
  CHECK(block_pattern{0, {}}.blocks() == 0);
  CHECK_THROWS_AS((block_pattern{-1, {}}), invalid_input);
  CHECK_THROWS_AS((block_pattern{index_t{1} << 31, {}}), invalid_input);
  CHECK_THROWS_AS((block_pattern{5, links{{0, 5}}}), invalid_input);
  CHECK_THROWS_AS((block_pattern{5, links{{-1, 0}}}), invalid_input);
}

TEST_CASE("block systems have the solutions of dense ones") {
  struct graph {
    std::int32_t nodes;
    double share;
  };
  random_stream random{3};
  for (const index_t block : {1, 2, 3, 6, 12, 20})
    for (const auto& [nodes, share] :
         {graph{1, 0}, graph{2, 1}, graph{6, 0}, graph{17, 1}, graph{20, 0.1}, graph{25, 0.04}}) {
      CAPTURE(block);
      CAPTURE(nodes);
      CAPTURE(share);
      const links from = random_links(nodes, share, random);
      const auto matrix = random_matrix(nodes, from, block, random);
      const auto factor = block_cholesky{matrix.pattern, block}.factorize(matrix.values);
      const Eigen::VectorXd right_side = random_vector(matrix.size(), random);
      const Eigen::VectorXd expected = matrix.dense().ldlt().solve(right_side);
      CHECK(factor.size() == matrix.size());
      CHECK(factor.undetermined() == 0);
      CHECK(solved(factor, right_side).isApprox(expected, 1e-10));
    }
}

TEST_CASE("block systems of grids are solved, of many fronts and of large ones") {
  random_stream random{4};
  struct graph {
    links from;
    std::int32_t nodes;
  };
  for (const auto& [from, nodes] : {graph{grid_links(20, 1), 400}, graph{grid_links(9, 3), 81},
                                    graph{random_links(60, 1, random), 60}})
    for (const index_t block : {3, 5, 6}) {
      auto matrix = random_matrix(nodes, from, block, random);
      const block_cholesky solver{matrix.pattern, block};
      const Eigen::VectorXd right_side = random_vector(matrix.size(), random);
      const Eigen::VectorXd x = solved(solver.factorize(matrix.values), right_side);
      Eigen::VectorXd left_side = Eigen::VectorXd::Zero(matrix.size());
      matrix.each_block([&](index_t row, index_t column, const auto& v) {
        left_side.segment(row * block, block) += v * x.segment(column * block, block);
        if (row != column)
          left_side.segment(column * block, block) += v.transpose() * x.segment(row * block, block);
      });
      CHECK(left_side.isApprox(right_side, 1e-10));
    }
}

TEST_CASE("unknowns that block systems do not determine are counted and stay 0") {
  random_stream random{5};
  for (const index_t block : {1, 3, 4, 6, 12}) {
    const links from = random_links(15, 0.3, random);
    // A node of which nothing is said.
    auto matrix = random_matrix(15, from, block, random);
    for (index_t i = 0; i < 15; ++i) {
      if (const auto k = matrix.pattern.slot(i, 7); k >= 0) matrix.at(i, 7).setZero();
      if (const auto k = matrix.pattern.slot(7, i); k >= 0) matrix.at(7, i).setZero();
    }
    check_determined(matrix, block);
    // Nothing said at all.
    std::ranges::fill(matrix.values, 0.0);
    check_determined(matrix, matrix.size());
    // Differences only, in two parts that are not linked.
    links halves;
    for (const auto& [a, b] : random_links(30, 1, random))
      if (a % 2 == b % 2 && random.uniform() < 0.6) halves.emplace_back(a, b);
    block_matrix differences{30, halves, block};
    for (const auto& [a, b] : halves) {
      const double weight = random.uniform() + 0.1;
      differences.at(a, a).diagonal().array() += weight;
      differences.at(b, b).diagonal().array() += weight;
      differences.at(std::max(a, b), std::min(a, b)).diagonal().array() -= weight;
    }
    check_determined(differences, 2 * block);
    // Not one direction of a node but all others, and what is negative.
    auto indefinite = random_matrix(15, from, block, random);
    indefinite.at(3, 3)(0, 0) = -1;
    const auto factor = block_cholesky{indefinite.pattern, block}.factorize(indefinite.values);
    CHECK(factor.undetermined() > 0);
    check_determined(indefinite, factor.undetermined());
    for (auto& v : indefinite.values) v = -v;
    CHECK(block_cholesky{indefinite.pattern, block}.factorize(indefinite.values).undetermined() >
          indefinite.size() / 2);
  }
}

TEST_CASE("block systems whose numbers overflow have finite solutions") {
  random_stream random{6};
  const links from = random_links(12, 0.5, random);
  block_matrix matrix{12, from, 3};
  for (auto& v : matrix.values) v = (random.uniform() - 0.5) * 1e308;
  for (index_t i = 0; i < 12; ++i) matrix.at(i, i).diagonal().setConstant(i % 2 ? 1e-300 : 1);
  const auto factor = block_cholesky{matrix.pattern, 3}.factorize(matrix.values);
  CHECK(factor.undetermined() > 0);
  CHECK(solved(factor, Eigen::VectorXd::Ones(36)).allFinite());
}

TEST_CASE("block systems give the same bits with all vector targets, and with reused memory") {
  random_stream random{7};
  for (const index_t block : {2, 3, 6, 7}) {
    const auto matrix = random_matrix(144, grid_links(12, 2), block, random);
    const auto other = random_matrix(30, random_links(30, 0.3, random), block, random);
    const Eigen::VectorXd right_side = random_vector(matrix.size(), random);
    std::vector<Eigen::VectorXd> found;
    for (const auto target : test::available_targets()) {
      const test::using_target use{target};
      const block_cholesky solver{matrix.pattern, block};
      auto factor = solver.factorize(matrix.values);
      found.push_back(solved(factor, right_side));
      block_cholesky{other.pattern, block}.factorize(other.values, factor);
      CHECK(factor.size() == other.size());
      const block_cholesky copy = solver;
      copy.factorize(matrix.values, factor);
      found.push_back(solved(factor, right_side));
    }
    for (const auto& x : found) CHECK(x == found.front());
  }
}

TEST_CASE("block systems refuse what does not fit, and values that are not finite") {
  random_stream random{8};
  const links from{{0, 1}, {1, 2}};
  auto matrix = random_matrix(3, from, 3, random);
  CHECK_THROWS_AS((block_cholesky{matrix.pattern, 0}), invalid_input);
  CHECK_THROWS_AS((block_cholesky{matrix.pattern, index_t{1} << 31}), invalid_input);
  const block_cholesky solver{matrix.pattern, 3};
  CHECK(solver.size() == 9);
  CHECK(solver.block_size() == 3);
  CHECK(solver.pattern().blocks() == 5);
  auto factor = solver.factorize(matrix.values);
  std::vector<double> short_side(8);
  CHECK_THROWS_AS(factor.solve(short_side), invalid_input);
  const auto few = std::span{std::as_const(matrix.values)}.subspan(1);
  CHECK_THROWS_AS((void)solver.factorize(few), invalid_input);
  // Above the diagonal nothing counts.
  const auto before = solved(factor, Eigen::VectorXd::Ones(9));
  matrix.at(1, 1)(0, 2) = test::nan<double>;
  CHECK(solved(solver.factorize(matrix.values), Eigen::VectorXd::Ones(9)) == before);
  for (const double value : {test::nan<double>, test::infinity<double>, -test::infinity<double>}) {
    auto bad = matrix;
    bad.at(1, 1)(2, 1) = value;
    CHECK_THROWS_AS(solver.factorize(bad.values, factor), invalid_input);
    CHECK(factor.size() == 0);
    bad = matrix;
    bad.at(2, 1)(0, 1) = value;
    CHECK_THROWS_AS((void)solver.factorize(bad.values), invalid_input);
  }
  const block_cholesky nothing{block_pattern{0, {}}, 6};
  std::vector<double> none;
  nothing.factorize({}).solve(none);
  block_factor{}.solve(none);
}
