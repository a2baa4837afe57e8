// SPDX-License-Identifier: MIT
export module cilantro.search:neighborhood;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A point near a query: its `index`, and its `distance` in the units of the metric, not squared.
export template <Scalar S>
struct neighbor {
  index_t index = 0;
  S distance = 0;
  friend bool operator==(const neighbor&, const neighbor&) = default;
};

/// An element of a neighbourhood in iteration: its `index` and `distance`. It is a temporary that
/// converts to `neighbor`, but a type of its own, so that projecting to a member of `neighbor`,
/// which would dangle, does not compile.
export template <Scalar S>
struct neighbor_entry {
  index_t index;
  S distance;

  operator neighbor<S>() const { return {index, distance}; }  // NOLINT: a conversion on purpose
  friend bool operator==(const neighbor_entry&, const neighbor_entry&) = default;
};

/// The `k` nearest points.
export struct knn {
  index_t k;
};

/// All points at most `distance` away, inclusive.
export struct radius {
  double distance;
};

/// The `k` nearest of the points at most `distance` away, inclusive.
export struct knn_in_radius {
  index_t k;
  double distance;
};

/// Which points around a query form its neighbourhood; `knn`, `radius` and `knn_in_radius` convert
/// to it. Throws `invalid_input` for a count below 1, or a negative or NaN distance.
export class neighborhood_spec {
 public:
  neighborhood_spec(knn spec)  // NOLINT: a conversion on purpose
      : neighborhood_spec{knn_in_radius{spec.k, std::numeric_limits<double>::infinity()}} {}
  neighborhood_spec(radius spec)  // NOLINT
      : neighborhood_spec{knn_in_radius{std::numeric_limits<index_t>::max(), spec.distance}} {}
  neighborhood_spec(knn_in_radius spec)  // NOLINT
      : max_count_{spec.k}, max_distance_{spec.distance} {
    if (max_count_ < 1)
      throw invalid_input{"knn: k must be at least 1, and is " + std::to_string(max_count_)};
    if (!(max_distance_ >= 0))
      throw invalid_input{"radius: the distance must be a number that is not negative, and is " +
                          in_digits(max_distance_)};
  }

  /// The most neighbours; the largest `index_t` for a plain radius.
  [[nodiscard]] index_t max_count() const { return max_count_; }
  /// The largest distance; infinite for plain k nearest neighbours.
  [[nodiscard]] double max_distance() const { return max_distance_; }
  /// Whether `max_count` limits the neighbourhood, as it does for all but a plain radius.
  [[nodiscard]] bool is_count_limited() const {
    return max_count_ != std::numeric_limits<index_t>::max();
  }

 private:
  index_t max_count_;
  double max_distance_;
};

/// The neighbours of one query, by ascending distance and then index: a random-access range of
/// `neighbor<S>` over two arrays that it does not own. To project, use `indices()` and
/// `distances()`.
export template <Scalar S>
class neighborhood : public std::ranges::view_interface<neighborhood<S>> {
 public:
  neighborhood() = default;
  neighborhood(std::span<const std::int32_t> indices, std::span<const S> distances)
      : indices_{indices}, distances_{distances} {}

  [[nodiscard]] std::size_t size() const { return indices_.size(); }
  /// Precondition: 0 <= i < size().
  [[nodiscard]] neighbor<S> operator[](index_t i) const {
    const auto at = static_cast<std::size_t>(i);
    return {indices_[at], distances_[at]};
  }
  [[nodiscard]] auto begin() const { return indexed_iterator{entries{indices_, distances_}, 0}; }
  [[nodiscard]] auto end() const { return begin() + std::ssize(indices_); }

  /// The indices of the neighbours.
  [[nodiscard]] std::span<const std::int32_t> indices() const { return indices_; }
  /// Their distances, in the same order.
  [[nodiscard]] std::span<const S> distances() const { return distances_; }

 private:
  struct entries {
    using value_type = neighbor<S>;
    std::span<const std::int32_t> indices;
    std::span<const S> distances;
    neighbor_entry<S> operator[](index_t i) const { return {indices[i], distances[i]}; }
  };

  std::span<const std::int32_t> indices_;
  std::span<const S> distances_;
};

