// SPDX-License-Identifier: MIT
#include "spatial/kernels/inside_planes.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

using numbers = vec<double, width>;

/// Coordinates beyond the third wait in memory.
constexpr int in_registers = 3;

template <class S, int Axes>
CILANTRO_ALWAYS_INLINE unsigned inside_of(const numbers (&place)[in_registers],
                                          const double (*more)[width], const plane_list& planes) {
  unsigned inside = 0xffff;
  const int axes = Axes == 0 ? planes.dimension : Axes;
  for (std::ptrdiff_t f = 0; f < planes.count && inside != 0; ++f) {
    const double* normal = planes.normals + f * axes;
    numbers sum = normal[0] * place[0];
    for (int d = 1; d < (Axes == 0 ? smaller(axes, in_registers) : Axes); ++d)
      sum += normal[d] * place[d];
    if constexpr (Axes == 0)
      for (int d = in_registers; d < axes; ++d)
        sum += normal[d] * load<numbers>(more[d - in_registers]);
    inside &= bits(sum <= planes.offsets[f]);
  }
  return inside;
}

template <class S, int Axes>
void find_inside(const S* points, std::ptrdiff_t stride, std::ptrdiff_t count, const double* shift,
                 const plane_list& planes, std::uint8_t* out) {
  constexpr int most_axes = Axes == 0 ? 64 : Axes;
  const int axes = Axes == 0 ? planes.dimension : Axes;
  alignas(64) double more[Axes == 0 ? most_axes : 1][width];
  for (std::ptrdiff_t begin = 0; begin < count; begin += width) {
    const int size = static_cast<int>(smaller<std::ptrdiff_t>(width, count - begin));
    numbers place[in_registers] = {};
    numbers difference = 0;
    if (Axes == 3 && stride == 3 && size == width) {
      vec<S, width> axis[3];
      load_by_axis(points + begin * 3, axis);
      for (int d = 0; d < 3; ++d) place[d] = convert<numbers>(axis[d]) + shift[d];
    } else {
      for (int d = 0; d < axes; ++d) {
        alignas(64) double row[width] = {};
        for (int i = 0; i < size; ++i)
          row[i] = static_cast<double>(points[(begin + i) * stride + d]) + shift[d];
        if (d < in_registers)
          place[d] = load<numbers>(row);
        else
          __builtin_memcpy(more[d - in_registers], row, sizeof row);
      }
    }
    for (int d = 0; d < (axes < in_registers ? axes : in_registers); ++d)
      difference += place[d] - place[d];
    for (int d = in_registers; d < axes; ++d)
      difference += load<numbers>(more[d - in_registers]) - load<numbers>(more[d - in_registers]);
    const unsigned inside = inside_of<S, Axes>(place, more, planes) & bits(difference == 0);
    for (int i = 0; i < size; ++i) out[begin + i] = (inside >> i) & 1;
  }
}

template <class S>
void find_inside_planes(const S* points, std::ptrdiff_t stride, std::ptrdiff_t count,
                        const double* shift, const plane_list& planes, std::uint8_t* out) {
  switch (planes.dimension) {
    case 2:
      return find_inside<S, 2>(points, stride, count, shift, planes, out);
    case 3:
      return find_inside<S, 3>(points, stride, count, shift, planes, out);
    default:
      return find_inside<S, 0>(points, stride, count, shift, planes, out);
  }
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S>
inside_planes<S>* inside_planes_in() {
  return find_inside_planes<S>;
}
template inside_planes<float>* inside_planes_in<this_target, float>();
template inside_planes<double>* inside_planes_in<this_target, double>();

}  // namespace cilantro::detail
