// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
#include "core/parallel_backend.hpp"
module cilantro.search;

namespace cilantro {
namespace {

template <class T>
using four __attribute__((ext_vector_type(4))) = T;

/// A point while the tree is built: its coordinates and its index in one vector, which is moved and
/// compared as one.
template <Scalar S, int D>
struct tree_record {
  using integer = std::conditional_t<sizeof(S) == 4, std::int32_t, std::int64_t>;
  four<S> places;  ///< The last one holds the bits of the index.

  static tree_record of(const S* point, index_t index) {
    four<S> places = S(0);
    for (int d = 0; d < D; ++d) places[d] = point[d];
    places[3] = std::bit_cast<S>(static_cast<integer>(index));
    return {places};
  }
  [[nodiscard]] S value(index_t axis) const {
    S v;
    std::memcpy(&v, reinterpret_cast<const char*>(this) + axis * index_t{sizeof(S)}, sizeof v);
    return v;
  }
  [[nodiscard]] std::int32_t index() const {
    return static_cast<std::int32_t>(std::bit_cast<integer>(S(places[3])));
  }
};

/// In any dimension: where the point is.
template <Scalar S>
struct tree_record<S, dynamic> {
  const S* point;
  std::int32_t place;

  static tree_record of(const S* point, index_t index) {
    return {point, static_cast<std::int32_t>(index)};
  }
  [[nodiscard]] S value(index_t axis) const { return point[axis]; }
  [[nodiscard]] std::int32_t index() const { return place; }
};

/// The value that `rank` others come before in the order of `count` of them. Quadratic, but without
/// a branch. There must be room for eight more.
template <Scalar S>
S nth_value(S* values, index_t count, index_t rank) {
  using integer = typename tree_record<S, 3>::integer;
  std::fill_n(values + count, 8, std::numeric_limits<S>::infinity());
  const four<integer> limit = static_cast<integer>(rank);
  four<S> best = -std::numeric_limits<S>::infinity();
  for (index_t k = 0; k < count; k += 8) {
    four<S> a, b;
    std::memcpy(&a, values + k, sizeof a);
    std::memcpy(&b, values + k + 4, sizeof b);
    four<integer> before_a = 0, before_b = 0;
    for (index_t j = 0; j < count; ++j) {
      before_a -= four<S>(values[j]) < a;
      before_b -= four<S>(values[j]) < b;
    }
    best = ((before_a <= limit) & (a > best)) ? a : best;
    best = ((before_b <= limit) & (b > best)) ? b : best;
  }
  return std::max(std::max(S(best[0]), S(best[1])), std::max(S(best[2]), S(best[3])));
}

/// Sorts the searchable points into the order of the leaves.
template <Scalar S, int D>
class tree_builder {
 public:
  using record = tree_record<S, D>;
  using nodes_type = kd_tree_nodes<S, D>;

  tree_builder(nodes_type& tree, points_view<S, D> points, const kd_tree_options& options)
      : tree_{tree}, points_{points}, how_{options.threads, options.monitor} {
    collect();
    const index_t blocks = tree_.blocks();
    const auto wanted = [&](index_t leaves) {
      return tree_.searchable > leaves * options.max_leaf_size;
    };
    while (wanted(index_t{1} << tree_.levels) && (index_t{2} << tree_.levels) <= blocks)
      ++tree_.levels;
    tree_.cuts.resize((std::size_t{1} << tree_.levels) - 1);
    if constexpr (nodes_type::has_boxes) {
      tree_.boxes.resize(8 * blocks);
      tree_.children.resize(std::size_t{16} << tree_.levels);
    }
  }

  void build() {
    if (records_.empty()) return;
    // Few large nodes first, a level at a time; then many subtrees, each of which stays in a cache.
    constexpr int shared_levels = 8;
    const int shared = std::min(tree_.levels, shared_levels);
    const auto report = [&](double done) {
      if (how_.monitor.progress) how_.monitor.progress(done);
    };
    for (int level = 0; level < shared; ++level) {
      // While there are fewer nodes than threads, all work on each of them.
      const index_t nodes = index_t{1} << level;
      together_ = 2 * nodes <= threads() && std::ssize(records_) / nodes >= least_together;
      if (together_)
        for (index_t k = 0; k < nodes; ++k) split(level, k);
      else
        in_parallel(nodes, [&](index_t k) { split(level, k); });
      together_ = false;
      report(double(level + 1) / double(tree_.levels + 2));
    }
    in_parallel(index_t{1} << shared, [&](index_t k) { split_all(shared, k); });
    report(double(tree_.levels + 1) / double(tree_.levels + 2));
    // What is needed from here on takes the place of what no longer is.
    spare_ = buffer<record>{};
    const auto places = static_cast<std::size_t>(tree_.blocks() * points_per_block);
    tree_.coordinates.resize(places * static_cast<std::size_t>(dimension()));
    tree_.indices.resize(places);
    parallel_for(tree_.blocks(), {how_.threads, {{}, how_.monitor.stop}},
                 [&](index_t b) { fill(b); });
    if constexpr (nodes_type::has_boxes) {
      // From the leaves to the root.
      for (index_t node = index_t{2} << tree_.levels; --node > 1;)
        set_smallest_index(parent_slot(node), smallest_index_of(node));
    }
    report(1);
  }

