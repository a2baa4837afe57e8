// SPDX-License-Identifier: MIT
//
// One call for all of it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

template <class T>
struct pair_of_scans {
  point_cloud<typename T::scalar, T::static_dimension> target = test::bumpy_surface<T>(800, 1);
  test::rigid_of<T> truth = test::random_rigid<T>(2, 0.1, 0.1);
  point_cloud<typename T::scalar, T::static_dimension> source =
      transform(test::bumpy_surface<T>(600, 3), test::inverse(truth));
};

bool same(const auto& a, const auto& b) {
  return test::difference(a.transform, b.transform) == 0 && a.status == b.status &&
         a.rmse == b.rmse && a.information == b.information && a.pairs == b.pairs;
}

/// The distance to a plane, and as much again for what is far away: made outside of the library.
struct own_metric {
  static constexpr bool needs_target_normals = true;
  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    emit(2 * (pair.point - pair.target).dot(pair.target_normal), 2 * pair.target_normal);
  }
};

/// Translations only.
struct shift {
  template <Scalar S, int D>
  using transform = rigid_transform<S, D>;
  static constexpr index_t unknowns(index_t dimension) { return dimension; }
  template <class V>
  static void pull_back(const V&, const V& g, double* row) {
    for (index_t i = 0; i < g.size(); ++i) row[i] = g[i];
  }
  static motion_step step(const Eigen::VectorXd& unknowns, index_t d) {
    return {Eigen::MatrixXd::Identity(d, d), unknowns};
  }
};

}  // namespace

TEST_CASE_TEMPLATE("what align does can be done by hand, to the bit", T, test::f2, test::f3,
                   test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  const pair_of_scans<T> scans;
  const auto& [target, truth, source] = scans;
  const auto by_hand = [&](const auto& onto, const auto& moving, const auto& estimator,
                           double max_distance, const auto& start) {
    return icp(nearest_neighbor_searcher{moving, onto, {.max_distance = max_distance}}, estimator,
               start, {.max_iterations = 20});
  };
  const auto identity = identity_transform<test::rigid_of<T>>(T::dimension);
  CHECK(same(align(source, target, {.max_distance = 0.8, .max_iterations = 20}),
             by_hand(target, source, least_squares_estimator{source, target}, 0.8, identity)));
  CHECK(same(align(source, target,
                   {.metric = point_to_point{}, .max_distance = 0.8, .max_iterations = 20}),
             by_hand(target, source, point_to_point_estimator{source, target}, 0.8, identity)));

  // Bare points: normals are estimated, of the ten nearest.
  const auto& [points, normals_unused] = std::tie(target.points, target.normals);
  const auto normals = estimate_normals(points, knn{10}).normals;
  const auto with_normals = oriented_points_view{points, normals};
  CHECK(same(align(source.points, points, {.max_distance = 0.8, .max_iterations = 20}),
             by_hand(with_normals, source.points,
                     least_squares_estimator{source.points, with_normals}, 0.8, identity)));

  // From coarse to fine.
  const auto coarse_target = target | voxel_downsample(0.4),
             coarse = source | voxel_downsample(0.4);
  const auto first =
      by_hand(coarse_target, coarse, least_squares_estimator{coarse, coarse_target, symmetric{}}, 2,
              identity);
  const auto second = by_hand(target, source, least_squares_estimator{source, target, symmetric{}},
                              0.6, first.transform);
  const auto at_once =
      align(source, target,
            {.metric = symmetric{}, .max_iterations = 20, .scales = {{0.4, 2}, {0, 0.6}}});
  CHECK(same(at_once, second));
  CHECK(at_once.iterations == first.iterations + second.iterations);
  CHECK(test::difference(at_once.transform, truth) < 0.1);
}

TEST_CASE_TEMPLATE("a metric and a motion from outside are used like those that are shipped", T,
                   test::f2, test::d3, test::d5) {
  const pair_of_scans<T> scans;
  const auto& [target, truth, source] = scans;
  const auto ours = align(source, target, own_metric{}, {.max_distance = 0.8});
  const auto shipped = align(source, target, {.max_distance = 0.8});
  CHECK(test::difference(ours.transform, shipped.transform) < 1e-4);
  CHECK(ours.residual == doctest::Approx(2 * shipped.residual).epsilon(1e-3));

  auto moved = target;
  moved.points.array() += typename T::scalar(0.05);
  const auto shifted = align<shift>(
      moved, target, {.metric = point_to_plane{}, .max_distance = 0.8, .max_iterations = 60});
  CHECK(shifted.converged());
  CHECK(shifted.transform.linear().isIdentity(0));
  for (const auto t : shifted.transform.translation())
    CHECK(double(t) == doctest::Approx(-0.05).epsilon(0.01));
}

