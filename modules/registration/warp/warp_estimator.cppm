// SPDX-License-Identifier: MIT
export module cilantro.registration:warp_estimator;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :concepts;
import :correspondence;
import :deformation_graph;
import :estimation;
import :motion;
import :residual;
import :unit_normals;
import :warp_engine;
import :warp_equations;
import :warp_field;

namespace cilantro {

/// Pairs by source point.
template <Scalar S>
struct pairs_by_source {
  std::span<const correspondence<S>> pairs;
  std::vector<std::int32_t> first;  ///< For each source point, and one more.

  pairs_by_source(std::span<const correspondence<S>> all, index_t sources)
      : pairs{all}, first(static_cast<std::size_t>(sources) + 1, 0) {
    for (const auto& pair : all) ++first[pair.source + 1];
    for (index_t i = 0; i < sources; ++i) first[i + 1] += first[i];
  }
};

/// The weight of a term for a pair, of all its factors and kernels.
template <int D, class Term, class Pairs, class Kernel>
[[nodiscard]] double weight_of_term(const Term& term, double weight, const Pairs& by,
                                    const Kernel& robust, const robust_kernel& more,
                                    const matched_pair<D>& pair, double distance) {
  weight *= double(evaluate_pair<double>(by, pair.source_index, pair.target_index, distance));
  if (!std::same_as<Kernel, unit_weight> || more) {
    double square = 0;
    term(pair, [&](double value, const auto&...) { square += value * value; });
    if (!std::isfinite(square)) return 0;
    const double length = std::sqrt(square);
    weight *= double(evaluate_pair<double>(robust, pair.source_index, pair.target_index, length)) *
              more(length);
  }
  expect_weight(weight);
  return weight;
}

/// Improves a field by one Gauss–Newton step, for any metric and any motion of the nodes, with the
/// motions of linked nodes kept alike. The unknowns of a node are about the node, so that the
/// result does not depend on where the origin is.
///
/// Minimises Σ w r² / N + stiffness · Σ ω ‖e‖² / L. The first sum is over the residuals r of the
/// metric and N source points; the second over L links, both ways, where e = R (g′ − g) + g + t −
/// g′ − t′ is the disagreement of nodes g and g′ about where g′ is. A step that does not make this
/// smaller, with the weights w and ω as they are, is damped until it does, or not taken. Sums and
/// solution are in double; the same bits for any number of threads. `fit.undetermined` counts the
/// unknowns of the nodes that no pair reaches, which follow the nodes that they are linked to, or
/// stay. Views source and target, which must outlive it.
/// Source: Sumner, Schmid & Pauly 2007, "Embedded deformation for shape manipulation".
export template <Scalar S, int D, class Metric = point_to_plane, MotionModel Motion = rigid_motion>
  requires RegistrationMetric<Metric, closed_dimension<D>>
class warp_estimator {
 public:
  using transform_type = warp_field<S, D, Motion>;

  /// Throws `invalid_input` if the graph is not of the source, if the metric needs normals that a
  /// surface does not have, or that are not of unit length, for surfaces of different dimension or
  /// origin, and for options that make no sense.
  template <BorrowedPoints P, BorrowedPoints T>
  warp_estimator(P&& source, T&& target, deformation_graph<S, D> graph, Metric metric = {},
                 const warp_options& options = {}, Motion motion = {})
      : graph_{std::move(graph)},
        surfaces_{oriented<S, C>(target), oriented<S, C>(source)},
        metric_{std::move(metric)} {
    expect_same_origin(source, target, "warp_estimator");
    const auto& s = surfaces_.source;
    const auto& t = surfaces_.target;
    expects(graph_.is_of(points_in(source)),
            "warp_estimator: the graph is of other points than the source");
    expects(!needs_target_normals<Metric> || t.has_normals() || t.points.empty(),
            "warp_estimator: the metric needs normals of the target; estimate them first");
    expects(!needs_source_normals<Metric> || s.has_normals() || s.points.empty(),
            "warp_estimator: the metric needs normals of the source; estimate them first");
    if constexpr (needs_target_normals<Metric>) expect_unit_length(t.normals, "target");
    if constexpr (needs_source_normals<Metric>) expect_unit_length(s.normals, "source");
    with_terms(metric_, [&](const auto&, double weight, const auto& by, const auto&) {
      expect_between(0, weight, std::numeric_limits<double>::max(),
                     "warp_estimator: the weight of a term");
      expect_sizes(by, s.points.size(), t.points.size(), "warp_estimator");
    });
    engine_ = std::make_shared<const engine>(graph_.shared_data(), std::move(motion), options);
  }

