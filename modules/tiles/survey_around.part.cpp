// SPDX-License-Identifier: MIT
//
// The points of a survey around places that something else has: another survey, or a scan.
// Internal.
module cilantro.tiles:survey_around;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :communicator;
import :reduce_tiles;
import :survey;
import :tile_step;
import :tiled_cloud;

namespace cilantro {

/// Which places lie in each square.
using places_by_square = std::map<tile_key, index_list>;

/// A survey that is asked, square by square, for all points that may be within a distance of places
/// in that square. Squares are only how it is read: no result depends on them.
template <Scalar S, int D>
class survey_around {
 public:
  /// Squares are those of the tiles of `cloud`, or parts of them about as wide as `edge`. Decides
  /// the limits of its steps, which may take passes over it; with ranks, collective. Throws
  /// `invalid_input` if a step moves points.
  survey_around(const tiled_cloud<S, D>& cloud, double edge, double distance, const char* who,
                const task_monitor& monitor);

  /// What points and places are relative to.
  [[nodiscard]] const point_vector<double, D>& origin() const { return survey_->origin; }
  [[nodiscard]] double distance() const { return distance_; }
  /// How many bytes the work may take.
  [[nodiscard]] std::uint64_t memory() const { return survey_->memory; }
  /// The ranks that the survey is shared among, or null.
  [[nodiscard]] const process_group* ranks() const { return ranks_.get(); }

  /// The places, `Dim × N` and relative to `origin`, that may have points near them. Those beyond
  /// the bounds of the survey are in the square that is nearest.
  [[nodiscard]] places_by_square by_square(const point_matrix<double, D>& places) const;
  /// Points of a cloud as places.
  [[nodiscard]] point_matrix<double, D> places_of(const point_cloud<S, D>& cloud) const {
    const point_vector<double, D> shift = cloud.full_origin() - origin();
    return cloud.points.template cast<double>().colwise() + shift;
  }

  /// The points after all steps that are in a square or within the distance of it, in the order of
  /// the whole.
  [[nodiscard]] point_cloud<S, D> around(const tile_key& square, const std::stop_token& stop) const;
  /// How many bytes the points around a square may take while they are worked on, if those of each
  /// run are spread evenly over its box. Throws `invalid_input` if that is more than the memory.
  [[nodiscard]] std::uint64_t memory_around(const tile_key& square) const;
  /// The most that those around one of the squares take that places of an area may be in; or,
  /// without an area, places anywhere.
  [[nodiscard]] std::uint64_t memory_around(const std::optional<tile_area>& area) const;

  /// The same for the points of a tile of a cloud after its steps.
  [[nodiscard]] std::uint64_t memory_around(const tiled_cloud<S, D>& cloud,
                                            const tile_info& tile) const {
    if (std::ranges::any_of(cloud.steps(), &tile_step<S, D>::moves_points))
      return memory_around(std::optional<tile_area>{});
    return memory_around(std::optional{area_of(tile, cloud.edge())});
  }

  /// Calls `work(square, places)` for all squares, several at a time, as far as the memory without
  /// `reserved` bytes of it allows. Of ranks, each does some.
  void for_each_square(const places_by_square& squares,
                       const std::function<void(const tile_key&, const index_list&)>& work,
                       const task_monitor& monitor, std::uint64_t reserved = 0) const;

 private:
  [[nodiscard]] tile_info info_of(const tile_key& square) const;
  [[nodiscard]] std::uint64_t most_memory(const tile_area& area) const;
  [[nodiscard]] std::uint64_t estimate_around(const tile_key& square) const;

  std::shared_ptr<const tile_survey<D>> survey_;
  std::vector<tile_step<S, D>> steps_;
  std::shared_ptr<const process_group> ranks_;
  double distance_, margin_;
  mutable std::once_flag is_known_anywhere_;
  mutable std::uint64_t memory_anywhere_ = 0;
  mutable std::mutex mutex_;
  mutable std::map<tile_key, std::uint64_t> known_memory_;
};

/// Adds up what `visit(square, places, sums)` adds to sums for each square, as `for_each_square`
/// goes through them.
template <TileSum T, Scalar S, int D, class F>
std::vector<T> sum_over_squares(const survey_around<S, D>& target, const places_by_square& squares,
                                const std::vector<T>& zeros, const task_monitor& monitor,
                                std::uint64_t reserved, F visit) {
  auto sums = zeros;
  std::mutex mutex;
  target.for_each_square(
      squares,
      [&](const tile_key& square, const index_list& indices) {
        auto found = zeros;
        visit(square, indices, found);
        const std::scoped_lock lock{mutex};
        for (std::size_t s = 0; s < sums.size(); ++s) sums[s] += found[s];
      },
      monitor, reserved);
  add_up_over_ranks(target.ranks(), sums);
  return sums;
}

}  // namespace cilantro
