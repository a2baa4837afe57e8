// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/closed_spaces.hpp"
module cilantro.search;

namespace cilantro {
namespace {

/// A coordinate and the place of its point: what a node is cut by. Equal coordinates are told apart
/// by place, so that every cut is determined.
template <Scalar S>
struct keyed_place {
  S value;
  std::int32_t place;
  friend bool operator<(const keyed_place& a, const keyed_place& b) {
    return a.value < b.value || (a.value == b.value && a.place < b.place);
  }
};

/// Sorts the searchable points of a tree into the order of its leaves, level by level. Points move
/// from one pair of arrays to the other at each level, so that what a node reads is adjacent.
template <Scalar S, int D>
class tree_builder {
 public:
  tree_builder(kd_tree_nodes<S, D>& tree, const kd_tree_options& options)
      : tree_{tree}, how_{options.threads, options.monitor} {
    const index_t n = tree_.searchable();
    const auto leaves = [&] { return index_t{1} << tree_.levels; };
    // No leaf may be empty, even if that leaves two points where one is asked for.
    while (n > leaves() * options.max_leaf_size && 2 * leaves() <= n) ++tree_.levels;
    tree_.cuts.resize((std::size_t{1} << tree_.levels) - 1);
    arrays_[0] = {tree_.coordinates.data(), tree_.indices.data()};
    if (tree_.levels == 0) return;
    other_coordinates_.resize(tree_.coordinates.size());
    other_indices_.resize(tree_.indices.size());
    arrays_[1] = {other_coordinates_.data(), other_indices_.data()};
  }

  void build() {
    // Few large nodes first, a level at a time; then many subtrees, each of which stays in a cache.
    constexpr int shared_levels = 8;
    const int levels = tree_.levels, shared = std::min(levels, shared_levels);
    const auto report = [&](double done) {
      if (how_.monitor.progress) how_.monitor.progress(done);
    };
    for (int level = 0; level < shared; ++level) {
      parallel_blocks(index_t{1} << level, 1, {how_.threads, {{}, how_.monitor.stop}},
                      [&](index_t k, index_t, index_t) { split(level, k); });
      report(double(level + 1) / double(levels + 1));
    }
    if (shared < levels)
      parallel_blocks(index_t{1} << shared, 1, {how_.threads, {{}, how_.monitor.stop}},
                      [&](index_t k, index_t, index_t) { split_all(shared, k); });
    if (levels % 2 == 1) {
      tree_.coordinates.swap(other_coordinates_);
      tree_.indices.swap(other_indices_);
    }
    report(1);
  }

 private:
  struct arrays {
    S* coordinates;
    std::int32_t* indices;
  };
  struct extent {
    index_t axis;
    S low, high;
  };

  [[nodiscard]] index_t dimension() const { return D == dynamic ? tree_.dimension : D; }

  void split_all(int level, index_t k) {
    split(level, k);
    if (level + 1 == tree_.levels) return;
    split_all(level + 1, 2 * k);
    split_all(level + 1, 2 * k + 1);
  }

  /// The axis along which the points from `first` on spread most.
  [[nodiscard]] extent widest_axis(const S* first, index_t count) const {
    point_vector<S, D> low = Eigen::Map<const point_vector<S, D>>{first, dimension()}, high = low;
    for (index_t i = 1; i < count; ++i)
      for (index_t d = 0; d < dimension(); ++d) {
        const S value = first[i * dimension() + d];
        low[d] = std::min(low[d], value);
        high[d] = std::max(high[d], value);
      }
    index_t widest = 0;
    (high - low).maxCoeff(&widest);
    return {widest, low[widest], high[widest]};
  }