TEST_CASE_TEMPLATE("an affine map is found from nearest neighbours", T, test::f2, test::d2,
                   test::d3) {
  const auto target = test::bumpy_surface<T>(1500);
  const auto truth = test::random_affine<T>(1, 0.04, 0.03);
  const auto source = transform(target, test::inverse(truth));
  for (const metric_choice& metric :
       {metric_choice{point_to_point{}}, metric_choice{point_to_plane{}}}) {
    const auto found = align<affine_motion>(
        source, target, {.metric = metric, .max_distance = 1, .max_iterations = 200});
    // Planes do not tell an ellipsoid that slides in itself, nor points on a dense curve.
    if (metric.index() == 1 && T::dimension == 3)
      CHECK(test::difference(found.transform, truth) < 1e-3);
    CHECK(found.rmse < 0.03);
  }
}

TEST_CASE("a robust kernel keeps what does not belong from pulling") {
  const pair_of_scans<test::d3> scans;
  const auto& [target, truth, source] = scans;
  auto spoiled = source;
  for (index_t i = 0; i < spoiled.size(); i += 5)
    spoiled.points.col(i) += Eigen::Vector3d{0, 0, 0.25};
  const align_options plain{.max_distance = 0.8, .max_iterations = 60};
  auto robust = plain;
  robust.robust = tukey{0.1};
  auto trimmed = plain;
  trimmed.fraction = 0.6;
  const double without = test::difference(align(spoiled, target, plain).transform, truth);
  const double with = test::difference(align(spoiled, target, robust).transform, truth);
  CHECK(with < 0.3 * without);
  CHECK(test::difference(align(spoiled, target, trimmed).transform, truth) < without);
}

TEST_CASE("each term of a metric may have its own pairs and weights") {
  const pair_of_scans<test::d3> scans;
  const auto& [target, truth, source] = scans;
  const combined_metric metric{
      weighted_term{point_to_plane{}, 1},
      weighted_term{point_to_point{}, 0.5,
                    [](index_t s, index_t t, double) { return s == t ? 1.0 : 0.0; }}};
  const least_squares_estimator estimator{source, target, metric};
  const nearest_neighbor_searcher near{source, target, {.max_distance = 0.8}};
  const known_pairs_searcher known{source, target, {{5, 5, 0}, {6, 7, 0}}};
  const auto found =
      icp(combined_searcher{near, known}, estimator, Eigen::Isometry3d::Identity(), {});
  CHECK(found.pairs == 602);
  CHECK(found.overlap == 1);

  // Against the sums that belong to the result, term by term.
  correspondences<double> pairs;
  near.find(found.transform, pairs);
  double squares = 0, weight = 0;
  for (const auto& [s, t, distance] : pairs) {
    const double r =
        (found.transform * source.points.col(s) - target.points.col(t)).dot(target.normals.col(t));
    squares += r * r;
    weight += 1;
  }
  squares += 0.5 * (found.transform * source.points.col(5) - target.points.col(5)).squaredNorm();
  weight += 0.5;
  CHECK(found.residual == doctest::Approx(std::sqrt(squares / weight)));
}

TEST_CASE("clouds with origins meet in the coordinates of the target") {
  auto [target, truth, source] = pair_of_scans<test::d3>{};
  const auto plain = align(source, target, {.max_distance = 0.8});
  // The same places in the world, given relative to somewhere else.
  const Eigen::Vector3d base{500'000, 4'100'000, 300}, offset{3, -2, 1};
  auto far_target = target, far_source = source;
  far_target.origin = base;
  far_source.origin = base + offset;
  far_source.points.colwise() -= offset;
  const auto far = align(far_source, far_target, {.max_distance = 0.8});
  CHECK(far.converged());
  CHECK(test::difference(far.transform, plain.transform) < 1e-9);
  CHECK(far.rmse == doctest::Approx(plain.rmse));
  CHECK(evaluate(far_source, far_target, far.transform, {.max_distance = 0.8}).rmse == far.rmse);
  const auto moved = far_source | align_to(far_target, {.max_distance = 0.8});
  CHECK(moved.origin == base);
  CHECK((moved.points - transform_points(plain.transform, source.points)).norm() < 1e-9);
}

TEST_CASE("in a pipeline, a cloud that cannot be aligned is an error, unless somebody looks") {
  const pair_of_scans<test::f3> scans;
  const auto& [target, truth, source] = scans;
  const auto aligned = source | align_to(target, {.max_distance = 0.8});
  CHECK((aligned.points - transform_points(truth, source.points)).cwiseAbs().maxCoeff() < 0.05f);
  CHECK((aligned.normals - transform_normals(truth, source.normals)).cwiseAbs().maxCoeff() < 0.05f);

  auto far = source;
  far.points.array() += 100;
  CHECK_THROWS_AS((void)(far | align_to(target, {.max_distance = 0.8})), alignment_failed);
  icp_result<Eigen::Isometry3f> found;
  const auto untouched = far | align_to(target, {.max_distance = 0.8}, &found);
  CHECK(found.status == icp_status::too_few_pairs);
  CHECK(untouched.points == far.points);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)(source | align_to(target, {.monitor = {{}, stop.get_token()}})),
                  cancelled);
}

