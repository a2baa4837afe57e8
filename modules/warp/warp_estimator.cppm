// SPDX-License-Identifier: MIT
export module cilantro.warp:warp_estimator;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.registration;
import :deformation_graph;
import :warp_engine;
import :warp_equations;
import :warp_field;

namespace cilantro {

/// Pairs by source point: those of point s are from `first[s]` to `first[s + 1]`.
template <Scalar S>
struct pairs_by_source {
  std::span<const correspondence<S>> pairs;
  std::span<const std::int32_t> first;
};
template <Scalar S>
[[nodiscard]] pairs_by_source<S> index_by_source(std::span<const correspondence<S>> pairs,
                                                 index_t sources,
                                                 std::vector<std::int32_t>& first) {
  first.assign(static_cast<std::size_t>(sources) + 1, 0);
  for (const auto& pair : pairs) ++first[pair.source + 1];
  for (index_t i = 0; i < sources; ++i) first[i + 1] += first[i];
  return {pairs, first};
}

/// The weight of a term for a pair, of all its factors and kernels.
template <int D, class Term, class Pairs, class Kernel>
[[nodiscard]] double weight_of_term(const Term& term, double weight, const Pairs& by,
                                    const Kernel& robust, const robust_kernel& more,
                                    const matched_pair<D>& pair, double distance) {
  weight *= double(evaluate_pair<double>(by, pair.source_index, pair.target_index, distance));
  if (weight != 0 && (!std::same_as<Kernel, unit_weight> || more)) {
    const double length = detail::residual_length(term, pair);
    if (!std::isfinite(length)) return 0;
    weight *= double(evaluate_pair<double>(robust, pair.source_index, pair.target_index, length)) *
              more(length);
  }
  detail::expect_weight(weight);
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
  using memory = warp_memory;

  /// Throws `invalid_input` if the graph is not of the source, if the metric needs normals that a
  /// surface does not have, or that are not of unit length, for surfaces of different dimension or
  /// origin, and for options that make no sense.
  template <BorrowedPoints P, BorrowedPoints T>
  warp_estimator(P&& source, T&& target, deformation_graph<S, D> graph, Metric metric = {},
                 const warp_options& options = {}, Motion motion = {})
      : graph_{std::move(graph)},
        surfaces_{detail::oriented<S, C>(target), detail::oriented<S, C>(source)},
        metric_{std::move(metric)} {
    expect_same_origin(source, target, "warp_estimator");
    const auto& s = surfaces_.source;
    const auto& t = surfaces_.target;
    expects(graph_.is_of(points_in(source)),
            "warp_estimator: the graph is of other points than the source");
    expects(!detail::needs_target_normals<Metric> || t.has_normals() || t.points.empty(),
            "warp_estimator: the metric needs normals of the target; estimate them first");
    expects(!detail::needs_source_normals<Metric> || s.has_normals() || s.points.empty(),
            "warp_estimator: the metric needs normals of the source; estimate them first");
    if constexpr (detail::needs_target_normals<Metric>)
      detail::expect_unit_normals(t.normals, "target");
    if constexpr (detail::needs_source_normals<Metric>)
      detail::expect_unit_normals(s.normals, "source");
    expect_weights();
    engine_ = std::make_shared<const engine>(graph_.shared_data(), std::move(motion), options);
  }

  /// The same with another metric and other options, as where stiffness falls from step to step:
  /// what depends on the graph alone is shared. Throws `invalid_input` for options that make no
  /// sense.
  [[nodiscard]] warp_estimator with(Metric metric, const warp_options& options) const {
    warp_estimator other = *this;
    other.metric_ = std::move(metric);
    other.expect_weights();
    other.engine_ = std::make_shared<const engine>(*engine_, options);
    return other;
  }

  /// The field that moves nothing.
  [[nodiscard]] transform_type identity() const { return transform_type{graph_}; }

  /// As `TransformEstimator` says. Throws `invalid_input` for a field of another graph. O(pairs ·
  /// (anchors · unknowns)² + factor), where the factor of a graph of a surface with N nodes takes
  /// about N^1.5 · unknowns³.
  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, std::span<const correspondence<S>> pairs) const {
    memory fresh;
    return estimate(current, pairs, fresh);
  }
  [[nodiscard]] registration_step<transform_type> estimate(const transform_type& current,
                                                           std::span<const correspondence<S>> pairs,
                                                           memory& known) const {
    return estimate_all(current, std::array{pairs}, known);
  }
  /// What is made small, with these pairs and the weights that they have under `current`.
  [[nodiscard]] warp_energy assess(const transform_type& current,
                                   std::span<const correspondence<S>> pairs) const {
    return assess_all(current, std::array{pairs});
  }
  /// As above, with separate pairs for each term of a combined metric.
  template <std::size_t N>
    requires(detail::is_combined<Metric>)
  [[nodiscard]] warp_energy assess(const transform_type& current,
                                   const std::array<correspondences<S>, N>& pairs) const {
    return assess_all(current, spans_of(pairs));
  }
  template <std::size_t N>
    requires(detail::is_combined<Metric>)
  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, const std::array<correspondences<S>, N>& pairs) const {
    memory fresh;
    return estimate(current, pairs, fresh);
  }
  template <std::size_t N>
    requires(detail::is_combined<Metric>)
  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, const std::array<correspondences<S>, N>& pairs,
      memory& known) const {
    return estimate_all(current, spans_of(pairs), known);
  }

 private:
  static constexpr int C = closed_dimension<D>;
  using engine = warp_engine<S, C, Motion>;
  using vector = point_vector<double, C>;

  static constexpr std::size_t terms() {
    if constexpr (detail::is_combined<Metric>)
      return Metric::size;
    else
      return 1;
  }

  void expect_weights() const {
    detail::with_terms(metric_, [&](const auto& term, double weight, const auto& by, const auto&) {
      expect_between(0, weight, std::numeric_limits<double>::max(),
                     "warp_estimator: the weight of a term");
      expect_sizes(term, surfaces_.source.points.size(), surfaces_.target.points.size(),
                   "warp_estimator");
      expect_sizes(by, surfaces_.source.points.size(), surfaces_.target.points.size(),
                   "warp_estimator");
    });
  }

  template <std::size_t N>
  static auto spans_of(const std::array<correspondences<S>, N>& pairs) {
    static_assert(N == terms(), "there must be one searcher for each term of the metric");
    std::array<std::span<const correspondence<S>>, N> all;
    for (std::size_t i = 0; i < N; ++i) all[i] = pairs[i];
    return all;
  }

  /// Calls `f(term number, term, weight, pair weight, kernel)` for the terms of list `l` of pairs.
  template <std::size_t Lists, class F>
  void for_terms(std::size_t l, F&& f) const {
    std::size_t number = 0;
    detail::with_terms(metric_,
                       [&](const auto& term, double weight, const auto& by, const auto& robust) {
                         if (Lists == 1 || number == l) f(number, term, weight, by, robust);
                         ++number;
                       });
  }

  [[nodiscard]] matched_pair<C> pair_of(const node_motions<C>& motions, index_t group,
                                        const vector& place, std::int32_t s, index_t t) const {
    return detail::pair_at<detail::needs_source_normals<Metric>,
                           detail::needs_target_normals<Metric>>(
        place, surfaces_.target, s, t, [&] {
          const auto& graph = engine_->graph();
          const auto nodes = graph.anchors_of(group);
          const typename engine::matrix linear = blended<S, C>::linear(
              motions, nodes, std::span{graph.weights_at(graph.place_of[s]), nodes.size()});
          const vector n = surfaces_.source.normals[s].template cast<double>();
          return turned_normal<C>(linear, n);
        });
  }

  /// The pairs of a step, and what is known about them.
  template <std::size_t Lists>
  struct step_pairs {
    std::array<pairs_by_source<S>, Lists> lists;
    memory& known;

    [[nodiscard]] bool has(std::int32_t s) const {
      for (const auto& list : lists)
        if (list.first[s] != list.first[s + 1]) return true;
      return false;
    }
  };

  /// Sorts the pairs, and makes room for what is found out about them.
  template <std::size_t Lists>
  [[nodiscard]] step_pairs<Lists> prepare(
      const transform_type& current,
      const std::array<std::span<const correspondence<S>>, Lists>& all, memory& known) const {
    expects(current.graph() == graph_,
            "warp_estimator: the field is of another graph; resample it first");
    const index_t sources = surfaces_.source.points.size();
    known.weights.resize(Lists);
    known.first.resize(Lists);
    known.places.resize(static_cast<std::size_t>(sources * surfaces_.dimension));
    step_pairs<Lists> pairs{{}, known};
    for (std::size_t l = 0; l < Lists; ++l) {
      detail::expect_pairs_of(surfaces_, all[l]);
      expects(std::ranges::is_sorted(all[l], {}, &correspondence<S>::source),
              "warp_estimator: pairs must be in the order of their source points");
      pairs.lists[l] = index_by_source(all[l], sources, known.first[l]);
      known.weights[l].assign(all[l].size() * terms(), 0);
    }
    return pairs;
  }

  template <std::size_t Lists>
  [[nodiscard]] registration_step<transform_type> estimate_all(
      const transform_type& current,
      const std::array<std::span<const correspondence<S>>, Lists>& all, memory& known) const {
    const auto pairs = prepare(current, all, known);
    registration_step<transform_type> result{current, {}, {}};
    known.energy = {};
    auto& fit = result.fit;
    fit.non_finite = surfaces_.non_finite;
    fit.unknowns = Motion::unknowns(surfaces_.dimension) * graph_.nodes().size();
    if (graph_.nodes().empty()) return result;
    index_t paired = 0;
    for (const std::int32_t s : engine_->graph().order) paired += pairs.has(s);
    fit.overlap = surfaces_.overlap(paired);

    auto step = engine_->improve(
        current.motions(),
        [&](index_t list, row_buffer& rows) { write_rows(current.motions(), list, pairs, rows); },
        [&](const node_motions<C>& motions) { return judge(motions, current.motions(), pairs); },
        known);
    const auto& totals = step.before.totals;
    const auto share = [](double part, double whole) { return whole > 0 ? part / whole : 0.0; };
    fit.pairs = totals.pairs;
    fit.rmse = std::sqrt(share(totals.squared_distance, double(totals.pairs)));
    fit.residual = std::sqrt(share(totals.squared_residual, totals.weight));
    fit.undetermined =
        std::ssize(step.before.unsupported_nodes) * Motion::unknowns(surfaces_.dimension);
    known.energy = energy_of(step.before);
    result.change = step.change;
    result.transform.motions() = std::move(step.motions);
    return result;
  }
  template <std::size_t Lists>
  [[nodiscard]] warp_energy assess_all(
      const transform_type& current,
      const std::array<std::span<const correspondence<S>>, Lists>& all) const {
    memory known;
    const auto pairs = prepare(current, all, known);
    if (graph_.nodes().empty() || engine_->points() == 0) return {};
    return energy_of(engine_->assess(
        current.motions(),
        [&](index_t list, row_buffer& rows) { write_rows(current.motions(), list, pairs, rows); },
        known));
  }
  [[nodiscard]] warp_energy energy_of(const typename engine::assessment& found) const {
    return {found.totals.squared_residual / engine_->points(),
            found.disagreement / engine_->points(), found.unsupported_nodes};
  }

  /// The rows of all points of a group.
  template <std::size_t Lists>
  void write_rows(const node_motions<C>& motions, index_t group, const step_pairs<Lists>& pairs,
                  row_buffer& rows) const {
    const index_t d = surfaces_.dimension;
    moved_group moved;
    move_group(engine_->graph(), motions, surfaces_.source.points, group, true, moved);
    const auto points = engine_->graph().points_of(group);
    for (index_t i = 0; i < std::ssize(points); ++i) {
      const std::int32_t s = points[i];
      if (!pairs.has(s)) continue;
      const vector place = moved.template place<C>(i, d);
      std::copy_n(place.data(), d, pairs.known.places.data() + s * d);
      for (std::size_t l = 0; l < Lists; ++l)
        for (index_t p = pairs.lists[l].first[s]; p < pairs.lists[l].first[s + 1]; ++p) {
          const auto& [source, t, distance] = pairs.lists[l].pairs[p];
          const auto pair = pair_of(motions, group, place, s, t);
          const double square = (pair.point - pair.target).squaredNorm();
          if (!std::isfinite(square)) continue;
          ++rows.totals.pairs;
          rows.totals.squared_distance += square;
          for_terms<Lists>(l, [&](std::size_t number, const auto& term, double factor,
                                  const auto& by, const auto& robust) {
            const double weight = weight_of_term(term, factor, by, robust,
                                                 engine_->options().robust, pair, double(distance));
            if (weight == 0) return;
            pairs.known.weights[l][p * terms() + number] = weight;
            const double scale = std::sqrt(weight);
            bool has_rows = false;
            const auto add = [&](double value, const vector& gradient, const vector* beside) {
              if (!std::isfinite(value) || !is_finite(gradient)) return;
              engine_->write_row(moved, group, i, gradient, beside, scale, rows.add(scale * value));
              rows.totals.squared_residual += weight * value * value;
              has_rows = true;
            };
            term(pair, [&](double value, const vector& gradient, const auto&... at) {
              if constexpr (sizeof...(at) == 0) {
                add(value, gradient, nullptr);
              } else {
                const vector beside = (at - ... - place);
                add(value, gradient, &beside);
              }
            });
            if (has_rows) rows.totals.weight += weight;
          });
        }
    }
  }

  /// What the residuals are under other motions, with the weights that they had, and with source
  /// normals as they were before: they are constant within a step.
  template <std::size_t Lists>
  [[nodiscard]] typename engine::outcome judge(const node_motions<C>& motions,
                                               const node_motions<C>& before,
                                               const step_pairs<Lists>& pairs) const {
    struct sums {
      double energy = 0, farthest = 0;
      sums& operator+=(const sums& other) {
        energy += other.energy;
        farthest = std::max(farthest, other.farthest);
        return *this;
      }
    };
    const index_t d = surfaces_.dimension;
    const index_t groups = engine_->graph().group_count();
    constexpr index_t at_once = 256;
    std::vector<sums> parts(static_cast<std::size_t>((groups + at_once - 1) / at_once));
    parallel_blocks(groups, at_once, {.threads = engine_->options().threads},
                    [&](index_t block, index_t begin, index_t end) {
                      moved_group moved;
                      for (index_t group = begin; group < end; ++group) {
                        move_group(engine_->graph(), motions, surfaces_.source.points, group, false,
                                   moved);
                        const auto points = engine_->graph().points_of(group);
                        for (index_t i = 0; i < std::ssize(points); ++i)
                          if (pairs.has(points[i]))
                            judge_point(before, group, points[i],
                                        vector{moved.template place<C>(i, d)}, pairs, parts[block]);
                      }
                    });
    sums total;
    for (const auto& part : parts) total += part;
    return {total.energy, std::sqrt(total.farthest)};
  }
  template <std::size_t Lists, class Sums>
  void judge_point(const node_motions<C>& normals_by, index_t group, std::int32_t s,
                   const vector& place, const step_pairs<Lists>& pairs, Sums& sums) const {
    const Eigen::Map<const vector> before{pairs.known.places.data() + s * place.size(),
                                          place.size()};
    sums.farthest = std::max(sums.farthest, (place - before).squaredNorm());
    for (std::size_t l = 0; l < Lists; ++l)
      for (index_t p = pairs.lists[l].first[s]; p < pairs.lists[l].first[s + 1]; ++p) {
        const auto pair = pair_of(normals_by, group, place, s, pairs.lists[l].pairs[p].target);
        for_terms<Lists>(l, [&](std::size_t number, const auto& term, const auto&...) {
          const double weight = pairs.known.weights[l][p * terms() + number];
          if (weight == 0) return;
          term(pair, [&](double value, const auto&...) {
            if (std::isfinite(value)) sums.energy += weight * value * value;
          });
        });
      }
  }

  deformation_graph<S, D> graph_;
  detail::registered_surfaces<S, C> surfaces_;
  Metric metric_;
  std::shared_ptr<const engine> engine_;
};
export template <PointsSource P, PointsSource T, Scalar S, int D, class Metric = point_to_plane,
                 class Motion = rigid_motion>
warp_estimator(P&&, T&&, deformation_graph<S, D>, Metric = {}, const warp_options& = {},
               Motion = {}) -> warp_estimator<S, D, Metric, Motion>;

}  // namespace cilantro
