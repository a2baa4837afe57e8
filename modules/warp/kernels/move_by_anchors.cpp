// SPDX-License-Identifier: MIT
#include "warp/kernels/move_by_anchors.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

using numbers = vec<double, place_stride>;

template <class S>
void move(const anchored_points<S>& all, double* places, double* offsets) {
  for (std::ptrdiff_t i = 0; i < all.count; ++i) {
    const S* const p = all.points + all.indices[i] * all.stride;
    const double* const weights = all.weights + i * all.weight_stride;
    const double x = p[0], y = p[1], z = p[2];
    numbers place = 0;
    for (int k = 0; k < all.anchors; ++k) {
      const node_frame& node = all.frames[k];
      const numbers offset = load<numbers>(node.linear) * (x - node.before[0]) +
                             load<numbers>(node.linear + place_stride) * (y - node.before[1]) +
                             load<numbers>(node.linear + 2 * place_stride) * (z - node.before[2]);
      place += weights[k] * (offset + load<numbers>(node.after));
      if (offsets) store(offsets + (i * all.anchors + k) * place_stride, offset);
    }
    store(places + i * place_stride, place);
  }
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S>
move_by_anchors<S>* move_by_anchors_in() {
  return move<S>;
}
template move_by_anchors<float>* move_by_anchors_in<this_target, float>();
template move_by_anchors<double>* move_by_anchors_in<this_target, double>();

}  // namespace cilantro::detail
