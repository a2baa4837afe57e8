// SPDX-License-Identifier: MIT
#include "geometry/kernels/plane_fit.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

constexpr int n = planes_at_a_time;
using planes = vec<double, n>;
using place = vec<double, 4>;

CILANTRO_ALWAYS_INLINE planes root(planes x) {
  return __builtin_elementwise_sqrt(x);
}

template <class S>
constexpr double epsilon = sizeof(S) == 4 ? 0x1p-23 : 0x1p-52;

/// Without a look at what lies behind the point.
CILANTRO_ALWAYS_INLINE place at(const float* p) {
  return convert<place>(vec<float, 4>{p[0], p[1], p[2], 0});
}
CILANTRO_ALWAYS_INLINE place at(const double* p) {
  return {p[0], p[1], p[2], 0};
}

using direction = triple<planes>;

/// Symmetric matrices.
struct matrices {
  planes xx, yy, zz, xy, yz, zx;

  [[nodiscard]] CILANTRO_ALWAYS_INLINE direction times(direction v) const {
    return {xx * v.x + xy * v.y + zx * v.z, xy * v.x + yy * v.y + yz * v.z,
            zx * v.x + yz * v.y + zz * v.z};
  }
  /// A vector that (this − λ) sends to nothing: the longest cross product of two of its columns.
  [[nodiscard]] CILANTRO_ALWAYS_INLINE direction null_vector(planes eigenvalue) const {
    const direction a{xx - eigenvalue, xy, zx}, b{xy, yy - eigenvalue, yz},
        c{zx, yz, zz - eigenvalue};
    direction longest = cross(a, b);
    planes most = dot(longest, longest);
    const direction others[] = {cross(b, c), cross(c, a)};
    for (const direction& next : others) {
      const planes length = dot(next, next);
      const auto is_longer = length > most;
      most = is_longer ? length : most;
      longest = choose(is_longer, next, longest);
    }
    const planes scale = most > 0 ? 1 / root(most) : planes(0);
    return longest * scale;
  }
};

/// The smallest eigenvalues of matrices with a trace of 1.
///
/// With B the deviation from a third of the identity, divided by its spread, they are 1/3 + 2 c
/// spread, where 4c³ − 3c = det B / 2 and −1 ≤ c ≤ −1/2 (Smith 1961). For c = −1/2 − s that is
/// s² (6 + 4s) = 1 − det B / 2: Newton's method, from a guess within a hundredth, takes four
/// steps to full precision, for small s as well.
CILANTRO_ALWAYS_INLINE planes smallest_eigenvalue(const matrices& m) {
  const planes third = 1.0 / 3;
  const planes x = m.xx - third, y = m.yy - third, z = m.zz - third;
  const planes off = m.xy * m.xy + m.yz * m.yz + m.zx * m.zx;
  const planes spread = root((x * x + y * y + z * z + 2 * off) / 6);
  const planes determinant =
      x * (y * z - m.yz * m.yz) - m.xy * (m.xy * z - m.yz * m.zx) + m.zx * (m.xy * m.yz - y * m.zx);
  planes half = determinant / (2 * spread * spread * spread);
  half = larger(smaller(half, planes(1)), planes(-1));
  const planes rest = 1 - half;
  planes s = larger(root(rest / 6) * (1 - 0.067 * rest), planes(1e-300));
  for (int i = 0; i < 4; ++i) s -= (s * s * (6 + 4 * s) - rest) / (12 * s * (1 + s));
  return third - 2 * spread * (0.5 + s);
}

struct least_directions {
  direction normal;
  planes smallest, second, largest;
};