  /// The field that moves nothing.
  [[nodiscard]] transform_type identity() const { return transform_type{graph_}; }

  /// As `TransformEstimator` says. Throws `invalid_input` for a field of another graph. O(pairs ·
  /// (anchors · unknowns)² + factor), where the factor of a graph of a surface with N nodes takes
  /// about N^1.5 · unknowns³.
  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, std::span<const correspondence<S>> pairs) const {
    return estimate_all(current, std::array{pairs});
  }
  /// As above, with separate pairs for each term of a combined metric.
  template <std::size_t N>
    requires(is_combined<Metric>)
  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, const std::array<correspondences<S>, N>& pairs) const {
    static_assert(N == Metric::size, "there must be one searcher for each term of the metric");
    std::array<std::span<const correspondence<S>>, N> all;
    for (std::size_t i = 0; i < N; ++i) all[i] = pairs[i];
    return estimate_all(current, all);
  }

 private:
  static constexpr int C = closed_dimension<D>;
  using engine = warp_engine<S, C, Motion>;
  using vector = point_vector<double, C>;

  static constexpr std::size_t terms() {
    if constexpr (is_combined<Metric>)
      return Metric::size;
    else
      return 1;
  }

  /// Calls `f(term number, term, weight, pair weight, kernel)` for the terms of list `l` of pairs.
  template <std::size_t Lists, class F>
  void for_terms(std::size_t l, F&& f) const {
    std::size_t number = 0;
    with_terms(metric_, [&](const auto& term, double weight, const auto& by, const auto& robust) {
      if (Lists == 1 || number == l) f(number, term, weight, by, robust);
      ++number;
    });
  }

  [[nodiscard]] matched_pair<C> pair_of(const anchor_frames<C>& frames, const vector& place,
                                        std::int32_t s, index_t t) const {
    return pair_at<needs_source_normals<Metric>, needs_target_normals<Metric>>(
        place, surfaces_.target, s, t, [&] {
          const double* const weights = engine_->weights_of(s);
          typename engine::matrix linear = weights[0] * frames.linear[0];
          for (std::size_t k = 1; k < frames.count; ++k) linear += weights[k] * frames.linear[k];
          const vector n = surfaces_.source.normals[s].template cast<double>();
          if constexpr (RigidMap<typename transform_type::transform_type>)
            return vector{linear * n};
          else
            return vector{checked_inverse(linear, "warp_estimator: the field flattens its points")
                              .transpose() *
                          n};
        });
  }

  template <std::size_t Lists>
  [[nodiscard]] registration_step<transform_type> estimate_all(
      const transform_type& current,
      const std::array<std::span<const correspondence<S>>, Lists>& all) const {
    expects(current.graph() == graph_,
            "warp_estimator: the field is of another graph; resample it first");
    registration_step<transform_type> result{current, {}, {}};
    auto& fit = result.fit;
    fit.non_finite = surfaces_.non_finite;
    fit.unknowns = Motion::unknowns(surfaces_.dimension) * graph_.nodes().size();
    const index_t sources = surfaces_.source.points.size();
    if (graph_.nodes().empty()) return result;
    std::vector<pairs_by_source<S>> by_source;
    for (const auto& pairs : all) {
      expect_pairs_of(surfaces_, pairs);
      by_source.emplace_back(pairs, sources);
    }
    index_t paired = 0;
    for (index_t s = 0; s < sources; ++s)
      paired += std::ranges::any_of(
          by_source, [&](const auto& pairs) { return pairs.first[s] != pairs.first[s + 1]; });
    fit.overlap = surfaces_.overlap(paired);

    // The weights of each pair in each term, as the rows have them.
    std::array<std::vector<double>, Lists> weights;
    for (std::size_t l = 0; l < Lists; ++l)
      weights[l].assign(by_source[l].pairs.size() * terms(), 0);
    buffer<double> places(static_cast<std::size_t>(sources * surfaces_.dimension));

    const auto write = [&](index_t list, row_buffer& rows) {
      const auto frames = engine_->frames_of(current.motions(), list);
      for (const std::int32_t s : engine_->points_of(list))
        write_point<Lists>(frames, s, by_source, weights, places.data(), rows);
    };
    const auto judge = [&](const node_motions<C>& motions) {
      return judge_points<Lists>(motions, by_source, weights, places.data());
    };
    auto step = engine_->improve(current.motions(), write, judge);
    const auto& totals = step.sums.totals;
    const auto share = [](double part, double whole) { return whole > 0 ? part / whole : 0.0; };
    fit.pairs = totals.pairs;
    fit.rmse = std::sqrt(share(totals.squared_distance, double(totals.pairs)));
    fit.residual = std::sqrt(share(totals.squared_residual, totals.weight));
    fit.undetermined = step.unsupported_nodes * Motion::unknowns(surfaces_.dimension);
    result.change = step.change;
    result.transform.motions() = std::move(step.motions);
    return result;
  }

  template <std::size_t Lists>
  void write_point(const anchor_frames<C>& frames, std::int32_t s,
                   const std::vector<pairs_by_source<S>>& by_source,
                   std::array<std::vector<double>, Lists>& weights, double* places,
                   row_buffer& rows) const {
    bool is_moved = false;
    anchored_place<C> moved;
    for (std::size_t l = 0; l < Lists; ++l)
      for (index_t i = by_source[l].first[s]; i < by_source[l].first[s + 1]; ++i) {
        if (!is_moved) {
          engine_->move(frames, s, moved);
          std::copy_n(moved.place.data(), moved.place.size(), places + s * moved.place.size());
          is_moved = true;
        }
        const auto& [source, t, distance] = by_source[l].pairs[i];
        const auto pair = pair_of(frames, moved.place, s, t);
        const double square = (pair.point - pair.target).squaredNorm();
        if (!std::isfinite(square)) continue;
        ++rows.totals.pairs;
        rows.totals.squared_distance += square;
        for_terms<Lists>(l, [&](std::size_t number, const auto& term, double factor, const auto& by,
                                const auto& robust) {
          const double weight = weight_of_term(term, factor, by, robust, engine_->options().robust,
                                               pair, double(distance));
          if (weight == 0) return;
          weights[l][i * terms() + number] = weight;
          const double scale = std::sqrt(weight);
          bool has_rows = false;
          const auto add = [&](double value, const vector& gradient, const vector* beside) {
            if (!std::isfinite(value)) return;
            engine_->write_row(moved, s, frames.count, gradient, beside, scale,
                               rows.add(scale * value));
            rows.totals.squared_residual += weight * value * value;
            has_rows = true;
          };
          term(pair, [&](double value, const vector& gradient, const auto&... at) {
            if constexpr (sizeof...(at) == 0) {
              add(value, gradient, nullptr);
            } else {
              const vector beside = (at - ... - moved.place);
              add(value, gradient, &beside);
            }
          });
          if (has_rows) rows.totals.weight += weight;
        });
      }
  }

  template <std::size_t Lists>
  [[nodiscard]] typename engine::outcome judge_points(
      const node_motions<C>& motions, const std::vector<pairs_by_source<S>>& by_source,
      const std::array<std::vector<double>, Lists>& weights, const double* places) const {
    struct sum_type {
      double energy = 0, farthest = 0;
      sum_type& operator+=(const sum_type& other) {
        energy += other.energy;
        farthest = std::max(farthest, other.farthest);
        return *this;
      }
    };
    const index_t lists = std::ssize(engine_->graph().groups) - 1;
    const auto total = ordered_sum(
        lists, {.threads = engine_->options().threads}, sum_type{},
        [&](sum_type& sum, index_t list) {
          const auto frames = engine_->frames_of(motions, list);
          anchored_place<C> moved;
          const vector& place = moved.place;
          for (const std::int32_t s : engine_->points_of(list)) {
            bool is_moved = false;
            for (std::size_t l = 0; l < Lists; ++l)
              for (index_t i = by_source[l].first[s]; i < by_source[l].first[s + 1]; ++i) {
                if (!is_moved) {
                  engine_->move(frames, s, moved);
                  const Eigen::Map<const vector> before{places + s * place.size(), place.size()};
                  sum.farthest = std::max(sum.farthest, (place - before).squaredNorm());
                  is_moved = true;
                }
                const auto pair = pair_of(frames, place, s, by_source[l].pairs[i].target);
                for_terms<Lists>(l, [&](std::size_t number, const auto& term, const auto&...) {
                  const double weight = weights[l][i * terms() + number];
                  if (weight == 0) return;
                  term(pair,
                       [&](double value, const auto&...) { sum.energy += weight * value * value; });
                });
              }
          }
        });
    return {total.energy, std::sqrt(total.farthest)};
  }

  deformation_graph<S, D> graph_;
  registered_surfaces<S, C> surfaces_;
  Metric metric_;
  std::shared_ptr<const engine> engine_;
};
export template <PointsSource P, PointsSource T, Scalar S, int D, class Metric = point_to_plane,
                 class Motion = rigid_motion>
warp_estimator(P&&, T&&, deformation_graph<S, D>, Metric = {}, const warp_options& = {},
               Motion = {}) -> warp_estimator<S, D, Metric, Motion>;

}  // namespace cilantro
