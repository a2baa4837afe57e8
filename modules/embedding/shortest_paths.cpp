// SPDX-License-Identifier: MIT
module cilantro.embedding;

namespace cilantro {
namespace {

using entry = std::pair<double, index_t>;  // A length so far, and where it leads.

template <Scalar S, class Column>
void paths_from(const neighborhoods<S>& graph, index_t start, std::vector<entry>& heap,
                Column&& length) {
  length.setConstant(std::numeric_limits<double>::infinity());
  length[start] = 0;
  heap.assign(1, {0, start});
  while (!heap.empty()) {
    std::ranges::pop_heap(heap, std::greater{});
    const auto [so_far, i] = heap.back();
    heap.pop_back();
    if (so_far > length[i]) continue;  // A shorter way has been found since.
    for (const auto& [j, distance] : graph[i]) {
      const double through = so_far + double(distance);
      if (!(through < length[j])) continue;
      length[j] = through;
      heap.emplace_back(through, j);
      std::ranges::push_heap(heap, std::greater{});
    }
  }
}

}  // namespace

template <Scalar S>
Eigen::MatrixXd shortest_paths(const neighborhoods<S>& graph, const execution& how) {
  const index_t n = graph.size();
  expect_nodes(graph, "shortest_paths");
  expects(std::ranges::all_of(graph.distances(), [](S d) { return d >= 0; }),
          "shortest_paths: a distance is negative or NaN");
  Eigen::MatrixXd lengths(n, n);
  parallel_blocks(n, 8, how, [&](index_t, index_t begin, index_t end) {
    std::vector<entry> heap;
    for (index_t j = begin; j < end; ++j) paths_from(graph, j, heap, lengths.col(j));
  });
  return lengths;
}
template Eigen::MatrixXd shortest_paths(const neighborhoods<float>&, const execution&);
template Eigen::MatrixXd shortest_paths(const neighborhoods<double>&, const execution&);

}  // namespace cilantro
