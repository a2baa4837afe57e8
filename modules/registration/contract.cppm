// SPDX-License-Identifier: MIT
//
// Tests whether a type of yours does what its concept says, beyond what a compiler can check. Each
// check returns a sentence for each rule that is broken; if there is none, the type can be used.
export module cilantro.registration:contract;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :concepts;
import :correspondence;
import :feature_space;
import :motion;
import :putative_pairs;
import :residual;

namespace cilantro {

template <class Pairs>
[[nodiscard]] bool same_pairs(const Pairs& a, const Pairs& b) {
  if constexpr (requires { a[0].source; }) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!(a[i] == b[i])) return false;
  } else {
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!same_pairs(a[i], b[i])) return false;
  }
  return true;
}

/// Tests a searcher of yours, built from `source` and `target`, with each of `transforms`: the
/// order of pairs, their indices, points that are not finite, repeated searches, and its memory if
/// it has one.
export template <class S, PointsSource A, PointsSource B, class T>
  requires CorrespondenceSearcher<S, T>
[[nodiscard]] std::vector<std::string> check_correspondence_searcher(
    const S& searcher, const A& source, const B& target, const std::vector<T>& transforms) {
  violation_list violations;
  const auto onto = points_in(target);
  const auto moving = points_in(source);
  const auto check = [&](const auto& pairs) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto& [s, t, distance] = pairs[i];
      const bool in_range = 0 <= t && t < onto.size() && 0 <= s && s < moving.size();
      violations.expect(in_range, "an index is out of range");
      if (!in_range) continue;
      violations.expect(is_finite(onto[t]) && is_finite(moving[s]), "a point is not finite");
      violations.expect(std::isfinite(distance), "a distance is not finite");
      violations.expect(i == 0 || pairs[i - 1].source < s ||
                            (pairs[i - 1].source == s && pairs[i - 1].target < t),
                        "pairs are not in ascending order of source, then target");
    }
  };
  repeated_memory<S> memory{};
  pairs_of<S, T> remembered;
  for (const T& transform : transforms) {
    pairs_of<S, T> first, second;
    searcher.find(transform, first);
    second = first;
    searcher.find(transform, second);
    violations.expect(same_pairs(first, second), "two searches with the same transform differ");
    find_with_memory(searcher, transform, memory, remembered);
    violations.expect(same_pairs(first, remembered), "a search with memory differs");
    if constexpr (requires { first[0].source; })
      check(first);
    else
      for (const auto& pairs : first) check(pairs);
  }
  return violations.take();
}

/// Whether two maps move points of D dimensions alike; true if they are not maps of such points.
template <int D, class M>
[[nodiscard]] bool moves_alike(const M& a, const M& b) {
  // A map that converts points to another number of coordinates is not a map of such points.
  if constexpr (requires(index_t i, const point_vector<typename M::Scalar, D>& p) {
                  requires std::remove_cvref_t<decltype(a(i, p))>::RowsAtCompileTime == D;
                }) {
    index_t points = 8;
    if constexpr (requires { index_t(a.size()); }) {
      if (index_t(a.size()) != index_t(b.size())) return false;
      points = index_t(a.size());
    }
    for (index_t i = 0; i < points; ++i) {
      const auto p = point_vector<typename M::Scalar, D>::LinSpaced(0.25, 1).eval();
      if (moved_point(a, i, p) != moved_point(b, i, p)) return false;
    }
  }
  return true;
}

/// Tests an estimator of yours on a transform and pairs: that results are repeatable, with memory
/// and without, that the transform does not change without pairs, and otherwise not without a
/// `change`, by which `icp` tells whether it has converged, and that the figures of the fit make
/// sense.
export template <class E, class Pairs>
  requires TransformEstimator<E, Pairs>
