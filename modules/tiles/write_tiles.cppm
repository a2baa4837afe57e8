// SPDX-License-Identifier: MIT
export module cilantro.tiles:write_tiles;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :tiled_cloud;

namespace cilantro {

/// Options of `write_tiles`.
export struct write_tiles_options {
  /// The format of the tiles: `.ply` or `.pcd`.
  std::string format = ".ply";
  /// Whether to go on where a run on the same files with the same steps was interrupted: tiles that
  /// are done are kept. The steps must have the same parameters, of which their names, their
  /// reaches, and what `distances_to` and those that choose by place are given can be checked; the
  /// files must have the same names, sizes and times. A folder that is complete is returned as it
  /// is. Without it, an unfinished folder with tiles is refused.
  bool resume = false;
  /// `stop` is looked at between tiles; what has been written then can be resumed.
  task_monitor monitor = {};
};

/// Sends each tile through the steps of `cloud` and writes the result, if there are points in it,
/// to a file of its own in `folder`; then an index, which makes the folder complete. Returns the
/// folder, opened as the cloud was.
///
/// Without steps, the files are cut into tiles: each is read once, whatever the order of its
/// points. Points keep their order, except that those of a tile are sorted into 16 × 16 squares.
///
/// The folder must not exist or be empty, unless a run is resumed, or has not finished a single
/// tile, which is then begun anew. No file appears under its name before it is complete, and no
/// index before all tiles are. If anything fails, what has been written stays, and can be resumed.
/// Tiles are processed in parallel, as many at a time as fit the memory of the cloud's options.
/// Throws `io_error`, `cancelled`, what steps throw, and
/// `invalid_input` for another format or a folder that is not empty. Files on disk beside the
/// result: when cutting, one of the size of the points.
export template <Scalar S, int D>
tiled_cloud<S, D> write_tiles(const tiled_cloud<S, D>& cloud, const std::filesystem::path& folder,
                              const write_tiles_options& options = {});

/// What `write_tiles(folder)` returns, to stand behind `|`.
export struct write_tiles_sink {
  std::filesystem::path folder;  ///< Where the tiles go.
  write_tiles_options options;   ///< How they are written.

  /// Writes the tiles of `cloud`.
  template <Scalar S, int D>
  tiled_cloud<S, D> take(const tiled_cloud<S, D>& cloud) const {
    return write_tiles(cloud, folder, options);
  }
};
/// `cloud | write_tiles(folder)` is `write_tiles(cloud, folder)`.
export [[nodiscard]] inline auto write_tiles(std::filesystem::path folder,
                                             write_tiles_options options = {}) {
  return write_tiles_sink{std::move(folder), std::move(options)};
}
export template <Scalar S, int D>
tiled_cloud<S, D> operator|(const tiled_cloud<S, D>& cloud, const write_tiles_sink& sink) {
  return sink.take(cloud);
}

}  // namespace cilantro
