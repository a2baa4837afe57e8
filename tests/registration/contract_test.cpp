// SPDX-License-Identifier: MIT
//
// The contracts accept what is shipped, and name what is wrong with what is not.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

bool mentions(const std::vector<std::string>& violations, const char* words) {
  return std::ranges::any_of(violations,
                             [&](const auto& v) { return v.find(words) != std::string::npos; });
}

struct wrong_gradient {
  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    emit((pair.point - pair.target).dot(pair.target_normal), 2 * pair.target_normal);
  }
};

/// Steps along another direction than it says.
struct turned_translation {
  template <Scalar S, int D>
  using transform = rigid_transform<S, D>;
  static constexpr index_t unknowns(index_t dimension) { return dimension; }
  template <class V>
  static void pull_back(const V&, const V& g, double* row) {
    for (index_t i = 0; i < g.size(); ++i) row[i] = g[i];
  }
  static motion_step step(const Eigen::VectorXd& unknowns, index_t d) {
    return {Eigen::MatrixXd::Identity(d, d), -unknowns};
  }
};

/// Turns about the origin, and cannot move.
struct rotation_only {
  template <Scalar S, int D>
  using transform = rigid_transform<S, D>;
  static constexpr index_t unknowns(index_t d) { return d * (d - 1) / 2; }
  template <class V>
  static void pull_back(const V& y, const V& g, double* row) {
    Eigen::VectorXd all(rigid_motion::unknowns(y.size()));
    rigid_motion::pull_back(y, g, all.data());
    for (index_t k = 0; k < unknowns(y.size()); ++k) row[k] = all[k];
  }
  static motion_step step(const Eigen::VectorXd& unknowns, index_t d) {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(rigid_motion::unknowns(d));
    all.head(unknowns.size()) = unknowns;
    return rigid_motion::step(all, d);
  }
};

struct descending_searcher {
  void find(const Eigen::Isometry3d&, correspondences<double>& out) const {
    out = {{0, 2, 0}, {0, 1, 0}};
  }
};
struct far_searcher {
  void find(const Eigen::Isometry3d&, correspondences<double>& out) const { out = {{0, 100, 0}}; }
};
struct forgetful_searcher {
  using memory = int;
  void find(const Eigen::Isometry3d&, correspondences<double>& out) const { out = {{0, 1, 0}}; }
  void find(const Eigen::Isometry3d&, int& calls, correspondences<double>& out) const {
    out = {{0, calls++, 0}};
  }
};

/// Makes an answer up where there is none.
struct inventive_estimator {
  using transform_type = Eigen::Isometry3d;
  registration_step<Eigen::Isometry3d> estimate(const Eigen::Isometry3d&,
                                                std::span<const correspondence<double>>) const {
    registration_step<Eigen::Isometry3d> step{Eigen::Isometry3d::Identity(), {}, {}};
    step.fit.overlap = 2;
    return step;
  }
};

struct one_sided {
  bool operator()(const auto& a, const auto& b, const auto&) const { return a.index < b.index; }
};
struct moody {
  mutable std::atomic<int> calls = 0;
  bool operator()(const auto&, const auto&, const auto&) const { return ++calls % 3 == 0; }
};

/// Proposes what it is told.
template <class F>
struct solver_of {
  F f;
  [[nodiscard]] std::vector<pair_proposal<3>> propose(const putative_pairs<3>& pairs,
                                                      const execution& how) const {
    return f(pairs, how);
  }
};
template <class F>
solver_of(F) -> solver_of<F>;

/// Pairs of which two thirds are right.
template <int D>
putative_pairs<D> some_pairs() {
  using space = test::space<double, D>;
  putative_pairs<D> pairs;
  pairs.source = test::random_points<space>(90);
  pairs.max_distance = 0.05;
  const auto truth = test::random_rigid<space>(1, 1, 2);
  pairs.target = (truth.linear() * pairs.source).colwise() + truth.translation();
  for (index_t i = 0; i < 90; i += 3) pairs.target.col(i) *= -1;
  return pairs;
}

/// Reads a normal that it does not ask for.
template <auto Normal>
struct along {
  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    const auto& normal = pair.*Normal;
    emit((pair.point - pair.target).dot(normal), normal);
  }
};
/// Moves, and says nothing of it.
struct silent_estimator {
  using transform_type = Eigen::Isometry3d;
  [[nodiscard]] registration_step<Eigen::Isometry3d> estimate(
      const Eigen::Isometry3d& current, std::span<const correspondence<double>> pairs) const {
    registration_step<Eigen::Isometry3d> step{.transform = current};
    step.fit.pairs = std::ssize(pairs);
    if (!pairs.empty()) step.transform.pretranslate(Eigen::Vector3d{1, 2, 3});
    return step;
  }
};

struct long_feature {
  Eigen::Matrix2Xd features = Eigen::Matrix2Xd::Zero(2, 3);
  [[nodiscard]] points_view<double, 2> target() const { return as_points(features); }
  [[nodiscard]] index_t source_size() const { return 3; }
  [[nodiscard]] auto moved_by(const Eigen::Isometry3d&) const {
    return [](index_t, double* out) { out[0] = out[1] = out[2] = 0; };
  }
};

}  // namespace

