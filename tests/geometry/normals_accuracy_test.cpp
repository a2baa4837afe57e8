// SPDX-License-Identifier: MIT
//
// How precise the normals of many neighbourhoods are that are fitted at once, against an
// eigenvector in long double; CILANTRO_NEIGHBORHOODS says how many of each kind (10⁴ unless set).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

constexpr index_t members = 12;
constexpr index_t at_a_time = 10000;
using exact_matrix = Eigen::Matrix<long double, 3, 3>;

struct kind {
  std::string name;
  double width, height, thickness, offset;
};

/// Neighbourhoods of twelve points each, turned and placed at random.
template <class S>
point_matrix<S, 3> neighborhoods_of(const kind& k, index_t count, std::uint64_t seed) {
  point_matrix<S, 3> points(3, count * members);
  for (index_t n = 0; n < count; ++n) {
    random_stream random{seed, static_cast<std::uint64_t>(n)};
    const Eigen::Vector4d q{random.normal(), random.normal(), random.normal(), random.normal()};
    const Eigen::Matrix3d turn = Eigen::Quaterniond{q.normalized()}.toRotationMatrix();
    const Eigen::Vector3d place{random.normal(), random.normal(), random.normal()};
    for (index_t m = 0; m < members; ++m) {
      const Eigen::Vector3d p{random.normal() * k.width, random.normal() * k.height,
                              random.normal() * k.thickness};
      points.col(n * members + m) = (turn * p + k.offset * place).template cast<S>();
    }
  }
  return points;
}

template <class S>
neighborhoods<S> consecutive(index_t count) {
  std::vector<index_t> offsets;
  for (index_t i = 0; i <= count * members; ++i)
    offsets.push_back((i + members - 1) / members * members);
  buffer<std::int32_t> indices(static_cast<std::size_t>(count * members));
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<std::int32_t>(i);
  return {std::move(offsets), std::move(indices),
          buffer<S>(static_cast<std::size_t>(count * members))};
}

/// The covariance in the arithmetic of T, and the direction of its least eigenvalue in that of E.
template <class T, class E, class P>
Eigen::Matrix<long double, 3, 1> least_direction(const P& some) {
  const Eigen::Matrix<T, 3, members> points = some.template cast<T>();
  const Eigen::Matrix<T, 3, members> centered = points.colwise() - points.rowwise().mean().eval();
  const Eigen::Matrix<T, 3, 3> scatter = centered * centered.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<E, 3, 3>> solver{
      Eigen::Matrix<E, 3, 3>{scatter.template cast<E>()}};
  return solver.eigenvectors().col(0).template cast<long double>();
}

template <class V>
double sine(const V& a, const V& b) {
  return double(a.cross(b).norm() / (a.norm() * b.norm()));
}

}  // namespace

TEST_CASE_TEMPLATE("normals are as precise as a double eigensolver on the covariance", S, float,
                   double) {
  const char* set = std::getenv("CILANTRO_NEIGHBORHOODS");
  const index_t wanted = set ? std::atoll(set) : 10000;
  for (const kind& k : {kind{"flat", 1, 1, 1e-3, 1}, kind{"very flat", 1, 0.3, 1e-6, 0},
                        kind{"linear", 1, 1e-2, 1e-3, 0}, kind{"tiny", 1e-12, 1e-12, 1e-13, 0},
                        kind{"huge", 1e9, 1e9, 1e7, 0}, kind{"round", 1, 1, 0.7, 3}}) {
    CAPTURE(k.name);
    double ours = 0, theirs = 0, worst = 0, their_worst = 0;
    for (index_t done = 0; done < wanted; done += at_a_time) {
      const index_t count = std::min(at_a_time, wanted - done);
      const auto points = neighborhoods_of<S>(k, count, std::uint64_t(done));
      const auto found = estimate_normals(points, consecutive<S>(count));
      for (index_t n = 0; n < count; ++n) {
        const auto some = points.middleCols(n * members, members);
        const auto truth = least_direction<long double, long double>(some);
        // Rounded like ours.
        const Eigen::Matrix<long double, 3, 1> reference =
            least_direction<S, double>(some).template cast<S>().template cast<long double>();
        const Eigen::Matrix<long double, 3, 1> normal =
            found.normals.col(n * members).template cast<long double>();
        REQUIRE(normal.norm() > 0.5L);
        const double error = sine(normal, truth), reference_error = sine(reference, truth);
        ours += error;
        theirs += reference_error;
        worst = std::max(worst, error);
        their_worst = std::max(their_worst, reference_error);
      }
    }
    MESSAGE(k.name << ": mean " << ours / double(wanted) << " against " << theirs / double(wanted)
                   << ", worst " << worst << " against " << their_worst);
    // In double both are at the rounding of their covariances, which are not summed alike.
    const double allowed = std::is_same_v<S, float> ? 1.02 : 3;
    CHECK(ours <= allowed * theirs);
    CHECK(worst <= allowed * their_worst);
  }
}