TEST_CASE("what does not fit together is refused in a sentence") {
  const pair_of_scans<test::f3> scans;
  const auto& [target, truth, source] = scans;
  auto odd = target;
  odd.normals.conservativeResize(3, 5);
  CHECK_THROWS_AS((void)align(source, odd), invalid_input);
  CHECK_THROWS_AS((void)align(odd, target), invalid_input);
  CHECK_THROWS_AS((nearest_neighbor_searcher{source, odd}), invalid_input);
  CHECK_THROWS_WITH_AS((void)(oriented_points_view{target.points, odd.normals}),
                       "oriented_points_view: there must be one normal per point, or none",
                       invalid_input);
  CHECK_THROWS_WITH_AS(
      (least_squares_estimator{source.points, target.points}),
      "least_squares_estimator: the metric needs normals of the target; estimate them first",
      invalid_input);
  CHECK_THROWS_AS((least_squares_estimator{source.points, target, symmetric{}}), invalid_input);
  CHECK_THROWS_AS((void)align(source, target, {.max_distance = -1}), invalid_input);
  CHECK_THROWS_AS((void)align(source, target, {.scales = {{-1, 1}}}), invalid_input);
  CHECK_THROWS_AS((void)align(source, target, {.fraction = 2}), invalid_input);
  CHECK_THROWS_AS((void)align(source, target, {.threads = -1}), invalid_input);
  const Eigen::MatrixXf flat = Eigen::MatrixXf::Random(2, 9), deep = Eigen::MatrixXf::Random(3, 9);
  CHECK_THROWS_AS((void)align(flat, deep), invalid_input);
  CHECK_THROWS_AS(
      (void)align(flat, flat, {.initial = identity_transform<rigid_transform<float, dynamic>>(3)}),
      invalid_input);
}

TEST_CASE("points of every layout are aligned where they are") {
  const pair_of_scans<test::d3> scans;
  const auto& [target, truth, source] = scans;
  std::vector<Eigen::Vector3d> as_vectors(std::size_t(source.size()));
  std::vector<std::array<double, 3>> as_arrays(std::size_t(target.size()));
  for (index_t i = 0; i < source.size(); ++i) as_vectors[std::size_t(i)] = source.points.col(i);
  for (index_t i = 0; i < target.size(); ++i)
    for (int d = 0; d < 3; ++d) as_arrays[std::size_t(i)][std::size_t(d)] = target.points(d, i);
  CHECK(same(align(as_vectors, as_arrays, {.max_distance = 0.8}),
             align(source.points, target.points, {.max_distance = 0.8})));
}

TEST_CASE("few points, equal points and points on a line are answered, not crashed on") {
  for (const index_t n : {1, 2, 3, 5})
    for (const metric_choice& metric :
         {metric_choice{point_to_plane{}}, metric_choice{point_to_point{}},
          metric_choice{symmetric{}}, metric_choice{generalized_icp{}}}) {
      const auto some = test::random_points<test::d3>(n, 1);
      const Eigen::Matrix3Xd equal = some.col(0).replicate(1, n);
      const Eigen::Matrix3Xd line = some.col(0) * Eigen::RowVectorXd::LinSpaced(n, 0, 1);
      for (const auto& points : {Eigen::Matrix3Xd{some}, equal, line}) {
        const auto found = align(points, points, {.metric = metric});
        CHECK(found.transform.matrix().allFinite());
        CHECK(test::difference(found.transform, Eigen::Isometry3d::Identity()) < 1e-9);
        if (n == 1) CHECK(!found.converged());
      }
      CHECK(align(equal, equal, {.metric = metric}).undetermined >= 3);
    }
}

TEST_CASE("an option that would have no effect is refused") {
  const pair_of_scans<test::d3> scans;
  CHECK_THROWS_AS(
      (void)align(scans.source, scans.target, point_to_plane{}, {.robust = tukey{0.01}}),
      invalid_input);
  CHECK_THROWS_AS(
      (void)align(scans.source, scans.target, point_to_plane{}, {.metric = symmetric{}}),
      invalid_input);
}

