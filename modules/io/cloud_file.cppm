// SPDX-License-Identifier: MIT
export module cilantro.io:cloud_file;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

/// The endings of files that `read_cloud` and `write_cloud` know, as a sentence for messages; the
/// former knows .npy and .bin as well.
export [[nodiscard]] std::string known_cloud_files();

/// Reads a cloud from a file whose ending says what it is: .ply, .pcd; .xyz, .txt, .asc, .csv and
/// .pts as text; .npy with a point a row, and .bin of four floats a point, x, y, z and intensity,
/// as in KITTI. Capital letters do as well. See `read_ply`, `read_pcd` and `read_text`.
/// Throws `io_error`, and `invalid_input` for another ending.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_cloud(const std::filesystem::path& path,
                                           const read_options& options = {});

/// Writes a cloud to a file whose ending says what it is, in the usual form of that format: binary
/// if it has one. See `write_ply`, `write_pcd`, `write_text` and `write_pts`.
/// Throws `io_error`, and `invalid_input` for another ending and what the format cannot hold.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_cloud(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
                 const task_monitor& monitor = {});

struct write_cloud_tap {
  std::filesystem::path path;
  task_monitor monitor;

  static constexpr const char* name = "write_cloud";
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_cloud(cloud, path, monitor);
  }
};
/// Writes the cloud to `path` and hands it on.
export [[nodiscard]] inline auto write_cloud(std::filesystem::path path,
                                             task_monitor monitor = {}) {
  return tap_step{write_cloud_tap{std::move(path), std::move(monitor)}};
}

}  // namespace cilantro