[[nodiscard]] std::vector<std::string> check_transform_estimator(
    const E& estimator, const typename E::transform_type& transform, const Pairs& pairs) {
  violation_list violations;
  const auto same = [](const auto& a, const auto& b) {
    if constexpr (AffineMap<typename E::transform_type>)
      return a.linear() == b.linear() && a.translation() == b.translation();
    else if constexpr (requires {
                         { a == b } -> std::convertible_to<bool>;
                       })
      return static_cast<bool>(a == b);
    else
      return moves_alike<2>(a, b) && moves_alike<3>(a, b);
  };
  const auto first = estimator.estimate(transform, pairs);
  const auto second = estimator.estimate(transform, pairs);
  violations.expect(same(first.transform, second.transform),
                    "two estimates with the same arguments differ");
  violations.expect(same(first.transform, transform) || first.change.rotation != 0 ||
                        first.change.translation != 0,
                    "the transform changes, and `change` says that it does not");
  violations.expect(first.fit.pairs == 0 || first.fit.overlap > 0,
                    "the fit counts pairs, and says that none of the source has a partner");
  if constexpr (!std::same_as<repeated_memory<E>, no_memory>) {
    repeated_memory<E> memory{};
    for (int i = 0; i < 2; ++i)
      violations.expect(
          same(estimator.estimate(transform, pairs, memory).transform, first.transform),
          "an estimate with memory differs from one without");
  }
  const auto nothing = estimator.estimate(transform, Pairs{});
  violations.expect(same(nothing.transform, transform), "without pairs, the transform changes");
  violations.expect(nothing.fit.pairs == 0 && nothing.fit.overlap == 0,
                    "without pairs, the fit counts some");
  for (const auto* step : {&first, &nothing}) {
    violations.expect(step->change.rotation >= 0 && step->change.translation >= 0,
                      "a change is negative or NaN");
    const auto& fit = step->fit;
    violations.expect(fit.overlap >= 0 && fit.overlap <= 1, "the overlap is not from 0 to 1");
    violations.expect(fit.rmse >= 0 && fit.residual >= 0, "an error is negative or NaN");
    violations.expect(fit.undetermined >= 0 && fit.undetermined <= fit.unknowns,
                      "more unknowns are undetermined than there are");
    violations.expect(fit.directions.cols() == 0 || fit.directions.cols() == fit.unknowns,
                      "there are not as many directions as unknowns");
  }
  return violations.take();
}

/// Tests a residual term of yours in D dimensions on random pairs, as
/// `check_residual_term<3>(term)`: that it is finite and repeatable, that gradients are the
/// derivatives of the values by the point, and that it reads no normals without saying that it
/// needs them, which would then be zero.
export template <int D, ResidualTerm<D> Term>
[[nodiscard]] std::vector<std::string> check_residual_term(const Term& term,
                                                           const contract_options& options = {}) {
  violation_list violations;
  using vector = typename matched_pair<D>::vector;
  struct row {
    double value;
    vector gradient;
  };
  const auto rows_of = [&](const matched_pair<D>& pair) {
    std::vector<row> rows;
    term(pair, [&](double value, const vector& gradient, const auto&...) {
      rows.push_back({value, gradient});
    });
    return rows;
  };
  for (index_t q = 0; q < options.queries; ++q) {
    random_stream random{options.seed, static_cast<std::uint64_t>(q)};
    constexpr index_t d = D == dynamic ? 4 : D;
    const auto some = [&] {
      vector v(d);
      for (auto& x : v) x = random.uniform(-1, 1);
      return v;
    };
    matched_pair<D> pair{some(), some(), some().normalized(), some().normalized(), 0, 0};
    const auto rows = rows_of(pair), again = rows_of(pair);
    violations.expect(rows.size() == again.size(), "two calls with the same arguments differ");
    const auto reads = [&](vector matched_pair<D>::* normal) {
      auto without = pair;
      (without.*normal).setZero();
      return !std::ranges::equal(rows, rows_of(without), [](const row& a, const row& b) {
        return a.value == b.value && a.gradient == b.gradient;
      });
    };
    violations.expect(needs_source_normals<Term> || !reads(&matched_pair<D>::normal),
                      "it reads `normal`, and has no `needs_source_normals = true`");
    violations.expect(needs_target_normals<Term> || !reads(&matched_pair<D>::target_normal),
                      "it reads `target_normal`, and has no `needs_target_normals = true`");
    for (index_t k = 0; k < d; ++k) {
      constexpr double h = 1e-6;
      auto ahead = pair, behind = pair;
      ahead.point[k] += h;
      behind.point[k] -= h;
      const auto after = rows_of(ahead), before = rows_of(behind);
      if (after.size() != rows.size() || before.size() != rows.size()) continue;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        violations.expect(std::isfinite(rows[i].value) && is_finite(rows[i].gradient),
                          "a value or gradient is not finite");
        const double slope = (after[i].value - before[i].value) / (2 * h);
        violations.expect(
            std::abs(slope - rows[i].gradient[k]) <= 1e-5 * std::max(1.0, std::abs(slope)),
            "a gradient is not the derivative of its value");
      }
    }
  }
  return violations.take();
}

