// SPDX-License-Identifier: MIT
module;
#include "search/kernels/products.hpp"
module cilantro.search;

import cilantro.eigen;

namespace cilantro {
namespace {

using detail::points_per_panel;
using detail::queries_per_tile;

/// Panels that are compared between one look at the candidates and the next.
constexpr index_t panels_at_a_time = 8;

template <Scalar S>
detail::product_tiles<S>* kernel() {
  return detail::for_target(static_cast<int>(current_vector_target()), []<detail::kernel_target V> {
    return detail::product_tiles_in<V, S>();
  });
}

/// All points by panels. A point that is never found has an infinite length.
template <Scalar S>
class packed_points {
 public:
  packed_points(points_view<S, dynamic> points, S largest)
      : count_{(points.size() + points_per_panel - 1) / points_per_panel},
        dimension_{points.dimension()},
        coordinates_(static_cast<std::size_t>(count_ * dimension_ * points_per_panel)),
        squares_(static_cast<std::size_t>(count_ * points_per_panel),
                 std::numeric_limits<S>::infinity()) {
    for (index_t i = 0; i < points.size(); ++i) {
      const S* point = points.data() + i * points.stride();
      if (!is_searchable(point, dimension_, largest)) continue;
      const index_t panel = i / points_per_panel, lane = i % points_per_panel;
      S square = 0;
      for (index_t d = 0; d < dimension_; ++d) {
        coordinates_[(panel * dimension_ + d) * points_per_panel + lane] = point[d];
        square += point[d] * point[d];
      }
      squares_[i] = square;
      largest_square_ = std::max(largest_square_, square);
    }
  }

  [[nodiscard]] index_t count() const { return count_; }
  [[nodiscard]] S largest_square() const { return largest_square_; }
  [[nodiscard]] detail::point_panels<S> view() const {
    return {coordinates_.data(), squares_.data(), dimension_};
  }

 private:
  index_t count_, dimension_;
  std::vector<S> coordinates_, squares_;
  S largest_square_ = 0;
};

/// The points that may be among the neighbours of a query, by values that are off by less than
/// `doubt`.
template <Scalar S>
struct candidate_list {
  using candidate = std::pair<S, std::int32_t>;

  // What is never found is infinitely long, and not below this.
  S limit = std::numeric_limits<S>::max(), doubt = 0;
  std::vector<candidate> all;

  /// Drops what is certainly not among the `count` smallest; at least one.
  void prune(index_t count) {
    if (std::ssize(all) <= count) return;
    const auto last = all.begin() + count - 1;
    if (count == 1)
      std::iter_swap(last, std::ranges::min_element(all));
    else
      std::ranges::nth_element(all, last);
    limit = std::min(limit, last->first + 2 * doubt);
    std::erase_if(all, [&](const candidate& c) { return c.first > limit; });
  }
};

template <Scalar S>
class product_search {
 public:
  product_search(points_view<S, dynamic> points, const neighborhood_spec& spec)
      : points_{points},
        most_{std::min(spec.max_count(), points.size())},
        limit_{largest_sum_within(euclidean{}, static_cast<S>(spec.max_distance()))},
        largest_{largest_searchable_coordinate<S>(points.dimension())},
        panels_{points, largest_} {}

  /// The neighbours of some queries, at most `queries_per_tile`, each a row of coordinates.
  void find(std::span<const S* const> queries,
            std::array<std::vector<neighbor<S>>, queries_per_tile>& out) const {
    std::array<const S*, queries_per_tile> rows;
    std::array<S, queries_per_tile> limits;
    std::array<candidate_list<S>, queries_per_tile> lists;
    for (std::size_t q = 0; q < rows.size(); ++q) {
      rows[q] = queries[std::min(q, queries.size() - 1)];
      start(lists[q], rows[q]);
      if (q >= queries.size()) lists[q].limit = -std::numeric_limits<S>::infinity();
    }
    std::array<S, panels_at_a_time * queries_per_tile * points_per_panel> values;
    std::array<std::uint32_t, panels_at_a_time * queries_per_tile> masks;
    // Few at first, so that limits are soon low.
    index_t some = 1;
    for (index_t begin = 0, end = 0; begin < panels_.count(); begin = end) {
      end = std::min(panels_.count(), begin + some);
      some = std::min(2 * some, panels_at_a_time);
      for (std::size_t q = 0; q < rows.size(); ++q) limits[q] = lists[q].limit;
      kernel<S>()(panels_.view(), begin, end, rows.data(), limits.data(), values.data(),
                  masks.data());
      for (index_t tile = 0; tile < (end - begin) * queries_per_tile; ++tile) {
        auto& list = lists[tile % queries_per_tile];
        const index_t first = (begin + tile / queries_per_tile) * points_per_panel;
        for (std::uint32_t rest = masks[tile]; rest != 0; rest &= rest - 1) {
          const int lane = std::countr_zero(rest);
          list.all.push_back(
              {values[tile * points_per_panel + lane], static_cast<std::int32_t>(first + lane)});
        }
      }
      for (auto& list : lists) list.prune(most_);
    }
    for (std::size_t q = 0; q < queries.size(); ++q) compare(queries[q], lists[q], out[q]);
  }

