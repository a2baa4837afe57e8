// SPDX-License-Identifier: MIT
//
// All that a picture shows, numbered, and what is nearest in its pixels. Internal.
module cilantro.visualization:drawing;

import cilantro.standard;
import cilantro.core;
import :canvas;
import :projector;
import :scene;

namespace cilantro {

/// What is nearest in a pixel: its depth, whose bits are ordered as it is, and then its number. The
/// smallest is seen, whichever thread comes first. Signed, as vectors compare.
using depth_and_number = std::int64_t;
constexpr depth_and_number nothing = std::numeric_limits<depth_and_number>::max();

inline depth_and_number key_of(float z, std::uint32_t number) {
  return static_cast<depth_and_number>(std::uint64_t{std::bit_cast<std::uint32_t>(z)} << 32 |
                                       number);
}
/// NaN of nothing.
inline float depth_of(depth_and_number key) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(key >> 32));
}

/// A batch of the scene, and the number of its first point, line or triangle.
template <class Batch>
struct numbered {
  const Batch* batch;
  const scene::layer* layer;
  index_t place;  ///< Among the batches of its kind in the layer.
  std::uint32_t first;
  batch_placement in_camera;
};

/// All that is drawn, by kind.
struct drawing {
  std::vector<numbered<point_batch>> points;
  std::vector<numbered<line_batch>> lines;
  std::vector<numbered<triangle_batch>> triangles;
  std::uint32_t first_line = 0, first_triangle = 0;  ///< Points have lower numbers.
  bool is_transparent = false;

  drawing(const scene& all, const projector& by) {
    std::uint64_t next = 0;
    const auto collect = [&](auto& into, auto batches, auto&& count) {
      for (const auto& layer : all.layers()) {
        if (layer.is_hidden) continue;
        index_t place = 0;
        for (const auto& batch : ((*layer.content).*batches)()) {
          into.push_back({&batch, &layer, place++, static_cast<std::uint32_t>(next),
                          batch_placement{by, batch.origin}});
          next += static_cast<std::uint64_t>(count(batch));
          is_transparent |= batch.opacity < 1;
        }
      }
      expects(next < std::numeric_limits<std::uint32_t>::max(),
              "render: there are more than 2^32 - 2 points, lines and triangles");
      return static_cast<std::uint32_t>(next);
    };
    first_line = collect(points, &canvas::points, [](const auto& b) { return b.points.cols(); });
    first_triangle =
        collect(lines, &canvas::lines, [](const auto& b) { return b.segments.cols(); });
    collect(triangles, &canvas::triangles, [](const auto& b) { return b.triangles.cols(); });
  }

  template <class Batch>
  static const numbered<Batch>& of(const std::vector<numbered<Batch>>& all, std::uint32_t number) {
    return *std::prev(std::ranges::upper_bound(all, number, {}, &numbered<Batch>::first));
  }
};

}  // namespace cilantro