/// Tests a motion model of yours in `dimension` dimensions: that velocities are linear in the
/// unknowns and affine in the point, that steps move points with these velocities, and that every
/// translation is a possible motion.
export template <MotionModel P>
[[nodiscard]] std::vector<std::string> check_motion_model(const P& model, index_t dimension,
                                                          const contract_options& options = {}) {
  violation_list violations;
  const index_t u = P::unknowns(dimension);
  const auto close = [](const auto& a, const auto& b, double tolerance) {
    return (a - b).norm() <= tolerance * std::max(1.0, double(b.norm()));
  };
  const auto still = model.step(Eigen::VectorXd::Zero(u), dimension);
  violations.expect(still.linear.isIdentity(1e-12) && still.translation.isZero(1e-12),
                    "a step with all unknowns 0 moves points");
  for (index_t k = 0; k < dimension; ++k) {
    const Eigen::VectorXd push = Eigen::VectorXd::Unit(dimension, k);
    const Eigen::MatrixXd at_origin = velocities(model, Eigen::VectorXd::Zero(dimension));
    const Eigen::VectorXd unknowns = solve_least_squares(at_origin, push).unknowns;
    violations.expect(close(Eigen::VectorXd{at_origin * unknowns}, push, 1e-9),
                      "a translation is not a motion of the model");
  }
  for (index_t q = 0; q < options.queries; ++q) {
    random_stream random{options.seed, static_cast<std::uint64_t>(q)};
    const auto some = [&](index_t n) {
      Eigen::VectorXd v(n);
      for (auto& x : v) x = random.uniform(-1, 1);
      return v;
    };
    const Eigen::VectorXd a = some(dimension), b = some(dimension), delta = some(u);
    const Eigen::MatrixXd at_a = velocities(model, a);
    violations.expect(close(Eigen::MatrixXd{(at_a + velocities(model, b)) / 2},
                            velocities(model, Eigen::VectorXd{(a + b) / 2}), 1e-9),
                      "velocities are not affine in the point");
    Eigen::VectorXd row(u);
    model.pull_back(a, b, row.data());
    violations.expect(close(row, Eigen::VectorXd{at_a.transpose() * b}, 1e-9),
                      "pull_back is not linear in the gradient");
    constexpr double h = 1e-6;
    const auto ahead = model.step(h * delta, dimension), behind = model.step(-h * delta, dimension);
    const Eigen::VectorXd velocity =
        (ahead.linear * a + ahead.translation - behind.linear * a - behind.translation) / (2 * h);
    violations.expect(close(velocity, Eigen::VectorXd{at_a * delta}, 1e-6),
                      "a step does not move points with the velocity that pull_back describes");
    if constexpr (requires { model.normalize(still.linear); }) {
      const auto step = model.step(0.1 * delta, dimension);
      violations.expect(close(Eigen::MatrixXd{model.normalize(step.linear)}, step.linear, 1e-9),
                        "normalize changes the linear part of a step");
    }
  }
  return violations.take();
}

