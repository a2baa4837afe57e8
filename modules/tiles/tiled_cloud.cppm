// SPDX-License-Identifier: MIT
export module cilantro.tiles:tiled_cloud;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.geometry;
import cilantro.cloud;
import :communicator;
import :tile_step;

namespace cilantro {

export inline namespace literals {
  /// Numbers of bytes: `4_GB` is 4·10⁹.
  [[nodiscard]] consteval std::uint64_t operator""_GB(unsigned long long count) {
    return count * 1'000'000'000;
  }
  /// As above: `500_MB` is 5·10⁸.
  [[nodiscard]] consteval std::uint64_t operator""_MB(unsigned long long count) {
    return count * 1'000'000;
  }
}  // namespace literals

/// Options of `open_tiles`.
export struct tile_options {
  /// The edge of a tile, in the units of the points. 0: that with which the folder was written, or
  /// else one such that tiles fit the memory.
  double edge = 0;
  /// How many bytes the work on all tiles together may take. 0: half of what the machine has.
  std::uint64_t memory = 0;
  int threads = 0;            ///< How many tiles at a time, at most, and how many threads in all.
  task_monitor monitor = {};  ///< Watches opening.
};

/// What is known about a tile before it is loaded.
export struct tile_info {
  /// The tile has the points whose first two coordinates lie in [x·edge, (x + 1)·edge) and [y·edge,
  /// (y + 1)·edge), in world coordinates.
  std::int64_t x = 0, y = 0;
  std::uint64_t points = 0;  ///< How many points of the files are in it.
};

template <int D>
struct tile_survey;

/// A cloud in files that is never loaded as a whole: it knows where its points are, and which steps
/// it will be sent through. Cheap to copy.
///
/// Its points are those of its files, one file after the other, without those that are not finite.
/// They are processed in tiles: squares of the first two coordinates, and all of the third. Steps
/// see a tile together with as much of its surroundings as they reach, so that **the result has the
/// same bits as that of the whole cloud**, whatever the tiles; only its order is by tile. (Normals
/// of the whole by a radius, or by more than 64 neighbours, must be summed up `.ascending`.)
///
/// What the points have beside their coordinates is what the first file has; a file that lacks some
/// of it is an error when it is read, and what it has more is left out.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
class tiled_cloud {
 public:
  using scalar = S;
  static constexpr int static_dimension = D;

  tiled_cloud(std::shared_ptr<const tile_survey<D>> survey, std::vector<tile_step<S, D>> steps,
              std::shared_ptr<const process_group> ranks = nullptr);

  /// How many points there are in the files, before any step.
  [[nodiscard]] std::uint64_t size() const;
  /// The smallest box with all points that are finite, in world coordinates. Throws `invalid_input`
  /// if there are none.
  [[nodiscard]] box bounds() const;
  /// The edge of a tile.
  [[nodiscard]] double edge() const;
  /// What points are relative to in all clouds that come out of it, unless steps move them.
  [[nodiscard]] point_vector<double, D> origin() const;
  /// The tiles that may have points after all steps, by x, then y: also those that have none in the
  /// files, but as near as steps look, which may put the mean of points there.
  [[nodiscard]] const std::vector<tile_info>& tiles() const [[clang::lifetimebound]];
  /// The files, in their order.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;

  /// The same cloud for all ranks of a job, who divide the tiles among themselves where they are
  /// written or visited; each opens the same files with the same options, and has the memory that
  /// these say for itself. Results have the same bits for any number of ranks. If a rank fails, all
  /// throw. `ranks` must outlive the result and all that is made of it.
  template <Communicator C>
  [[nodiscard]] tiled_cloud on(C& ranks [[clang::lifetimebound]]) const {
    return {survey_, steps_, std::make_shared<const process_group>(group_of(ranks))};
  }

