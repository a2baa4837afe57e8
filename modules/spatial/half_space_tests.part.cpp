// SPDX-License-Identifier: MIT
//
// Which of many points are inside half-spaces, by the vector kernel.
module;
#include "spatial/kernels/inside_planes.hpp"
module cilantro.spatial:half_space_tests;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;

namespace cilantro {
namespace {

/// The most coordinates that the vector kernel takes.
constexpr index_t most_axes = 64;

}  // namespace

/// Writes 1 to `inside` for each finite point p with normal · (p + shift) <= offset for all
/// half-spaces, and otherwise 0. Normals are packed, one per column.
template <Scalar S>
void find_inside(points_view<S, dynamic> points, const Eigen::VectorXd& shift,
                 const Eigen::Ref<const Eigen::MatrixXd>& normals, const Eigen::VectorXd& offsets,
                 const execution& how, std::span<std::uint8_t> inside) {
  const index_t d = points.dimension();
  const detail::plane_list planes{normals.data(), offsets.data(), normals.cols(),
                                  static_cast<int>(d)};
  const auto kernel =
      detail::for_target(static_cast<int>(current_vector_target()),
                         []<detail::kernel_target V> { return detail::inside_planes_in<V, S>(); });
  parallel_blocks(points.size(), 4096, how, [&](index_t, index_t begin, index_t end) {
    if (d > 0 && d <= most_axes) {
      kernel(points.data() + begin * points.stride(), points.stride(), end - begin, shift.data(),
             planes, inside.data() + begin);
      return;
    }
    for (index_t i = begin; i < end; ++i) {
      inside[i] = is_finite(points[i]);
      for (index_t f = 0; f < planes.count && inside[i] != 0; ++f) {
        double sum = 0;
        for (index_t k = 0; k < d; ++k) sum += normals(k, f) * (double(points[i][k]) + shift[k]);
        inside[i] = sum <= offsets[f];
      }
    }
  });
}
template void find_inside(points_view<float, dynamic>, const Eigen::VectorXd&,
                          const Eigen::Ref<const Eigen::MatrixXd>&, const Eigen::VectorXd&,
                          const execution&, std::span<std::uint8_t>);
template void find_inside(points_view<double, dynamic>, const Eigen::VectorXd&,
                          const Eigen::Ref<const Eigen::MatrixXd>&, const Eigen::VectorXd&,
                          const execution&, std::span<std::uint8_t>);

}  // namespace cilantro