 private:
  struct extent {
    point_vector<S, D> low, high;
  };

  [[nodiscard]] index_t dimension() const { return D == dynamic ? tree_.dimension : D; }
  [[nodiscard]] record* first_of(index_t block) {
    return records_.data() + std::min(block * points_per_block, std::ssize(records_));
  }
  [[nodiscard]] index_t threads() const {
    return how_.threads > 0 ? how_.threads : detail::threads_of_part(1);
  }
  template <class F>
  void in_parallel(index_t n, F f) {
    parallel_blocks(n, 1, {how_.threads, {{}, how_.monitor.stop}},
                    [&](index_t k, index_t, index_t) { f(k); });
  }

  /// The searchable points, in their order.
  void collect() {
    constexpr index_t part = 1 << 14;
    const auto is_wanted = [&](index_t i) {
      return is_searchable(points_.data() + i * points_.stride(), dimension(), tree_.largest);
    };
    std::vector<index_t> first(static_cast<std::size_t>((points_.size() + part - 1) / part) + 1);
    const execution how{how_.threads, {{}, how_.monitor.stop}};
    parallel_blocks(points_.size(), part, how, [&](index_t b, index_t begin, index_t end) {
      index_t count = 0;
      for (index_t i = begin; i < end; ++i) count += is_wanted(i);
      first[static_cast<std::size_t>(b) + 1] = count;
    });
    std::partial_sum(first.begin(), first.end(), first.begin());
    tree_.searchable = first.back();
    records_.resize(tree_.searchable);
    spare_.resize(records_.size() + 1);
    parallel_blocks(points_.size(), part, how, [&](index_t b, index_t begin, index_t end) {
      record* next = records_.data() + first[b];
      for (index_t i = begin; i < end; ++i)
        if (is_wanted(i)) *next++ = record::of(points_.data() + i * points_.stride(), i);
    });
  }

  /// Calls `f(part, begin, end)` for the parts of some records that several threads take.
  template <class F>
  void in_parts(const record* begin, const record* end, F f) {
    parallel_blocks(end - begin, part_together, {how_.threads, {{}, how_.monitor.stop}}, f);
  }
  [[nodiscard]] static index_t parts_of(const record* begin, const record* end) {
    return (end - begin + part_together - 1) / part_together;
  }

  [[nodiscard]] extent extent_together(const record* begin, const record* end) {
    std::vector<extent> parts(static_cast<std::size_t>(parts_of(begin, end)));
    in_parts(begin, end, [&](index_t part, index_t from, index_t to) {
      parts[static_cast<std::size_t>(part)] = extent_of(begin + from, begin + to);
    });
    extent box = parts[0];
    for (const extent& part : parts) {
      box.low = box.low.cwiseMin(part.low);
      box.high = box.high.cwiseMax(part.high);
    }
    return box;
  }

  [[nodiscard]] extent extent_of(const record* begin, const record* end) const {
    if constexpr (D == dynamic) {
      extent box{Eigen::Map<const point_vector<S, D>>{begin->point, dimension()}, {}};
      box.high = box.low;
      for (const record* r = begin + 1; r < end; ++r) {
        const Eigen::Map<const point_vector<S, D>> point{r->point, dimension()};
        box.low = box.low.cwiseMin(point);
        box.high = box.high.cwiseMax(point);
      }
      return box;
    } else {
      four<S> low = begin->places, high = low;
      for (const record* r = begin + 1; r < end; ++r) {
        low = r->places < low ? r->places : low;
        high = r->places > high ? r->places : high;
      }
      extent box;
      for (int d = 0; d < D; ++d) {
        box.low[d] = low[d];
        box.high[d] = high[d];
      }
      return box;
    }
  }

