// SPDX-License-Identifier: MIT
//
// The loop and its verdict.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <sstream>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// A corridor of two parallel walls at z = 0 and z = 1, `length` long, with exact normals.
template <class S>
point_cloud<S, 3> corridor(index_t count, double length, std::uint64_t seed = 0) {
  point_cloud<S, 3> cloud;
  cloud.points.resize(3, count);
  cloud.normals.resize(3, count);
  for (index_t i = 0; i < count; ++i) {
    random_stream random{seed, std::uint64_t(i)};
    const S side = i % 2 == 0 ? S(0) : S(1);
    cloud.points.col(i) << S(random.uniform(0, length)), S(random.uniform(0, 1)), side;
    cloud.normals.col(i) << 0, 0, 1 - 2 * side;
  }
  return cloud;
}

template <class S>
constexpr double micro = std::is_same_v<S, float> ? 1e-5 : 1e-9;

}  // namespace

// The first cilantro called this converged, after one iteration.
TEST_CASE_TEMPLATE("no pairs are never a success, and leave the transform as it was", S, float,
                   double) {
  const auto target = test::bumpy_surface<test::space<S, 3>>(200);
  auto source = target;
  source.points.array() += S(100);
  const auto start = test::random_rigid<test::space<S, 3>>(1, 0.3, 0.3);
  const nearest_neighbor_searcher searcher{source, target, {.max_distance = 1}};
  const auto check = [&](const auto& estimator) {
    const auto found = icp(searcher, estimator, start);
    CHECK(found.status == icp_status::too_few_pairs);
    CHECK(!found.converged());
    CHECK(found.iterations == 0);
    CHECK(found.pairs == 0);
    CHECK(found.overlap == 0);
    CHECK(found.rmse == 0);
    CHECK(found.undetermined == found.directions.cols());
    CHECK(test::difference(found.transform, start) == 0);
  };
  check(point_to_point_estimator{source, target});
  check(least_squares_estimator{source, target, point_to_plane{}});
  check(least_squares_estimator{source, target, symmetric{}});
  const point_cloud<S, 3> none;
  for (const auto& cloud : {source, none}) {
    CHECK(align(cloud, target, {.max_distance = 1}).status == icp_status::too_few_pairs);
    CHECK(align(target, cloud, {.max_distance = 1}).status == icp_status::too_few_pairs);
  }
  CHECK(align(none, none).status == icp_status::too_few_pairs);
}

TEST_CASE_TEMPLATE("identical clouds are aligned by not moving", T, test::f2, test::f3, test::f5,
                   test::fx, test::d2, test::d3, test::d5, test::dx) {
  using S = typename T::scalar;
  const auto cloud = test::bumpy_surface<T>(300);
  const metric_choice metrics[] = {
      point_to_plane{}, point_to_point{}, symmetric{}, generalized_icp{},
      combined_metric{weighted_term{point_to_point{}, 0.1}, weighted_term{point_to_plane{}, 1}}};
  for (const auto& metric : metrics) {
    const auto found = align(cloud, cloud, {.metric = metric, .max_distance = 0.5});
    CHECK(found.converged());
    CHECK(found.iterations == 1);
    CHECK(found.overlap == 1);
    CHECK(test::difference(found.transform, identity_transform<test::rigid_of<T>>(T::dimension)) <
          micro<S>);
  }
}