  void split(int level, index_t k) {
    const index_t begin = tree_.begin(level, k), end = tree_.begin(level, k + 1);
    const index_t first_half = tree_.begin(level + 1, 2 * k + 1) - begin;
    const arrays from = arrays_[level % 2], to = arrays_[1 - level % 2];
    const auto [axis, low, high] = widest_axis(from.coordinates + begin * dimension(), end - begin);
    const auto value = [&](index_t i) { return from.coordinates[i * dimension() + axis]; };
    const auto median = select(begin, end, first_half, low, high, value);

    auto& cut = tree_.cuts[(std::size_t{1} << level) - 1 + static_cast<std::size_t>(k)];
    cut = {low, median.value, static_cast<std::int32_t>(axis)};
    index_t next[2] = {begin, begin + first_half};
    for (index_t i = begin; i < end; ++i) {
      const S v = value(i);
      const bool second = !(keyed_place<S>{v, static_cast<std::int32_t>(i)} < median);
      cut.low = second ? cut.low : std::max(cut.low, v);
      const index_t place = next[second]++;
      std::copy_n(from.coordinates + i * dimension(), dimension(),
                  to.coordinates + place * dimension());
      to.indices[place] = from.indices[i];
    }
  }

  /// The one of the points `begin` to `end` that `nth` others come before along an axis on which
  /// all lie between `low` and `high`. A histogram leaves few of them to be ordered.
  template <class Value>
  [[nodiscard]] keyed_place<S> select(index_t begin, index_t end, index_t nth, S low, S high,
                                      Value value) const {
    const int bins = end - begin > 4096 ? 256 : 32;
    const S scale = S(bins - 1) / (high - low);
    const bool spread = end - begin > 2 * bins && scale < std::numeric_limits<S>::max();
    const auto bin = [&](S v) { return static_cast<std::size_t>((v - low) * scale); };
    std::array<std::int32_t, 256> count{};
    std::size_t wanted = 0;
    if (spread) {
      for (index_t i = begin; i < end; ++i) ++count[bin(value(i))];
      for (; nth >= count[wanted]; ++wanted) nth -= count[wanted];
    }
    buffer<keyed_place<S>> keys;
    keys.reserve(static_cast<std::size_t>(spread ? count[wanted] : end - begin));
    for (index_t i = begin; i < end; ++i)
      if (!spread || bin(value(i)) == wanted)
        keys.push_back({value(i), static_cast<std::int32_t>(i)});
    std::nth_element(keys.begin(), keys.begin() + nth, keys.end());
    return keys[static_cast<std::size_t>(nth)];
  }

  kd_tree_nodes<S, D>& tree_;
  execution how_;
  buffer<S> other_coordinates_;
  buffer<std::int32_t> other_indices_;
  arrays arrays_[2] = {};
};

}  // namespace

template <Scalar S, int D>
kd_tree_nodes<S, D>::kd_tree_nodes(points_view<S, D> points, const kd_tree_options& options)
    : size{points.size()},
      dimension{points.dimension()},
      largest{largest_searchable_coordinate<S>(dimension)} {
  expects(points.empty() || dimension > 0, "kd_tree: points must have at least one dimension");
  expects(size <= std::numeric_limits<std::int32_t>::max(),
          "kd_tree: at most 2^31 - 1 points can be searched");
  expects(options.max_leaf_size > 0, "kd_tree: max_leaf_size must be at least 1");
  coordinates.reserve(static_cast<std::size_t>(size * dimension));
  indices.reserve(static_cast<std::size_t>(size));
  for (index_t i = 0; i < size; ++i) {
    const S* point = points.data() + i * points.stride();
    if (!is_searchable(point, dimension, largest)) continue;
    coordinates.insert(coordinates.end(), point, point + dimension);
    indices.push_back(static_cast<std::int32_t>(i));
  }
  if (indices.empty()) return;
  const Eigen::Map<const point_matrix<S, D>> all{coordinates.data(), dimension, searchable()};
  low = all.rowwise().minCoeff();
  high = all.rowwise().maxCoeff();
  tree_builder<S, D>{*this, options}.build();
}

#define CILANTRO_INSTANTIATE(S, D)                \
  template struct kd_tree_nodes<S, D>;            \
  template class kd_tree_engine<S, D, euclidean>; \
  template class kd_tree_engine<S, D, manhattan>; \
  template class kd_tree_engine<S, D, chebyshev>; \
  template class kd_tree_engine<S, D, so2>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE
// Of four coordinates, which the library is not compiled for: as a run-time dimension.
template class kd_tree_engine<float, dynamic, so3>;
template class kd_tree_engine<double, dynamic, so3>;

}  // namespace cilantro