/// Tests a map of yours on the points that it moves: that it is for as many points, that results
/// are repeatable, and that moved normals are normal to the moved surroundings of each point.
export template <PointsSource P, PointMap<dimension_of<P>> M>
  requires std::same_as<typename M::Scalar, scalar_of<P>>
[[nodiscard]] std::vector<std::string> check_point_map(const M& map, const P& points,
                                                       const contract_options& options = {}) {
  using S = scalar_of<P>;
  constexpr int D = dimension_of<P>;
  using vector = point_vector<S, D>;
  violation_list violations;
  const auto view = points_in(points);
  const index_t d = view.dimension();
  try {
    expect_moves(map, view, "check_point_map");
    if constexpr (NormalMap<M, D>) (void)normals_moved_by<D>(map);
  } catch (const invalid_input& error) {
    return {error.what()};
  }
  S extent = 0;
  for (const auto& p : view)
    if (is_finite(p)) extent = std::max(extent, S(p.norm()));
  for (index_t q = 0; q < options.queries && !view.empty(); ++q) {
    random_stream random{options.seed, static_cast<std::uint64_t>(q)};
    const index_t i = random.below(view.size());
    if (!is_finite(view[i])) continue;
    const vector p = view[i], moved = moved_point(map, i, p);
    violations.expect(moved == moved_point(map, i, p) || !is_finite(moved),
                      "two calls with the same arguments differ");
    if constexpr (NormalMap<M, D>) {
      // A step as small as the rounding of the points, before and after the move, allows.
      const S h = std::cbrt(std::numeric_limits<S>::epsilon()) *
                  std::max(extent > 0 ? extent : S(1), S(moved.norm()));
      Eigen::MatrixXd jacobian(d, d);
      for (index_t k = 0; k < d; ++k) {
        const vector step = h * vector::Unit(d, k);
        jacobian.col(k) =
            ((moved_point(map, i, vector{p + step}) - moved_point(map, i, vector{p - step})) /
             (2 * h))
                .template cast<double>();
      }
      vector normal(d);
      for (auto& x : normal) x = S(random.uniform(-1, 1));
      const Eigen::VectorXd turned =
          normals_moved_by<D>(map)(i, normal.normalized()).template cast<double>();
      // A direction orthogonal to the normal must stay orthogonal to the turned one.
      const Eigen::VectorXd back = (jacobian.transpose() * turned).normalized();
      violations.expect((back - normal.normalized().template cast<double>()).norm() < 0.01,
                        "a moved normal is not normal to the moved surroundings of its point");
    }
  }
  return violations.take();
}

/// Tests a feature space of yours with a transform: that features have as many scalars as those of
/// the target, and that results are repeatable.
export template <class F, class T>
  requires FeatureSpace<F, T>
[[nodiscard]] std::vector<std::string> check_feature_space(const F& space, const T& transform) {
  using S = typename T::Scalar;
  violation_list violations;
  const index_t rows = space.target().dimension();
  const auto move = space.moved_by(transform);
  constexpr S untouched = S(-12345.5);
  using features = Eigen::Matrix<S, dynamic, 1>;
  for (index_t i = 0; i < space.source_size(); ++i) {
    features first = features::Constant(rows + 1, untouched), second = first;
    second[0] = 0;
    move(i, first.data());
    move(i, second.data());
    violations.expect(first.head(rows) == second.head(rows) || !is_finite(first.head(rows)),
                      "two calls with the same arguments differ");
    violations.expect(first[rows] == untouched,
                      "more scalars are written than a target feature has");
    violations.expect(rows == 0 || first[rows - 1] != untouched,
                      "fewer scalars are written than a target feature has");
  }
  return violations.take();
}