// The first cilantro answered (−2.50, −0.007, −0.01) here, and called it converged.
TEST_CASE_TEMPLATE("in a corridor the free directions are named and stay as they were", S, float,
                   double) {
  const auto target = corridor<S>(2000, 10);
  auto source = target | select([&](index_t i) { return target.points(0, i) < 5; });
  source.points.row(2).array() += S(0.01);
  const auto found = align(source, target, {.max_distance = 0.5, .max_iterations = 50});
  CHECK(found.status == icp_status::degenerate);
  CHECK(!found.converged());
  CHECK(std::abs(double(found.transform.translation().x())) < micro<S>);
  CHECK(std::abs(double(found.transform.translation().y())) < micro<S>);
  CHECK(double(found.transform.translation().z()) == doctest::Approx(-0.01).epsilon(1e-3));

  // Along x and y, and about z: nothing else, and each is in the span of these.
  REQUIRE(found.undetermined == 3);
  const Eigen::MatrixXd free = found.unobservable_directions();
  REQUIRE(free.rows() == 6);
  for (const int blind : {0, 1, 5}) CHECK(free.row(blind).cwiseAbs().maxCoeff() < 1e-4);
  CHECK((decompose_singular(free).values.array() > 1e-9).count() == 3);
  CHECK(found.eigenvalues.head(3).cwiseAbs().maxCoeff() < 1e-6);
  CHECK(found.eigenvalues[3] > 0.05);
  CHECK((found.information * free).norm() < 1e-3 * found.information.norm());

  // Pairs of points tell more: nothing is free any more.
  CHECK(align(source, target, {.metric = point_to_point{}, .max_distance = 0.5}).undetermined == 0);
  // From elsewhere, the free directions stay there.
  Eigen::Transform<S, 3, Eigen::Isometry> start =
      Eigen::Transform<S, 3, Eigen::Isometry>::Identity();
  start.translation() << S(0.7), S(0.1), S(0.02);
  const auto shifted = align(source, target, {.initial = start, .max_distance = 0.5});
  CHECK(double(shifted.transform.translation().x()) == doctest::Approx(0.7).epsilon(1e-4));
  CHECK(double(shifted.transform.translation().y()) == doctest::Approx(0.1).epsilon(1e-3));
  CHECK(double(shifted.transform.translation().z()) == doctest::Approx(-0.01).epsilon(1e-2));
}

TEST_CASE("eigenvalues depend neither on the unit of length nor on where the origin is") {
  const auto reference = test::bumpy_surface<test::d3>(400);
  const auto eigenvalues_of = [](const auto& cloud) {
    return align(cloud, cloud, {.max_distance = 1e9, .max_iterations = 1}).eigenvalues;
  };
  const Eigen::VectorXd expected = eigenvalues_of(reference);
  CHECK(expected.minCoeff() > 0.01);
  CHECK(expected.maxCoeff() < 1 + 1e-12);
  auto large = reference;
  large.points *= 1000;
  CHECK((eigenvalues_of(large) - expected).norm() < 1e-9);
  large.points.colwise() += Eigen::Vector3d{5e4, -2e4, 1e4};
  CHECK((eigenvalues_of(large) - expected).norm() < 1e-6);
}

TEST_CASE("a plane, a sphere, a cylinder and a line leave free what they leave free") {
  const auto free_of = [](auto&& make, index_t count, const metric_choice& metric) {
    point_cloud<double, 3> cloud;
    cloud.points.resize(3, count);
    cloud.normals.resize(3, count);
    for (index_t i = 0; i < count; ++i) {
      random_stream random{3, std::uint64_t(i)};
      const auto [p, n] = make(random);
      cloud.points.col(i) = p;
      cloud.normals.col(i) = n;
    }
    cloud.points.colwise() += Eigen::Vector3d{3, 4, 5};
    return align(cloud, cloud, {.metric = metric, .max_distance = 1}).undetermined;
  };
  struct element {
    Eigen::Vector3d point, normal;
  };
  const auto plane = [](random_stream& r) {
    return element{{r.uniform(-1, 1), r.uniform(-1, 1), 0}, {0, 0, 1}};
  };
  const auto sphere = [](random_stream& r) {
    const Eigen::Vector3d n = Eigen::Vector3d{r.normal(), r.normal(), r.normal()}.normalized();
    return element{n, n};
  };
  const auto cylinder = [](random_stream& r) {
    const double angle = r.uniform(0, 6.28);
    const Eigen::Vector3d n{std::cos(angle), std::sin(angle), 0};
    return element{n + Eigen::Vector3d{0, 0, r.uniform(-1, 1)}, n};
  };
  const auto line = [](random_stream& r) { return element{{r.uniform(-1, 1), 0, 0}, {0, 0, 1}}; };
  CHECK(free_of(plane, 300, point_to_plane{}) == 3);
  CHECK(free_of(sphere, 300, point_to_plane{}) == 3);
  CHECK(free_of(cylinder, 300, point_to_plane{}) == 2);
  CHECK(free_of(line, 300, point_to_plane{}) == 4);
  CHECK(free_of(line, 300, point_to_point{}) == 1);
  CHECK(free_of(plane, 300, point_to_point{}) == 0);
  CHECK(free_of(plane, 2, point_to_point{}) == 1);  // Two points: turning about both of them.
  CHECK(free_of(plane, 1, point_to_point{}) == 3);
  CHECK(free_of(plane, 300, symmetric{}) == 3);
  CHECK(free_of(plane, 300, generalized_icp{}) == 3);
}