  /// All points after all steps, in one cloud, in the order of the tiles; they must fit into
  /// memory.
  [[nodiscard]] point_cloud<S, D> read() const;
  /// One tile after all steps. Where a step needs a limit that all points decide, each call
  /// computes it. Throws `invalid_input` for a number that is out of range.
  [[nodiscard]] point_cloud<S, D> read_tile(index_t number) const;
  /// The points of the files in a region of the first two coordinates, before any step, in the
  /// order of the files.
  [[nodiscard]] point_cloud<S, D> read_box(const box& region) const;

  /// What it is made of. Internal.
  [[nodiscard]] const std::shared_ptr<const tile_survey<D>>& survey() const { return survey_; }
  [[nodiscard]] const std::vector<tile_step<S, D>>& steps() const { return steps_; }
  [[nodiscard]] const std::shared_ptr<const process_group>& ranks() const { return ranks_; }

 private:
  std::shared_ptr<const tile_survey<D>> survey_;
  std::vector<tile_step<S, D>> steps_;
  std::shared_ptr<const process_group> ranks_;
};

template <Scalar S, int D>
inline constexpr bool takes_steps_itself<tiled_cloud<S, D>> = true;

/// Opens clouds in files, without loading them: a folder that `write_tiles` has written; or files
/// of any format of `read_cloud`, by a path, a folder with such files, or a pattern of their names
/// (not of their folders) with `*` and `?`, in the order of their names. Of a folder whose writing
/// was interrupted, that is the tiles that are there.
///
/// Of a written folder the index is read. Other files are read once from front to back, to know
/// where runs of 4096 points lie. Points that are close in a file should be close in space, as they
/// are in tiles and, more or less, in scans; other files are cut first:
/// `open_tiles<float>("scan.ply") | write_tiles("tiles")`.
///
/// Throws `io_error` for a file that cannot be read, and `invalid_input` if there is no file, for a
/// negative or infinite edge, and for one with which there are more than 10 million tiles. A tile
/// that needs more than `memory` is an `invalid_input` where it is to be worked on. Memory: about
/// 20 bytes per 1000 points.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] tiled_cloud<S, D> open_tiles(const std::filesystem::path& files,
                                           const tile_options& options = {});
/// As above, of these files in this order.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] tiled_cloud<S, D> open_tiles(std::span<const std::filesystem::path> files,
                                           const tile_options& options = {});

template <Scalar S, int D>
void expect_steps_on_tiles(const std::vector<tile_step<S, D>>& steps);
/// Decides which points of the files the steps keep that choose by places. Throws `invalid_input`
/// where places are not known.
template <Scalar S, int D>
void decide_places(const tile_survey<D>& survey, std::vector<tile_step<S, D>>& steps);

/// Adds a step, or a pipeline of steps, that each tile is sent through, once its result is asked
/// for. Each step must say how far it looks: see `SaysReach`. Throws `invalid_input` for a step
/// that looks at the whole cloud, for one that writes to something that tiles would share, for one
/// that looks around after one that has moved points, and for one that chooses points by their
/// places in the order of the whole where one before it removes some or some are not finite.
export template <Scalar S, int D, class Step>
  requires(!requires(const Step& sink, const tiled_cloud<S, D>& all) { sink.take(all); })
[[nodiscard]] tiled_cloud<S, D> operator|(const tiled_cloud<S, D>& cloud, const Step& step) {
  auto steps = cloud.steps();
  add_tile_steps(steps, step);
  expect_steps_on_tiles<S, D>(steps);
  decide_places<S, D>(*cloud.survey(), steps);
  return {cloud.survey(), std::move(steps), cloud.ranks()};
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D) extern template class tiled_cloud<S, D>;
CILANTRO_COMPILED_ELSEWHERE(float, 2)
CILANTRO_COMPILED_ELSEWHERE(float, 3)
CILANTRO_COMPILED_ELSEWHERE(double, 2)
CILANTRO_COMPILED_ELSEWHERE(double, 3)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
