// SPDX-License-Identifier: MIT
#include "registration/kernels/pair_graph.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

using lanes = vec<float, width>;
using whole = vec<std::int32_t, width>;
using direction = triple<lanes>;

CILANTRO_ALWAYS_INLINE direction at(const float* const* axes, std::ptrdiff_t j) {
  return {load<lanes>(axes[0] + j), load<lanes>(axes[1] + j), load<lanes>(axes[2] + j)};
}
CILANTRO_ALWAYS_INLINE direction all_at(const float* const* axes, std::ptrdiff_t i) {
  return {lanes(axes[0][i]), lanes(axes[1][i]), lanes(axes[2][i])};
}

/// Where two cosines differ too much; not where one is unknown.
CILANTRO_ALWAYS_INLINE whole differ(lanes a, lanes b, const pair_limits& limits) {
  if (!limits.oriented) {
    a = magnitude(a);
    b = magnitude(b);
  }
  return magnitude(a - b) > limits.cosine;
}

void row(const pair_list& pairs, const pair_limits& limits, std::ptrdiff_t i, std::ptrdiff_t words,
         std::uint64_t* bits_out) {
  const bool has_normals = pairs.source_normals[0] != nullptr;
  const direction source = all_at(pairs.source, i), target = all_at(pairs.target, i);
  const direction up{lanes(pairs.up[0]), lanes(pairs.up[1]), lanes(pairs.up[2])};
  for (std::ptrdiff_t word = 0; word < words; ++word) {
    std::uint64_t found = 0;
    for (int part = 0; part < 64; part += width) {
      const std::ptrdiff_t j = word * 64 + part;
      const direction in_source = at(pairs.source, j) - source;
      const direction in_target = at(pairs.target, j) - target;
      const lanes a = __builtin_elementwise_sqrt(dot(in_source, in_source));
      const lanes b = __builtin_elementwise_sqrt(dot(in_target, in_target));
      whole fit = (magnitude(a - b) <= limits.length) & (smaller(a, b) >= limits.least) &
                  (magnitude(dot(in_source, up) - dot(in_target, up)) <= limits.length);
      if (has_normals && bits(fit) != 0) {
        const direction n = all_at(pairs.source_normals, i), m = all_at(pairs.target_normals, i);
        const direction ns = at(pairs.source_normals, j), ms = at(pairs.target_normals, j);
        fit &= ~(differ(dot(n, in_source) / a, dot(m, in_target) / b, limits) |
                 differ(dot(ns, in_source) / a, dot(ms, in_target) / b, limits) |
                 differ(dot(n, ns), dot(m, ms), limits));
      }
      found |= std::uint64_t{bits(fit)} << part;
    }
    bits_out[word] = found;
  }
}

std::int64_t shared(const std::uint64_t* a, const std::uint64_t* b, std::ptrdiff_t words) {
  std::int64_t count = 0;
  for (std::ptrdiff_t w = 0; w < words; ++w) count += __builtin_popcountll(a[w] & b[w]);
  return count;
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V>
const pair_graph& pair_graph_in() {
  static constexpr pair_graph functions{row, shared};
  return functions;
}
template const pair_graph& pair_graph_in<this_target>();

}  // namespace cilantro::detail
