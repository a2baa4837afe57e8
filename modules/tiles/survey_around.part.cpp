// SPDX-License-Identifier: MIT
//
// The points of a survey around places that something else has: another survey, or a scan.
// Internal.
module;
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <vector>
module cilantro.tiles:survey_around;

import cilantro.core;
import cilantro.cloud;
import :communicator;
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

  /// The places, `Dim × N` and relative to `origin`, that may have points near them.
  [[nodiscard]] places_by_square by_square(const point_matrix<double, D>& places) const;
  /// Points of a cloud as places.
  [[nodiscard]] point_matrix<double, D> places_of(const point_cloud<S, D>& cloud) const {
    const point_vector<double, D> shift = cloud.full_origin() - origin();
    return cloud.points.template cast<double>().colwise() + shift;
  }

  /// The points after all steps that are in a square or within the distance of it, in the order of
  /// the whole.
  [[nodiscard]] point_cloud<S, D> around(const tile_key& square, const std::stop_token& stop) const;
  /// How many bytes the points around a square may take while they are worked on. Throws
  /// `invalid_input` if that is more than the memory.
  [[nodiscard]] std::uint64_t memory_around(const tile_key& square) const;
  /// The same of the square where a tile of another survey has its middle.
  [[nodiscard]] std::uint64_t memory_around(const tile_info& tile, double edge) const {
    return memory_around(tile_key{square_of((double(tile.x) + 0.5) * edge, survey_->edge),
                                  square_of((double(tile.y) + 0.5) * edge, survey_->edge)});
  }

  /// Calls `work(square, places)` for all squares, several at a time, as far as the memory without
  /// `reserved` bytes of it allows. Of ranks, each does some.
  void for_each_square(const places_by_square& squares,
                       const std::function<void(const tile_key&, const index_list&)>& work,
                       const task_monitor& monitor, std::uint64_t reserved = 0) const;

 private:
  [[nodiscard]] tile_info info_of(const tile_key& square) const;

  std::shared_ptr<const tile_survey<D>> survey_;
  std::vector<tile_step<S, D>> steps_;
  std::shared_ptr<const process_group> ranks_;
  double distance_, margin_;
};

}  // namespace cilantro