TEST_CASE("the shipped motions do what a motion promises, in every dimension") {
  for (const index_t d : {1, 2, 3, 4, 6}) {
    CHECK(check_motion_model(rigid_motion{}, d).empty());
    CHECK(check_motion_model(affine_motion{}, d).empty());
    CHECK(check_motion_model(similarity_motion{}, d).empty());
  }
  CHECK(rigid_motion::unknowns(3) == 6);
  CHECK(rigid_motion::unknowns(2) == 3);
  CHECK(affine_motion::unknowns(3) == 12);
}

TEST_CASE("a motion that breaks its promise is told so") {
  CHECK(mentions(check_motion_model(turned_translation{}, 3), "velocity"));
  CHECK(mentions(check_motion_model(rotation_only{}, 3), "translation is not a motion"));
}

TEST_CASE_TEMPLATE("the shipped residuals have the gradients that they say", T,
                   test::space<double, 2>, test::space<double, 3>, test::space<double, dynamic>) {
  constexpr int D = T::static_dimension;
  CHECK(check_residual_term<D>(point_to_point{}).empty());
  CHECK(check_residual_term<D>(point_to_plane{}).empty());
  CHECK(check_residual_term<D>(symmetric{}).empty());
  CHECK(check_residual_term<D>(generalized_icp{}).empty());
  CHECK(check_residual_term<D>(generalized_icp{0.5}).empty());
  CHECK(mentions(check_residual_term<D>(wrong_gradient{}), "gradient is not the derivative"));
}

TEST_CASE("a residual that reads normals without asking for them is told so") {
  CHECK(mentions(check_residual_term<3>(along<&matched_pair<3>::normal>{}),
                 "no `needs_source_normals = true`"));
  CHECK(mentions(check_residual_term<3>(along<&matched_pair<3>::target_normal>{}),
                 "no `needs_target_normals = true`"));
}

TEST_CASE("searchers that are out of order, out of range or forgetful are told so") {
  const auto points = test::random_points<test::d3>(10);
  const std::vector transforms{Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()};
  CHECK(mentions(check_correspondence_searcher(descending_searcher{}, points, points, transforms),
                 "ascending order"));
  CHECK(mentions(check_correspondence_searcher(far_searcher{}, points, points, transforms),
                 "out of range"));
  CHECK(mentions(check_correspondence_searcher(forgetful_searcher{}, points, points, transforms),
                 "memory"));
}

TEST_CASE("estimators keep what they promise, with and without pairs") {
  const auto target = test::bumpy_surface<test::d3>(60);
  const auto source = transform(target, test::random_rigid<test::d3>(1, 0.1, 0.1));
  const auto pairs = test::same_indices<double>(60);
  const auto start = test::random_rigid<test::d3>(2, 0.1, 0.1);
  CHECK(check_transform_estimator(point_to_point_estimator{source, target}, start, pairs).empty());
  CHECK(check_transform_estimator(least_squares_estimator{source, target}, start, pairs).empty());
  CHECK(
      check_transform_estimator(least_squares_estimator{source, target, symmetric{}}, start, pairs)
          .empty());
  CHECK(check_transform_estimator(least_squares_estimator{source, target, generalized_icp{}}, start,
                                  pairs)
            .empty());
  const auto violations = check_transform_estimator(inventive_estimator{}, start, pairs);
  CHECK(mentions(violations, "without pairs, the transform changes"));
  CHECK(mentions(violations, "overlap is not from 0 to 1"));
  const auto silent = check_transform_estimator(silent_estimator{}, start, pairs);
  CHECK(mentions(silent, "`change` says that it does not"));
  CHECK(mentions(silent, "none of the source has a partner"));
}

TEST_CASE("a feature that is longer than it should be is told so") {
  CHECK(mentions(check_feature_space(long_feature{}, Eigen::Isometry3d::Identity()),
                 "more scalars are written"));
}

TEST_CASE("the shipped invariants and solvers of pairs keep their promises") {
  const auto flat = some_pairs<2>();
  const auto solid = some_pairs<3>();
  auto upright = solid;
  upright.up = Eigen::Vector3d{0, 0, 1};
  const auto check = [](const auto& pairs) {
    CHECK(check_pair_invariant(equal_lengths{}, pairs).empty());
    CHECK(check_pair_invariant(equal_lengths_and_angles{}, pairs).empty());
    CHECK(check_pair_solver(pair_graph<>{}, pairs).empty());
    CHECK(check_pair_solver(pair_graph{equal_lengths{}}, pairs).empty());
    CHECK(check_pair_solver(sampled_pairs{}, pairs).empty());
    CHECK(check_pair_solver(graduated_pairs{}, pairs).empty());
    CHECK(check_pair_solver(any_pair_solver{sampled_pairs{}}, pairs).empty());
  };
  check(flat);
  check(solid);
  check(upright);
  CHECK(pair_graph<>{}.propose(solid, {}).size() > 0);
}