  [[nodiscard]] bool can_answer(const S* query) const {
    return is_searchable(query, points_.dimension(), largest_);
  }

 private:
  void start(candidate_list<S>& list, const S* query) const {
    const index_t d = points_.dimension();
    S square = 0;
    for (index_t i = 0; i < d; ++i) square += query[i] * query[i];
    // The rounding of both ways to compute a sum of d squares.
    list.doubt =
        S(4) * S(d + 4) * std::numeric_limits<S>::epsilon() * (square + panels_.largest_square());
    if (std::isfinite(limit_)) list.limit = limit_ - square + 2 * list.doubt;
  }

  /// Compares the candidates as `brute_force_searcher` does.
  void compare(const S* query, const candidate_list<S>& list, std::vector<neighbor<S>>& out) const {
    const euclidean metric;
    const ordering<S, dynamic, euclidean> by{metric};
    out.clear();
    for (const auto& [value, i] : list.all) {
      const S sum = by.between(query, points_.data() + i * points_.stride(), points_.dimension());
      if (sum <= limit_) out.push_back({i, sum});
    }
    std::ranges::sort(out, {}, [](const neighbor<S>& n) { return std::pair{n.distance, n.index}; });
    out.resize(static_cast<std::size_t>(std::min(most_, std::ssize(out))));
    for (auto& n : out) n.distance = by.distance(n.distance);
  }

  points_view<S, dynamic> points_;
  index_t most_;
  S limit_, largest_;
  packed_points<S> panels_;
};

}  // namespace

template <Scalar S>
void visit_by_products(points_view<S, dynamic> points, points_view<S, dynamic> queries,
                       const neighborhood_spec& spec, const neighborhood_visitor<S>& visit,
                       const visit_options& options) {
  const product_search<S> search{points, spec};
  const execution how{options.threads, options.monitor};
  constexpr index_t at_a_time = 64;
  parallel_blocks(queries.size(), at_a_time, how, [&](index_t, index_t begin, index_t end) {
    found_block<S> block;
    std::vector<const S*> rows;
    std::vector<index_t> names;
    std::array<std::vector<neighbor<S>>, queries_per_tile> found;
    const auto answer = [&] {
      if (rows.empty()) return;
      search.find(rows, found);
      for (std::size_t q = 0; q < rows.size(); ++q) block.add(names[q], found[q]);
      rows.clear();
      names.clear();
    };
    for (index_t q = begin; q < end; ++q) {
      const S* query = queries.data() + q * queries.stride();
      if (!options.wanted.empty() && !options.wanted[q]) continue;
      if (!search.can_answer(query)) continue;
      rows.push_back(query);
      names.push_back(q);
      if (std::ssize(rows) == queries_per_tile) answer();
      if (block.indices.size() <= most_kept) continue;
      visit(block.view());
      block = found_block<S>{};
    }
    answer();
    visit(block.view());
  });
}

template void visit_by_products(points_view<float, dynamic>, points_view<float, dynamic>,
                                const neighborhood_spec&, const neighborhood_visitor<float>&,
                                const visit_options&);
template void visit_by_products(points_view<double, dynamic>, points_view<double, dynamic>,
                                const neighborhood_spec&, const neighborhood_visitor<double>&,
                                const visit_options&);

}  // namespace cilantro
