// SPDX-License-Identifier: MIT
//
// Boxes, and which of many meet a region. Internal.
module cilantro.tiles:box_tree;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A box that grows; that of no points is empty.
template <int D>
struct extent {
  std::array<double, D> lower, upper;

  extent() {
    lower.fill(std::numeric_limits<double>::infinity());
    upper.fill(-std::numeric_limits<double>::infinity());
  }
  [[nodiscard]] bool empty() const { return lower[0] > upper[0]; }
  template <class P>
  void add(const P& point) {
    for (int d = 0; d < D; ++d) {
      lower[d] = std::min(lower[d], point[d]);
      upper[d] = std::max(upper[d], point[d]);
    }
  }
  void add(const extent& other) {
    for (int d = 0; d < D; ++d) {
      lower[d] = std::min(lower[d], other.lower[d]);
      upper[d] = std::max(upper[d], other.upper[d]);
    }
  }
};

/// Numbered boxes that somebody else keeps, as a tree: those that meet a region are found in about
/// as many steps as there are, whatever their order. 4 bytes for each box, and one more box for
/// each 16. Empty boxes meet nothing.
/// Source: Leutenegger, Lopez & Edgington 1997, "STR: a simple and efficient algorithm for R-tree
/// packing", by the first two coordinates.
template <int D>
class box_tree {
 public:
  box_tree() = default;
  /// Box number i of `count` is `box_of(i)`.
  template <class B>
  box_tree(index_t count, const B& box_of) {
    order_.reserve(count);
    for (index_t i = 0; i < count; ++i) {
      if (box_of(i).empty()) continue;
      all_.add(box_of(i));
      order_.push_back(static_cast<std::uint32_t>(i));
    }
    put_together(box_of);
    std::vector<extent<D>> finest((order_.size() + fan_out - 1) / fan_out);
    for (std::size_t i = 0; i < order_.size(); ++i) finest[i / fan_out].add(box_of(order_[i]));
    while (finest.size() > 1) {
      std::vector<extent<D>> coarser((finest.size() + fan_out - 1) / fan_out);
      for (std::size_t i = 0; i < finest.size(); ++i) coarser[i / fan_out].add(finest[i]);
      levels_.push_back(std::exchange(finest, std::move(coarser)));
    }
  }

  /// The box of all.
  [[nodiscard]] const extent<D>& all() const { return all_; }

  /// Calls `visit(i)` for each box that meets a region, in any order. A box that does not meet it
  /// has no part that does.
  template <class M, class B, class F>
  void find(const M& meets, const B& box_of, const F& visit) const {
    if (!order_.empty() && meets(all_)) descend(levels_.size(), 0, meets, box_of, visit);
  }

 private:
  static constexpr std::size_t fan_out = 16;

  /// Sorts boxes into columns, and each column by its other coordinate.
  template <class B>
  void put_together(const B& box_of) {
    const auto by = [&](int d) {
      return [&box_of, d](std::uint32_t i) {
        const extent<D>& box = box_of(i);
        return box.lower[d] / 2 + box.upper[d] / 2;
      };
    };
    std::ranges::sort(order_, {}, by(0));
    const auto groups = double(order_.size()) / double(fan_out);
    const auto column = static_cast<std::ptrdiff_t>(std::ceil(std::sqrt(groups))) *
                        static_cast<std::ptrdiff_t>(fan_out);
    for (std::ptrdiff_t begin = 0; begin < std::ssize(order_); begin += column)
      std::ranges::sort(order_.begin() + begin,
                        order_.begin() + std::min(begin + column, std::ssize(order_)), {}, by(1));
  }

  /// Below node number `node` are `fan_out` nodes of the next finer level, or boxes.
  template <class M, class B, class F>
  void descend(std::size_t level, std::size_t node, const M& meets, const B& box_of,
               const F& visit) const {
    const std::size_t first = node * fan_out;
    if (level == 0) {
      for (std::size_t i = first; i < std::min(first + fan_out, order_.size()); ++i)
        if (meets(box_of(order_[i]))) visit(order_[i]);
      return;
    }
    const auto& finer = levels_[level - 1];
    for (std::size_t i = first; i < std::min(first + fan_out, finer.size()); ++i)
      if (meets(finer[i])) descend(level - 1, i, meets, box_of, visit);
  }

  std::vector<std::uint32_t> order_;            ///< Those that are not empty.
  std::vector<std::vector<extent<D>>> levels_;  ///< Of `fan_out` each, the finest first.
  extent<D> all_;
};

}  // namespace cilantro
