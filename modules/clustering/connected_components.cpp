// SPDX-License-Identifier: MIT
module cilantro.clustering;

import cilantro.numeric;

namespace cilantro {

void expect_sensible(const components_options& options, index_t size) {
  expect_from(0, double(options.min_cluster_size), "connected_components: min_cluster_size");
  expect_from(0, double(options.max_cluster_size), "connected_components: max_cluster_size");
  if (options.seeds)
    expects(std::ranges::all_of(*options.seeds, [&](index_t i) { return 0 <= i && i < size; }),
            "connected_components: a seed is not one of the points");
}

clusters components_of(disjoint_sets& sets, std::span<const std::uint8_t> belongs,
                       const components_options& options) {
  const index_t n = sets.size();
  std::vector<clusters::label> labels(n);
  std::vector<std::int32_t> counts(labels.size());
  for (index_t i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const bool is_in = belongs.empty() || belongs[at];
    labels[at] = is_in ? static_cast<clusters::label>(sets.find(i)) : clusters::none;
    if (is_in) ++counts[labels[at]];
  }
  std::vector<bool> is_wanted(labels.size(), !options.seeds);
  if (options.seeds)
    for (const index_t i : *options.seeds) is_wanted[sets.find(i)] = true;
  for (auto& l : labels) {
    if (l < 0) continue;
    const auto root = static_cast<std::size_t>(l);
    if (!is_wanted[root] || counts[root] < options.min_cluster_size ||
        counts[root] > options.max_cluster_size)
      l = clusters::none;
  }
  counts = {};  // Numbering the labels needs as much again.
  return clusters{std::move(labels)};
}

}  // namespace cilantro