/// The eigenvalue is off by up to √ε where the two smaller ones nearly meet; the Rayleigh quotient
/// of the first eigenvector squares that error, and the second eigenvector is good to rounding.
CILANTRO_ALWAYS_INLINE least_directions find_least(const matrices& m) {
  direction normal = m.null_vector(smallest_eigenvalue(m));
  planes smallest = dot(normal, m.times(normal));
  const direction refined = m.null_vector(smallest);
  normal = choose(dot(refined, refined) > 0, refined, normal);
  // If all extents are equal, any direction is as good.
  normal.z = dot(normal, normal) > 0 ? normal.z : planes(1);
  smallest = dot(normal, m.times(normal));
  // The other two, by their sum and their product; the smaller one without cancellation.
  const planes sum = 1 - smallest;
  const planes minors =
      (m.xx * m.yy - m.xy * m.xy) + (m.yy * m.zz - m.yz * m.yz) + (m.zz * m.xx - m.zx * m.zx);
  const planes product = minors - smallest * sum;
  const planes both = sum + root(larger(sum * sum - 4 * product, planes(0)));
  return {normal, smallest, 2 * product / both, both / 2};
}

/// What is summed up over a neighbourhood: differences from its first member, which are as large as
/// its extent, so that one pass loses little.
struct sums {
  alignas(64) double first[3][n] = {}, mean[3][n] = {}, squares[3][n] = {}, products[3][n] = {},
                     count[n] = {};

  template <class S>
  CILANTRO_ALWAYS_INLINE void add(int lane, const plane_members<S>& members) {
    const std::int32_t* const indices = members.indices[lane];
    const auto member = [&](std::int32_t i) {
      return at(members.points + std::ptrdiff_t{indices[i]} * members.stride);
    };
    const place origin = member(0);
    place sum = 0, square = 0, product = 0;
    for (std::int32_t i = 1; i < members.counts[lane]; ++i) {
      const place d = member(i) - origin;
      sum += d;
      square += d * d;
      product += d * __builtin_shufflevector(d, d, 1, 2, 0, 3);
    }
    count[lane] = members.counts[lane];
    for (int k = 0; k < 3; ++k) {
      first[k][lane] = origin[k];
      mean[k][lane] = sum[k] / count[lane];
      squares[k][lane] = square[k];
      products[k][lane] = product[k];
    }
  }
};

/// Points on a line scatter around it by the rounding of their coordinates, and no less: a
/// neighbourhood is a plane if its second extent is more than that.
template <class S>
void fit(const plane_members<S>& members, fitted_planes& out) {
  sums all;
  for (int lane = 0; lane < n; ++lane)
    if (members.counts[lane] > 0) all.add(lane, members);
  const auto row = [](const double (&values)[n]) { return load<planes>(values); };
  const direction mean{row(all.mean[0]), row(all.mean[1]), row(all.mean[2])};
  const planes count = row(all.count);
  matrices scatter{row(all.squares[0]) - count * mean.x * mean.x,
                   row(all.squares[1]) - count * mean.y * mean.y,
                   row(all.squares[2]) - count * mean.z * mean.z,
                   row(all.products[0]) - count * mean.x * mean.y,
                   row(all.products[1]) - count * mean.y * mean.z,
                   row(all.products[2]) - count * mean.z * mean.x};
  const planes total = scatter.xx + scatter.yy + scatter.zz;

  const planes far =
      larger(magnitude(row(all.first[0]) + mean.x),
             larger(magnitude(row(all.first[1]) + mean.y), magnitude(row(all.first[2]) + mean.z)));
  const planes rounding = epsilon<S> * (far + root(total / count));
  const planes noise = 4 * count * rounding * rounding;

  const planes scale = 1 / total;
  const least_directions least =
      find_least({scatter.xx * scale, scatter.yy * scale, scatter.zz * scale, scatter.xy * scale,
                  scatter.yz * scale, scatter.zx * scale});
  const auto is_determined = (count >= 3) & (total > 0) & (total < __builtin_inf()) &
                             (least.second * total > 3 * (1e-14 * least.largest * total + noise));
  store(out.normals[0], least.normal.x);
  store(out.normals[1], least.normal.y);
  store(out.normals[2], least.normal.z);
  store(out.curvatures, larger(least.smallest, planes(0)));
  for (int lane = 0; lane < n; ++lane) out.are_determined[lane] = is_determined[lane] != 0;
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S>
plane_fit<S>* plane_fit_in() {
  return fit<S>;
}
template plane_fit<float>* plane_fit_in<this_target, float>();
template plane_fit<double>* plane_fit_in<this_target, double>();

}  // namespace cilantro::detail
