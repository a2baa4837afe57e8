// SPDX-License-Identifier: MIT
module cilantro.numeric;

namespace cilantro {

block_pattern::block_pattern(index_t nodes,
                             std::span<const std::pair<std::int32_t, std::int32_t>> links) {
  expects(0 <= nodes && nodes <= std::numeric_limits<std::int32_t>::max(),
          "block_pattern: there can be at most 2^31 - 1 nodes");
  const auto is_node = [&](std::int32_t i) { return 0 <= i && i < nodes; };
  std::vector<index_t> ends(nodes + 1, 0);
  for (const auto& [a, b] : links) {
    expects(is_node(a) && is_node(b), "block_pattern: a link leads to a node that there is not");
    if (a != b) ++ends[std::min(a, b)];
  }
  index_t sum = 0;
  for (auto& end : ends) sum += std::exchange(end, sum);
  std::vector<std::int32_t> lower(sum);
  for (const auto& [a, b] : links)
    if (a != b) lower[ends[std::min(a, b)]++] = std::max(a, b);
  offsets_.reserve(nodes + 1);
  rows_.reserve(nodes + sum);
  offsets_.push_back(0);
  for (index_t column = 0, begin = 0; column < nodes; begin = ends[column], ++column) {
    const auto first = lower.begin() + begin, last = lower.begin() + ends[column];
    std::sort(first, last);
    rows_.push_back(static_cast<std::int32_t>(column));
    rows_.insert(rows_.end(), first, std::unique(first, last));
    offsets_.push_back(std::ssize(rows_));
  }
}

index_t block_pattern::slot(index_t row, index_t column) const {
  if (column < 0 || column > row || row >= nodes()) return -1;
  const auto first = rows_.begin() + offsets_[column], last = rows_.begin() + offsets_[column + 1];
  const auto found = std::lower_bound(first, last, row);
  return found != last && *found == row ? found - rows_.begin() : -1;
}

}  // namespace cilantro