TEST_CASE_TEMPLATE("normals must have unit length, be zero, or be no numbers", T, test::f3,
                   test::d2) {
  using S = typename T::scalar;
  const pair_of_scans<T> scans;
  auto target = scans.target;
  target.normals.col(3).setZero();
  target.normals.col(4).setConstant(test::nan<S>);
  target.normals.col(5) *= S(1.001);
  CHECK(align(scans.source, target, {.max_distance = 0.3}).pairs > 0);
  for (const S length : {S(5), S(0.01), S(127)}) {
    auto scaled = target;
    scaled.normals.col(7) *= length;
    CHECK_THROWS_AS((void)align(scans.source, scaled, {.max_distance = 0.3}), invalid_input);
    CHECK(align(scans.source, scaled, {.metric = point_to_point{}, .max_distance = 0.3}).pairs > 0);
  }
}

TEST_CASE("where the transform itself is rounded by more than the tolerance, it settles") {
  for (const auto& [unit, offset] : {std::pair{1.0, 5000.0}, {1.0, 9000.0}, {1e6, 1e6}}) {
    const Eigen::Matrix3Xd points = unit * test::bumpy_surface<test::d3>(2000).points;
    const Eigen::Vector3d place{offset, -offset / 2, offset / 3};
    const auto turn =
        Eigen::AngleAxisd{0.05, Eigen::Vector3d{1, 2, 3}.normalized()}.toRotationMatrix();
    const point_cloud<float, 3> target{.points = (points.colwise() + place).cast<float>()};
    const point_cloud<float, 3> source{.points = ((turn * points).colwise() + place).cast<float>()};
    for (const metric_choice& metric :
         {metric_choice{point_to_plane{}}, metric_choice{point_to_point{}}}) {
      const auto found = align(
          source, target, {.metric = metric, .max_distance = 0.3 * unit, .max_iterations = 200});
      CHECK(found.converged());
      CHECK(found.rmse < 2 * std::max(offset, unit) * 0x1p-23);
    }
  }
}

TEST_CASE("generalized ICP moves on where normals disagree by a radian") {
  const auto target = test::bumpy_surface<test::d3>(1500);
  for (const double angle : {0.6, 1.0})
    for (int axis = 0; axis < 3; ++axis) {
      const auto source = transform(
          target, Eigen::Isometry3d{Eigen::AngleAxisd{angle, Eigen::Vector3d::Unit(axis)}});
      align_options options{
          .metric = generalized_icp{}, .max_distance = 0.5, .max_iterations = 100};
      const auto found = align(source, target, options);
      options.solver.min_eigenvalue = 0;
      const auto unlimited = align(source, target, options);
      CHECK(found.undetermined == 0);
      CHECK(test::difference(found.transform, unlimited.transform) < 1e-9);
    }
}

TEST_CASE("what is found of clouds with origins is a transform of the world, too") {
  const auto surface = test::bumpy_surface<test::d3>(800, 1);
  const Eigen::Vector3d origin{500000, 4600000, 100};
  point_cloud<double, 3> target = surface, source = surface;
  target.origin = origin;
  source.origin = origin;
  source =
      transform(source, Eigen::Isometry3d{Eigen::Translation3d{origin} *
                                          test::inverse(test::random_rigid<test::d3>(1, 0.1, 0.1)) *
                                          Eigen::Translation3d{-origin}});
  const auto found = align(source, target, {.max_distance = 0.5, .max_iterations = 60});
  REQUIRE(found.converged());
  const auto moved = transform(source, in_the_world(found, target));
  const Eigen::Matrix3Xd off = (moved.points.colwise() + moved.full_origin()) -
                               (target.points.colwise() + target.full_origin());
  CHECK(off.cwiseAbs().maxCoeff() < 1e-5);
}

TEST_CASE("a start must be a finite rotation") {
  const pair_of_scans<test::d3> scans;
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  const auto refused = [&] {
    CHECK_THROWS_AS((void)align(scans.source, scans.target, {.initial = start}), invalid_input);
    CHECK_THROWS_AS((void)evaluate(scans.source, scans.target, start), invalid_input);
  };
  start.linear()(2, 2) = -1;
  refused();
  start.linear().setZero();
  refused();
  start = Eigen::Isometry3d::Identity();
  start.translation()[1] = test::nan<double>;
  refused();
}

TEST_CASE("over several scales progress rises to 1") {
  const pair_of_scans<test::d3> scans;
  std::vector<double> seen;
  (void)align(scans.source, scans.target,
              {.scales = {{0.3, 1.0}, {0.1, 0.5}, {0, 0.3}},
               .monitor = {[&](double share) { seen.push_back(share); }, {}}});
  REQUIRE(!seen.empty());
  CHECK(std::ranges::is_sorted(seen));
  CHECK(seen.back() == 1);
}