TEST_CASE_TEMPLATE("what pairs of points leave open stays as it is", S, float, double) {
  // Two points, of which the second is to be turned from x to y; turning about that line is free.
  Eigen::Matrix<S, 3, 2> target, source;
  target << 0, 0, 0, 2, 0, 0;
  source << 0, 2, 0, 0, 0, 0;
  const known_pairs_searcher searcher{source, target, test::same_indices<S>(2)};
  const point_to_point_estimator estimator{source, target};
  const auto found = icp(searcher, estimator, estimator.identity());
  CHECK(found.status == icp_status::degenerate);
  CHECK(found.rmse < micro<S>);
  // A quarter turn about z, and nothing about the line itself.
  Eigen::Matrix<S, 3, 3> quarter;
  quarter << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  CHECK((found.transform.linear() - quarter).norm() < micro<S>);
  // One point moves, and does not turn.
  const known_pairs_searcher single{source, target, {{1, 1, 0}}};
  const auto moved = icp(single, estimator, estimator.identity());
  CHECK(moved.status == icp_status::degenerate);
  CHECK(moved.transform.linear().isIdentity(S(micro<S>)));
  CHECK((moved.transform * source.col(1) - target.col(1)).norm() < micro<S>);
}

// The first cilantro returned a transform that was not finite, and called it converged.
TEST_CASE_TEMPLATE("points that are not finite change nothing but a count", S, float, double) {
  using space = test::space<S, 3>;
  const auto target = test::bumpy_surface<space>(500);
  const auto source = transform(target, test::random_rigid<space>(1, 0.1, 0.1));
  const auto spoil = [](auto cloud, index_t at, S with) {
    const index_t n = cloud.size();
    cloud.points.conservativeResize(3, n + 1);
    cloud.normals.conservativeResize(3, n + 1);
    cloud.points.col(n) = cloud.points.col(0);
    cloud.normals.col(n) = cloud.normals.col(0);
    cloud.points(at, n) = with;
    return cloud;
  };
  for (const metric_choice& metric : {metric_choice{point_to_plane{}},
                                      metric_choice{point_to_point{}}, metric_choice{symmetric{}}})
    for (const auto direction_is_both : {false, true}) {
      const align_options options{
          .metric = metric, .max_distance = 1, .reciprocal = direction_is_both};
      const auto clean = align(source, target, options);
      CHECK(clean.converged());
      CHECK(clean.non_finite == 0);
      for (const S bad : {test::nan<S>, test::infinity<S>, -test::infinity<S>}) {
        const auto spoiled = align(spoil(source, 1, bad), spoil(target, 2, bad), options);
        CHECK(spoiled.non_finite == 2);
        CHECK(spoiled.converged());
        CHECK(spoiled.pairs == clean.pairs);
        CHECK(spoiled.overlap == clean.overlap);
        CHECK(test::difference(spoiled.transform, clean.transform) == 0);
      }
    }
}

TEST_CASE("unknown normals say nothing, and normals that are not finite do not spread") {
  const auto target = test::bumpy_surface<test::d3>(300);
  auto partly = target;
  for (index_t i = 0; i < 300; i += 7)
    partly.normals.col(i).setConstant(i % 2 == 0 ? 0.0 : test::nan<double>);
  const auto source = transform(target, test::random_rigid<test::d3>(1, 0.1, 0.1));
  const known_pairs_searcher searcher{source, partly, test::same_indices<double>(300)};
  const auto truth = test::random_rigid<test::d3>(1, 0.1, 0.1).inverse();
  for (int i = 0; i < 2; ++i) {
    const auto found = i == 0 ? icp(searcher, least_squares_estimator{source, partly})
                              : icp(searcher, least_squares_estimator{source, partly, symmetric{}});
    CHECK(found.converged());
    CHECK(test::difference(found.transform, truth) < 1e-9);
  }
}