TEST_CASE("an invariant of pairs that breaks its promise is told so") {
  const auto pairs = some_pairs<3>();
  CHECK(mentions(check_pair_invariant(one_sided{}, pairs), "not symmetric"));
  CHECK(mentions(check_pair_invariant(moody{}, pairs), "two calls"));
}

TEST_CASE("a solver of pairs that breaks its promise is told so") {
  auto pairs = some_pairs<3>();
  pairs.up = Eigen::Vector3d{0, 0, 1};
  const auto violations = [&](auto f) { return check_pair_solver(solver_of{f}, pairs); };
  const auto one = [](const Eigen::Matrix3d& rotation) {
    pair_proposal<3> proposal;
    proposal.rotation = rotation;
    return std::vector{proposal};
  };
  const Eigen::Matrix3d still = Eigen::Matrix3d::Identity();
  CHECK(mentions(violations([&](const auto&, const auto&) { return one(2 * still); }),
                 "not a rotation"));
  CHECK(mentions(violations([&](const auto&, const auto&) { return one(-still); }),
                 "not a rotation"));
  CHECK(
      mentions(violations([&](const auto&, const auto&) { return one(still * test::nan<double>); }),
               "not finite"));
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd{0.1, Eigen::Vector3d::UnitX()}.toRotationMatrix();
  CHECK(mentions(violations([&](const auto&, const auto&) { return one(tilt); }), "vertical"));
  const auto always = violations([&](const auto&, const auto&) { return one(still); });
  CHECK(mentions(always, "without pairs"));
  CHECK(mentions(always, "does not stop"));
  CHECK(mentions(violations([&](const auto&, const execution& how) {
                   auto some = one(still);
                   some.resize(std::size_t(how.threads), some[0]);
                   return some;
                 }),
                 "number of threads"));
  int calls = 0;
  CHECK(mentions(violations([&](const auto&, const auto&) {
                   auto some = one(still);
                   some.resize(std::size_t(++calls), some[0]);
                   return some;
                 }),
                 "two calls"));
  CHECK(mentions(violations([&](const auto&, const auto&) {
                   auto some = one(still);
                   some[0].scale = 2;
                   return some;
                 }),
                 "scale"));
}

// How much a residual changes with each unknown, against what really changes.
TEST_CASE_TEMPLATE("rows of the normal equations are derivatives by finite differences", T,
                   test::space<double, 2>, test::space<double, 3>, test::space<double, 5>) {
  constexpr index_t d = T::dimension;
  constexpr int D = T::static_dimension == 5 ? dynamic : T::static_dimension;
  using vector = point_vector<double, D>;
  constexpr double h = 1e-6;
  const auto check = [&](const auto& model, const auto& term, bool turns_both_sides) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      random_stream random{seed};
      const auto some = [&] {
        vector v(d);
        for (auto& x : v) x = random.uniform(-1, 1);
        return v;
      };
      const matched_pair<D> pair{some(), some(), some().normalized(), some().normalized(), 0, 0};
      const index_t u = model.unknowns(d);
      // What the estimator makes of the term.
      std::vector<Eigen::VectorXd> rows;
      term(pair, [&](double, const vector& gradient, const auto&... at) {
        Eigen::VectorXd row(u);
        if constexpr (sizeof...(at) == 0)
          model.pull_back(pair.point, gradient, row.data());
        else
          (model.pull_back(at, gradient, row.data()), ...);
        rows.push_back(row);
      });
      const auto values_after = [&](const Eigen::VectorXd& unknowns) {
        auto moved = pair;
        // The paper of the symmetric metric turns both sides by half, and shifts one.
        Eigen::VectorXd there = unknowns, back = Eigen::VectorXd::Zero(u);
        if (turns_both_sides) {
          there.head(u - d) /= 2;
          back.head(u - d) = -unknowns.head(u - d) / 2;
        }
        const auto forward = model.step(there, d), backward = model.step(back, d);
        moved.point = forward.linear * pair.point + forward.translation;
        moved.target = backward.linear * pair.target + backward.translation;
        std::vector<double> values;
        term(moved, [&](double value, const auto&...) { values.push_back(value); });
        return values;
      };
      for (index_t k = 0; k < u; ++k) {
        const Eigen::VectorXd unit = Eigen::VectorXd::Unit(u, k);
        const auto after = values_after(h * unit), before = values_after(-h * unit);
        REQUIRE(after.size() == rows.size());
        for (std::size_t i = 0; i < rows.size(); ++i)
          CHECK((after[i] - before[i]) / (2 * h) == doctest::Approx(rows[i][k]).epsilon(1e-6));
      }
    }
  };
  check(rigid_motion{}, point_to_point{}, false);
  check(rigid_motion{}, point_to_plane{}, false);
  check(rigid_motion{}, generalized_icp{}, false);
  check(rigid_motion{}, symmetric{}, true);
  check(affine_motion{}, point_to_point{}, false);
  check(affine_motion{}, point_to_plane{}, false);
}