  void split_all(int level, index_t k) {
    split(level, k);
    if (level == tree_.levels) return;
    split_all(level + 1, 2 * k);
    split_all(level + 1, 2 * k + 1);
  }

  /// Measures a node, tells its parent, and sorts its points into two halves.
  void split(int level, index_t k) {
    const index_t begin = tree_.begin(level, k), end = tree_.begin(level, k + 1);
    const extent box = together_ ? extent_together(first_of(begin), first_of(end))
                                 : extent_of(first_of(begin), first_of(end));
    if (level == 0) {
      tree_.low = box.low;
      tree_.high = box.high;
    } else {
      auto& cut = cut_at(level - 1, k / 2);
      (k % 2 == 0 ? cut.low : cut.high) = (k % 2 == 0 ? box.high : box.low)[cut.axis];
      if constexpr (nodes_type::has_boxes) set_box(parent_slot((index_t{1} << level) + k), 8, box);
    }
    index_t axis = 0;
    (box.high - box.low).maxCoeff(&axis);
    if (level < tree_.levels) {
      cut_at(level, k).axis = static_cast<std::int32_t>(axis);
      select(first_of(begin), first_of(tree_.begin(level + 1, 2 * k + 1)), first_of(end), axis);
    } else if (end - begin == 2) {
      select(first_of(begin), first_of(begin + 1), first_of(end), axis);
    }
  }

  /// Moves records so that none before `nth` is larger than one from there on. Where values are
  /// equal, those that come first stay first.
  void select(record* begin, record* nth, record* end, index_t axis) {
    constexpr index_t few = 32;
    constexpr int most_rounds = 20;
    S values[few + 8];
    for (int round = 0; end - begin > few; ++round) {
      if (nth == begin) return;
      if (round == most_rounds) {
        std::nth_element(begin, nth, end, [&](const record& a, const record& b) {
          return a.value(axis) < b.value(axis);
        });
        return;
      }
      // A sample's value a little beyond the one that is wanted, on the side where less remains.
      // Source: Floyd & Rivest 1975, "Expected time bounds for selection".
      const index_t n = end - begin, samples = n > 1000 ? few : few / 2;
      for (index_t i = 0; i < samples; ++i)
        values[i] = begin[(2 * i + 1) * n / (2 * samples)].value(axis);
      const double share = double(nth - begin) / double(n);
      const double beyond = 0.8 * std::sqrt(double(samples) * share * (1 - share));
      const double wanted = share * double(samples) + (share < 0.5 ? beyond : -beyond);
      const S pivot =
          nth_value(values, samples, std::clamp<index_t>(index_t(wanted), 0, samples - 1));
      record* const second = partition(begin, end, axis, [&](S v) { return v < pivot; });
      if (nth < second) {
        end = second;
      } else if (second - begin > n / 16) {
        begin = second;
      } else {
        // Perhaps most are equal to the pivot.
        begin = partition(second, end, axis, [&](S v) { return v <= pivot; });
        if (nth < begin) return;
      }
    }
    if (nth == begin) return;
    const index_t n = end - begin, rank = nth - begin;
    for (index_t i = 0; i < n; ++i) values[i] = begin[i].value(axis);
    const S pivot = nth_value(values, n, rank);
    index_t equal_ones = rank;
    for (index_t i = 0; i < n; ++i) equal_ones -= values[i] < pivot;
    partition(begin, end, axis, [&](S v) {
      const bool is_equal = v == pivot, comes_first = (v < pivot) | (is_equal & (equal_ones > 0));
      equal_ones -= is_equal;
      return comes_first;
    });
  }

  /// Keeps the order of both parts; returns where the second begins. Without a branch: each record
  /// is written to both, and only one of them goes on.
  template <class F>
  record* partition(record* begin, record* end, index_t axis, F is_first) {
    if constexpr (std::is_invocable_v<const F&, S>)
      if (together_ && end - begin >= least_together)
        return partition_together(begin, end, axis, is_first);
    record* first = begin;
    record* const kept = spare_.data() + (begin - records_.data());
    record* second = kept;
    for (const record* r = begin; r != end; ++r) {
      const record copy = *r;
      const bool goes_first = is_first(r->value(axis));
      *first = copy;
      *second = copy;
      first += goes_first;
      second += !goes_first;
    }
    std::copy(kept, second, first);
    return first;
  }