TEST_CASE("a mirrored target is met by a rotation, never by a reflection") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto source = test::random_points<test::d3>(50, seed);
    Eigen::Matrix3Xd target = source;
    target.row(int(seed % 3)) *= -1;
    const known_pairs_searcher searcher{source, target, test::same_indices<double>(50)};
    const point_to_point_estimator estimator{source, target};
    const auto found = icp(searcher, estimator, estimator.identity());
    CHECK(found.transform.linear().determinant() == doctest::Approx(1));
    // As good as Eigen's own answer.
    const Eigen::Matrix4d best = Eigen::umeyama(source, target, false);
    const double error = (transform_points(found.transform, source) - target).squaredNorm();
    const double least = (transform_points(Eigen::Isometry3d{best}, source) - target).squaredNorm();
    CHECK(error == doctest::Approx(least).epsilon(1e-9));
  }
}

TEST_CASE_TEMPLATE("a rotation by 180 degrees is found, and small steps never break a rotation", S,
                   float, double) {
  using space = test::space<S, 3>;
  const auto target = test::bumpy_surface<space>(200);
  rigid_transform<S, 3> half = rigid_transform<S, 3>::Identity();
  half.linear().diagonal() << -1, -1, 1;
  const auto source = transform(target, half);
  const known_pairs_searcher searcher{source, target, test::same_indices<S>(200)};
  CHECK(test::difference(icp(searcher, point_to_point_estimator{source, target}).transform, half) <
        micro<S>);
  // By steps, from nearly 180 degrees away.
  rigid_transform<S, 3> nearly = half;
  nearly.linear() = Eigen::AngleAxis<S>{S(3.1), Eigen::Matrix<S, 3, 1>::UnitZ()}.toRotationMatrix();
  const auto turned = transform(target, nearly);
  const least_squares_estimator estimator{turned, target, point_to_point{}};
  const auto found = icp(known_pairs_searcher{turned, target, test::same_indices<S>(200)},
                         estimator, estimator.identity(), {.max_iterations = 100});
  CHECK(found.converged());
  CHECK(test::difference(found.transform, nearly.inverse()) < micro<S>);
  CHECK((found.transform.linear() * found.transform.linear().transpose()).isIdentity(S(1e-5)));
}

TEST_CASE("the loop stops for each of its reasons, and says which") {
  const auto target = test::bumpy_surface<test::d3>(400);
  const auto source =
      transform(test::bumpy_surface<test::d3>(300, 5), test::random_rigid<test::d3>(1, 0.15, 0.1));
  const nearest_neighbor_searcher searcher{source, target};
  const least_squares_estimator estimator{source, target};
  const auto run = [&](const icp_options<Eigen::Isometry3d>& options) {
    return icp(searcher, estimator, Eigen::Isometry3d::Identity(), options);
  };
  const auto converged = run({.max_iterations = 200});
  REQUIRE(converged.converged());
  CHECK(converged.last_change.rotation <= 1e-5);
  CHECK(converged.last_change.translation <= 1e-5);
  REQUIRE(converged.iterations > 4);

  const auto limited = run({.max_iterations = 2});
  CHECK(limited.status == icp_status::iteration_limit);
  CHECK(limited.iterations == 2);
  CHECK(!limited.converged());
  const auto none = run({.max_iterations = 0});
  CHECK(none.iterations == 0);
  CHECK(none.status == icp_status::iteration_limit);
  CHECK(none.pairs == 300);
  CHECK(test::difference(none.transform, Eigen::Isometry3d::Identity()) == 0);

  CHECK(run({.tolerance = 1}).iterations == 1);
  CHECK(run({.tolerance = 1, .rotation_tolerance = 1e-5}).iterations > 1);
  CHECK(run({.tolerance = 1, .translation_tolerance = 1e-5}).iterations > 1);
  const auto by_residual = run({.max_iterations = 200, .tolerance = 0, .residual_tolerance = 0.01});
  CHECK(by_residual.converged());
  CHECK(by_residual.iterations < converged.iterations);
  CHECK(run({.min_pairs = 301}).status == icp_status::too_few_pairs);
  CHECK_THROWS_AS((void)run({.max_iterations = -1}), invalid_input);
  CHECK_THROWS_AS((void)run({.tolerance = -1}), invalid_input);
  CHECK_THROWS_AS((void)run({.tolerance = test::nan<double>}), invalid_input);
  CHECK_THROWS_AS((void)run({.residual_tolerance = -1}), invalid_input);

  std::ostringstream text;
  text << converged.status << ' ' << limited.status;
  CHECK(text.str() == "converged iteration_limit");
}