/// Tests an invariant of yours on random twos of `pairs`: that it is symmetric, and that results
/// are repeatable, also from several threads at once.
export template <class I, int D>
  requires PairInvariant<I, D>
[[nodiscard]] std::vector<std::string> check_pair_invariant(const I& invariant,
                                                            const putative_pairs<D>& pairs,
                                                            const contract_options& options = {}) {
  violation_list violations;
  if (pairs.size() == 0) return violations.take();
  const auto answers = [&](int threads) {
    std::vector<std::uint8_t> found(2 * static_cast<std::size_t>(options.queries));
    parallel_blocks(options.queries, 1, {.threads = threads}, [&](index_t q, index_t, index_t) {
      random_stream random{options.seed, static_cast<std::uint64_t>(q)};
      const auto a = pairs[random.below(pairs.size())], b = pairs[random.below(pairs.size())];
      found[2 * q] = static_cast<bool>(invariant(a, b, pairs));
      found[2 * q + 1] = static_cast<bool>(invariant(b, a, pairs));
    });
    return found;
  };
  const auto first = answers(1);
  for (index_t q = 0; q < options.queries; ++q)
    violations.expect(first[2 * q] == first[2 * q + 1], "it is not symmetric in its two pairs");
  violations.expect(first == answers(1), "two calls with the same arguments differ");
  violations.expect(first == answers(4), "calls from several threads differ");
  return violations.take();
}

/// A token of which a stop is requested already.
[[nodiscard]] std::stop_token requested_stop();

/// Tests a solver of yours on pairs from which it proposes something: that proposals are rotations
/// and translations, which keep the vertical if there is one; that results are repeatable, for any
/// number of threads; that nothing is proposed without pairs; and that it can be stopped.
export template <class T, int D>
  requires PairSolver<T, D>
[[nodiscard]] std::vector<std::string> check_pair_solver(const T& solver,
                                                         const putative_pairs<D>& pairs) {
  violation_list violations;
  const auto first = solver.propose(pairs, {.threads = 1});
  const auto same = [&](const std::vector<pair_proposal<D>>& other) {
    return std::ranges::equal(first, other, [](const auto& a, const auto& b) {
      return a.rotation == b.rotation && a.translation == b.translation && a.scale == b.scale;
    });
  };
  for (const auto& one : first) {
    const bool finite = is_finite(one.rotation.reshaped()) && is_finite(one.translation);
    violations.expect(finite, "a proposal is not finite");
    if (!finite) continue;
    violations.expect((one.rotation * one.rotation.transpose()).isIdentity(1e-6) &&
                          determinant(Eigen::MatrixXd{one.rotation}) > 0,
                      "a proposal is not a rotation: its matrix is not orthonormal with a "
                      "determinant of 1");
    violations.expect(one.scale == 1, "a proposal has another scale than 1");
    if (pairs.up)
      violations.expect((one.rotation * *pairs.up - *pairs.up).norm() < 1e-6,
                        "a proposal does not keep the vertical");
  }
  violations.expect(same(solver.propose(pairs, {.threads = 1})),
                    "two calls with the same arguments differ");
  violations.expect(same(solver.propose(pairs, {.threads = 4})),
                    "the proposals depend on the number of threads");

  putative_pairs<D> none = pairs;
  for (auto* matrix : {&none.source, &none.target, &none.source_normals, &none.target_normals})
    matrix->resize(D, 0);
  none.numbers.clear();
  violations.expect(solver.propose(none, {.threads = 1}).empty(),
                    "without pairs, something is proposed");

  try {
    const auto found = solver.propose(pairs, {.threads = 1, .monitor = {{}, requested_stop()}});
    violations.expect(found.empty(), "it does not stop when it is asked to");
  } catch (const cancelled&) {  // NOLINT: as it must.
  }
  return violations.take();
}

}  // namespace cilantro