/// The neighbourhoods of many queries in three arrays, without an allocation per query: a
/// random-access range with one `neighborhood` per query, in their order.
///
/// The neighbours of query q are the entries `offsets()[q]` to `offsets()[q + 1]` of `indices()`
/// and `distances()`: the rows of a sparse matrix in compressed form.
export template <Scalar S>
class neighborhoods {
 public:
  neighborhoods() : offsets_(1, 0) {}

  /// Throws `invalid_input` unless the offsets start at 0, do not decrease, and end at the size
  /// that both other arrays have.
  neighborhoods(std::vector<index_t> offsets, buffer<std::int32_t> indices, buffer<S> distances)
      : offsets_{std::move(offsets)},
        indices_{std::move(indices)},
        distances_{std::move(distances)} {
    expects(!offsets_.empty() && offsets_.front() == 0 && std::ranges::is_sorted(offsets_) &&
                offsets_.back() == std::ssize(indices_) && indices_.size() == distances_.size(),
            "neighborhoods: the offsets must rise from 0 to the number of neighbours");
  }

  [[nodiscard]] index_t size() const { return std::ssize(offsets_) - 1; }
  [[nodiscard]] bool empty() const { return size() == 0; }
  /// The neighbours of query `q`. Precondition: 0 <= q < size().
  [[nodiscard]] neighborhood<S> operator[](index_t q) const [[clang::lifetimebound]] {
    const auto begin = static_cast<std::size_t>(offsets_[q]);
    const auto end = static_cast<std::size_t>(offsets_[static_cast<std::size_t>(q) + 1]);
    return {std::span{indices_}.subspan(begin, end - begin),
            std::span{distances_}.subspan(begin, end - begin)};
  }
  [[nodiscard]] auto begin() const [[clang::lifetimebound]] {
    return indexed_iterator{indexed_rows{this}, 0};
  }
  [[nodiscard]] auto end() const [[clang::lifetimebound]] { return begin() + size(); }

  /// The number of neighbours of all queries together.
  [[nodiscard]] index_t total() const { return offsets_.back(); }
  [[nodiscard]] std::span<const index_t> offsets() const [[clang::lifetimebound]] {
    return offsets_;
  }
  [[nodiscard]] std::span<const std::int32_t> indices() const [[clang::lifetimebound]] {
    return indices_;
  }
  [[nodiscard]] std::span<const S> distances() const [[clang::lifetimebound]] { return distances_; }

 private:
  std::vector<index_t> offsets_;
  buffer<std::int32_t> indices_;
  buffer<S> distances_;
};

/// Some queries and their neighbours, as a search passes them to a visitor; valid only during that
/// call.
export template <Scalar S>
class neighborhood_block {
 public:
  /// Entry i of the block is the user's query number `queries[i]`; its `counts[i]` neighbours start
  /// at position `starts[i]` of `indices` and `distances`. Precondition: the arrays are that long.
  neighborhood_block(std::span<const std::int32_t> queries, std::span<const index_t> starts,
                     std::span<const std::int32_t> counts, std::span<const std::int32_t> indices,
                     std::span<const S> distances)
      : queries_{queries},
        counts_{counts},
        indices_{indices},
        starts_{starts},
        distances_{distances} {}

  [[nodiscard]] index_t size() const { return std::ssize(queries_); }
  /// The block is a range of neighbourhoods, one per query.
  [[nodiscard]] auto begin() const { return indexed_iterator{indexed_rows{this}, 0}; }
  [[nodiscard]] auto end() const { return begin() + size(); }
  /// The number of the i-th query of the block. Precondition: 0 <= i < size().
  [[nodiscard]] index_t query(index_t i) const { return queries_[i]; }
  /// The neighbours of the i-th query of the block. Precondition: 0 <= i < size().
  [[nodiscard]] neighborhood<S> operator[](index_t i) const {
    const auto start = static_cast<std::size_t>(starts_[i]);
    const auto count = static_cast<std::size_t>(counts_[i]);
    return {indices_.subspan(start, count), distances_.subspan(start, count)};
  }

 private:
  std::span<const std::int32_t> queries_, counts_, indices_;
  std::span<const index_t> starts_;
  std::span<const S> distances_;
};

/// A function that is called with blocks of neighbourhoods, from several threads at once.
export template <Scalar S>
using neighborhood_visitor = std::function<void(const neighborhood_block<S>&)>;

}  // namespace cilantro

template <cilantro::Scalar S>
inline constexpr bool std::ranges::enable_borrowed_range<cilantro::neighborhood<S>> = true;