TEST_CASE("an observer sees each iteration, and a stop ends the loop where it is") {
  const auto target = test::bumpy_surface<test::d3>(400);
  const auto source =
      transform(test::bumpy_surface<test::d3>(300, 5), test::random_rigid<test::d3>(1, 0.15, 0.1));
  std::vector<double> residuals, progress;
  std::stop_source stop;
  const auto found =
      align(source, target,
            {.tolerance = 0,
             .observer =
                 [&](const align_iteration& now) {
                   CHECK(now.number == std::ssize(residuals) + 1);
                   residuals.push_back(now.fit.residual);
                   if (now.number == 3) stop.request_stop();
                 },
             .monitor = {[&](double share) { progress.push_back(share); }, stop.get_token()}});
  CHECK(found.status == icp_status::cancelled);
  // What the third made was not looked at any more: figures are of what is returned.
  CHECK(found.iterations == 2);
  REQUIRE(residuals.size() == 3);
  CHECK(residuals[2] < residuals[0]);
  CHECK(progress == std::vector<double>{1 / 30.0, 2 / 30.0, 3 / 30.0});
  // What has been reached is returned, and was not spoiled.
  const auto two = align(source, target, {.max_iterations = 2, .tolerance = 0});
  CHECK(test::difference(found.transform, two.transform) == 0);
  CHECK(found.residual == two.residual);
  CHECK(found.rmse == two.rmse);
  // Before anything is done.
  const auto at_once = align(source, target, {.monitor = {{}, stop.get_token()}});
  CHECK(at_once.status == icp_status::cancelled);
  CHECK(test::difference(at_once.transform, Eigen::Isometry3d::Identity()) == 0);
}

TEST_CASE("figures of a result are those of its transform, and any transform has them") {
  const auto target = test::bumpy_surface<test::d3>(400);
  auto source =
      transform(test::bumpy_surface<test::d3>(300, 5), test::random_rigid<test::d3>(1, 0.15, 0.1));
  source.points.rightCols(60).array() += 50;  // A fifth has no partner.
  const correspondence_options pairs{.max_distance = 0.6};
  const nearest_neighbor_searcher searcher{source, target, pairs};
  const least_squares_estimator estimator{source, target};
  const auto found = icp(searcher, estimator, Eigen::Isometry3d::Identity(), {});
  const auto fit = evaluate(searcher, estimator, found.transform);
  CHECK(fit.pairs == found.pairs);
  CHECK(fit.overlap == found.overlap);
  CHECK(fit.overlap <= 0.8);
  CHECK(fit.rmse == found.rmse);
  CHECK(fit.residual == found.residual);
  CHECK(fit.information == found.information);
  CHECK(fit.eigenvalues == found.eigenvalues);
  const auto same = evaluate(source, target, found.transform, {.max_distance = 0.6});
  CHECK(same.rmse == fit.rmse);
  CHECK(same.information == fit.information);

  // By their definitions, from the pairs themselves.
  const auto all = residuals(searcher, estimator, found.transform);
  REQUIRE(std::ssize(all.pairs) == fit.pairs);
  double distances = 0, squares = 0;
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  for (index_t i = 0; i < fit.pairs; ++i) {
    const auto& [s, t, distance] = all.pairs[std::size_t(i)];
    const Eigen::Vector3d y = found.transform * source.points.col(s), n = target.normals.col(t);
    distances += (y - target.points.col(t)).squaredNorm();
    const double residual = (y - target.points.col(t)).dot(n);
    CHECK(all.values[i] == doctest::Approx(residual));
    squares += residual * residual;
    Eigen::Matrix<double, 6, 1> row;
    row << y.cross(n), n;
    information += row * row.transpose();
  }
  CHECK(fit.rmse == doctest::Approx(std::sqrt(distances / double(fit.pairs))));
  CHECK(fit.residual == doctest::Approx(std::sqrt(squares / double(fit.pairs))));
  CHECK((fit.information - information).norm() < 1e-9 * information.norm());
  CHECK(fit.overlap == doctest::Approx(double(fit.pairs) / 300));
  // Each direction moves the points by one unit, and is seen as its eigenvalue says.
  for (index_t k = 0; k < 6; ++k) {
    double moved = 0;
    const Eigen::Vector3d turn = fit.directions.col(k).head(3),
                          shift = fit.directions.col(k).tail(3);
    for (const auto& pair : all.pairs)
      moved += (turn.cross(found.transform * source.points.col(pair.source)) + shift).squaredNorm();
    CHECK(moved / double(fit.pairs) == doctest::Approx(1));
    const double seen = fit.directions.col(k).dot(fit.information * fit.directions.col(k));
    CHECK(seen / double(fit.pairs) == doctest::Approx(fit.eigenvalues[k]));
  }
}