  /// The same by several threads: parts are counted, sorted to where they belong, and copied back.
  template <class F>
  record* partition_together(record* begin, record* end, index_t axis, const F& is_first) {
    const index_t count = parts_of(begin, end);
    std::vector<index_t> firsts(static_cast<std::size_t>(count) + 1);
    in_parts(begin, end, [&](index_t part, index_t from, index_t to) {
      index_t found = 0;
      for (index_t i = from; i < to; ++i) found += is_first(begin[i].value(axis));
      firsts[static_cast<std::size_t>(part) + 1] = found;
    });
    std::partial_sum(firsts.begin(), firsts.end(), firsts.begin());
    record* const sorted = spare_.data() + (begin - records_.data());
    in_parts(begin, end, [&](index_t part, index_t from, index_t to) {
      const index_t before = firsts[static_cast<std::size_t>(part)];
      record* first = sorted + before;
      record* second = sorted + firsts.back() + (from - before);
      for (index_t i = from; i < to; ++i) {
        const bool goes_first = is_first(begin[i].value(axis));
        *(goes_first ? first : second) = begin[i];
        first += goes_first;
        second += !goes_first;
      }
    });
    in_parts(begin, end, [&](index_t, index_t from, index_t to) {
      std::copy(sorted + from, sorted + to, begin + from);
    });
    return begin + firsts.back();
  }

  void fill(index_t b) {
    const record* const records = first_of(b);
    const index_t count = first_of(b + 1) - records;
    S* to = tree_.coordinates.data() + b * points_per_block * dimension();
    for (index_t d = 0; d < dimension(); ++d, to += points_per_block) {
      for (index_t i = 0; i < count; ++i) to[i] = records[i].value(d);
      std::fill(to + count, to + points_per_block, std::numeric_limits<S>::quiet_NaN());
    }
    std::int32_t* const indices = tree_.indices.data() + b * points_per_block;
    for (index_t i = 0; i < count; ++i) indices[i] = records[i].index();
    std::fill(indices + count, indices + points_per_block, -1);
    if constexpr (nodes_type::has_boxes) {
      S* const box = tree_.boxes.data() + 8 * b;
      set_box(box, 4, extent_of(records, records + count));
      set_smallest_index(box, *std::min_element(indices, indices + count));
    }
  }

  [[nodiscard]] auto& cut_at(int level, index_t k) {
    return tree_.cuts[(std::size_t{1} << level) - 1 + static_cast<std::size_t>(k)];
  }

  /// Where a node's box is, beside its sibling's.
  [[nodiscard]] S* parent_slot(index_t node) {
    return tree_.children.data() + 16 * (node / 2) + 4 * (node % 2);
  }
  /// The upper corner is `apart` numbers behind the lower one.
  static void set_box(S* to, index_t apart, const extent& box) {
    std::fill_n(to, 4, S(0));
    std::fill_n(to + apart, 4, S(0));
    for (int d = 0; d < D; ++d) {
      to[d] = box.low[d];
      to[apart + d] = box.high[d];
    }
  }
  static void set_smallest_index(S* box, std::int32_t index) {
    std::memcpy(box + 3, &index, sizeof index);
  }
  static std::int32_t smallest_index_in(const S* box) {
    std::int32_t index;
    std::memcpy(&index, box + 3, sizeof index);
    return index;
  }
  [[nodiscard]] std::int32_t smallest_index_of(index_t node) {
    std::int32_t smallest = std::numeric_limits<std::int32_t>::max();
    const index_t leaf = node - (index_t{1} << tree_.levels);
    if (leaf < 0)
      return std::min(smallest_index_in(parent_slot(2 * node)),
                      smallest_index_in(parent_slot(2 * node + 1)));
    for (index_t b = tree_.begin(tree_.levels, leaf); b < tree_.begin(tree_.levels, leaf + 1); ++b)
      smallest = std::min(smallest, smallest_index_in(tree_.boxes.data() + 8 * b));
    return smallest;
  }

  // Smaller nodes are left to one thread each.
  static constexpr index_t least_together = 1 << 16, part_together = 1 << 13;

  nodes_type& tree_;
  points_view<S, D> points_;
  execution how_;
  bool together_ = false;  // Whether all threads work on one node.
  buffer<record> records_, spare_;
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
  expect_from(1, options.max_leaf_size, "kd_tree: max_leaf_size");
  tree_builder<S, D>{*this, points, options}.build();
}

#define CILANTRO_INSTANTIATE(S, D) template struct kd_tree_nodes<S, D>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
