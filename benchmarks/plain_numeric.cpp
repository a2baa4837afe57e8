// SPDX-License-Identifier: MIT
//
// Eigen's sparse factorisation as a careful user calls it: what the pattern says, it says once.
#include <Eigen/SparseCholesky>
#include <vector>

#include "block_system.hpp"
#include "common.hpp"

void block_system_of(benchmark::State& state, int nodes) {
  const block_system system{nodes};
  constexpr int block = block_system::block;
  std::vector<Eigen::Triplet<double>> entries;
  const auto put = [&](int row, int column, const block_system::values& v) {
    for (int j = 0; j < block; ++j)
      for (int i = row == column ? j : 0; i < block; ++i)
        entries.emplace_back(row * block + i, column * block + j, v[std::size_t(j * block + i)]);
  };
  for (int i = 0; i < nodes; ++i) put(i, i, system.diagonal[std::size_t(i)]);
  for (std::size_t k = 0; k < system.links.size(); ++k)
    put(system.links[k].first, system.links[k].second, system.below[k]);
  Eigen::SparseMatrix<double> matrix(nodes * block, nodes * block);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
  solver.analyzePattern(matrix);
  Eigen::VectorXd x;
  for (auto _ : state) {
    solver.factorize(matrix);
    x = solver.solve(
        Eigen::VectorXd::Map(system.right_side.data(), Eigen::Index(system.right_side.size())));
  }
  system.report(state, x.data());
}