TEST_CASE_TEMPLATE("the same bits for any number of threads", S, float, double) {
  using space = test::space<S, 3>;
  const auto target = test::bumpy_surface<space>(9000);
  const auto source =
      transform(test::bumpy_surface<space>(7000, 5), test::random_rigid<space>(1, 0.15, 0.1));
  for (const metric_choice& metric :
       {metric_choice{point_to_plane{}}, metric_choice{point_to_point{}},
        metric_choice{generalized_icp{}}}) {
    const auto run = [&](int threads) {
      return align(source, target,
                   {.metric = metric,
                    .max_iterations = 8,
                    .scales = {{0.2, 0.8}, {0, 0.4}},
                    .robust = huber{0.1},
                    .reciprocal = true,
                    .threads = threads});
    };
    const auto one = run(1);
    CHECK(one.pairs > 1000);
    for (const int threads : {2, 5}) {
      const auto more = run(threads);
      CHECK(test::difference(one.transform, more.transform) == 0);
      CHECK(one.rmse == more.rmse);
      CHECK(one.information == more.information);
    }
  }
}

// A bound on where it starts from, and how far off it may end, with noise and a part that is
// missing.
TEST_CASE_TEMPLATE("from within the basin, a moved, noisy part is brought back", T, test::f2,
                   test::f3, test::d2, test::d3) {
  using S = typename T::scalar;
  constexpr double angle = T::dimension == 2 ? 0.35 : 0.2, length = 0.2, noise = 0.003;
  const auto target = test::bumpy_surface<T>(3000);
  int converged = 0, found_by_plane = 0, found_by_points = 0, found_by_symmetric = 0;
  constexpr int cases = 50;
  for (int seed = 0; seed < cases; ++seed) {
    // Other points of the same surface, a quarter of it cut off.
    auto part = test::bumpy_surface<T>(1500, 1000 + std::uint64_t(seed)) |
                select([&, all = test::bumpy_surface<T>(1500, 1000 + std::uint64_t(seed))](
                           index_t i) { return all.points(seed % T::dimension, i) < S(0.5); });
    random_stream random{std::uint64_t(seed)};
    for (auto& x : part.points.reshaped()) x += S(noise * random.normal());
    const auto truth = test::random_rigid<T>(std::uint64_t(seed), angle, length * random.uniform());
    const auto source = transform(part, test::inverse(truth));
    const auto is_found = [&](const metric_choice& metric, double tolerance) {
      const auto found =
          align(source, target, {.metric = metric, .max_distance = 0.5, .max_iterations = 60});
      converged += found.converged();
      return test::difference(found.transform, truth) < tolerance;
    };
    found_by_plane += is_found(point_to_plane{}, 0.005);
    found_by_symmetric += is_found(symmetric{}, 0.005);
    found_by_points += is_found(point_to_point{}, 0.1);
  }
  MESSAGE("found by planes: " << found_by_plane << ", symmetric: " << found_by_symmetric
                              << ", points: " << found_by_points << " of 50; converged "
                              << converged << " of 150");
  CHECK(found_by_plane == cases);
  CHECK(found_by_symmetric == cases);
  // Points hold each other back where the surface slides: they need closer starts and more time.
  CHECK(found_by_points >= cases / 2);
}
