// SPDX-License-Identifier: MIT
//
// What is known of a cloud in files. Internal.
module;
#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>
module cilantro.tiles:survey;

import cilantro.core;
import cilantro.cloud;
import :tiled_cloud;

namespace cilantro {

/// How many consecutive points of a file share a box.
constexpr index_t points_of_a_run = 4096;

/// A box that grows; that of no points is empty.
template <int D>
struct extent {
  std::array<double, D> lower, upper;

  extent() {
    lower.fill(std::numeric_limits<double>::infinity());
    upper.fill(-std::numeric_limits<double>::infinity());
  }
  [[nodiscard]] bool empty() const { return lower[0] > upper[0]; }
  template <class P>
  void add(const P& point) {
    for (int d = 0; d < D; ++d) {
      lower[d] = std::min(lower[d], point[d]);
      upper[d] = std::max(upper[d], point[d]);
    }
  }
  void add(const extent& other) {
    for (int d = 0; d < D; ++d) {
      lower[d] = std::min(lower[d], other.lower[d]);
      upper[d] = std::max(upper[d], other.upper[d]);
    }
  }
};

/// Which square a place lies in.
struct tile_key {
  std::int64_t x = 0, y = 0;
  friend auto operator<=>(const tile_key&, const tile_key&) = default;
};

/// The square of a coordinate. Precondition: it is finite, and less than 2⁶² edges away from 0.
inline std::int64_t square_of(double coordinate, double edge) {
  return static_cast<std::int64_t>(std::floor(coordinate / edge));
}
template <class P>
tile_key key_of(const P& place, double edge) {
  return {square_of(place[0], edge), square_of(place[1], edge)};
}

/// How many points lie in each square that has some.
using square_counts = std::map<tile_key, std::uint64_t>;

/// Consecutive points of a file, and the box of those that are finite.
template <int D>
struct point_run {
  std::uint32_t count = 0;
  extent<D> box;
};

template <int D>
struct survey_file {
  std::filesystem::path path;
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;  ///< As its clock counts; 0 if that does not matter.
  std::uint64_t points = 0;
  square_counts squares;
  std::vector<point_run<D>> runs;
};

/// What the points of a survey have beside their coordinates.
struct point_parts {
  bool normals = false, colors = false;
  std::vector<std::pair<std::string, std::size_t>> attributes;  ///< Names, and which type.
  std::vector<std::string> comments;
};

template <int D>
struct tile_survey {
  std::vector<survey_file<D>> files;
  double edge = 0;
  std::uint64_t memory = 0, points = 0;
  int threads = 0;
  point_vector<double, D> origin = point_vector<double, D>::Zero();
  extent<D> bounds;
  std::vector<tile_info> tiles;
  point_parts parts;
  /// Whether the files hold points that were put aside, of which all digits are kept: coordinates
  /// without the origin, colours that were not rounded, and places, if they are known.
  bool is_local = false;

  /// What rounding of coordinates, which are kept as an S relative to the origin, may amount to,
  /// generously.
  template <Scalar S>
  [[nodiscard]] double slack() const {
    double most = 0, kept = 0;
    for (int d = 0; d < D && !bounds.empty(); ++d)
      for (const double bound : {bounds.lower[d], bounds.upper[d]}) {
        most = std::max(most, std::abs(bound));
        kept = std::max(kept, std::abs(bound - origin[d]));
      }
    return most * 0x1p-48 + kept * 8 * double(std::numeric_limits<S>::epsilon());
  }
};

/// A place in world coordinates.
template <Scalar S, int D, class P>
point_vector<double, D> world_of(const P& point, const point_vector<double, D>& origin) {
  return point.template cast<double>() + origin;
}

/// Where the points of `cloud` are once they are written, with or without the origin, and read
/// again.
template <Scalar S, int D>
void describe_points(const point_cloud<S, D>& cloud, double edge, bool is_local,
                     survey_file<D>& file);

/// Fills `tiles`, `bounds` and `points` by what the files are.
template <int D>
void join_files(tile_survey<D>& survey);

/// Throws `io_error` if a file is not what it was when it was opened.
template <int D>
void expect_unchanged(const survey_file<D>& file);

/// A piece of a file with the parts that all clouds of the survey have. Throws `io_error` if it
/// lacks some of them.
template <Scalar S, int D>
void conform(point_cloud<S, D>& piece, const point_parts& parts, const std::filesystem::path& path);
template <Scalar S, int D>
point_parts parts_of(const point_cloud<S, D>& cloud);

/// `count` values of type number `type` of those that an attribute can have.
attribute_values values_of_type(std::size_t type, index_t count);

/// How many bytes a point may take while it is worked on.
template <Scalar S, int D>
double bytes_per_point(const point_parts& parts);

}  // namespace cilantro
