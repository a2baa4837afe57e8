// SPDX-License-Identifier: MIT
export module cilantro.io:cloud_file;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

/// The file name extensions that `read_cloud` and `write_cloud` both support, as text for messages;
/// `read_cloud` also supports .laz, .e57, .ptx, .npy and .bin.
export [[nodiscard]] std::string known_cloud_files();

/// Reads a cloud from a file in the format of its extension: .ply and .pcd; .las and .laz; .e57 and
/// .ptx, the points of all scans; .xyz, .txt, .asc, .csv
/// and .pts as text; .npy with one point per row; and .bin with four floats per point, x, y, z and
/// intensity, as in KITTI. Case does not matter. See `read_ply`, `read_pcd`, `read_las`,
/// `read_e57`, `read_ptx` and `read_text`. Throws `io_error`, and `invalid_input` for another
/// extension.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_cloud(const std::filesystem::path& path,
                                           const read_options& options = {});

/// Writes a cloud to a file in the format of its extension, in binary form if the format has one.
/// See `write_ply`, `write_pcd`, `write_las`, `write_text` and `write_pts`. Throws `io_error`, and
/// `invalid_input` for another extension, or for data that the format cannot hold.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_cloud(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
                 const task_monitor& monitor = {});

struct write_cloud_tap {
  std::filesystem::path path;
  task_monitor monitor;

  static constexpr const char* name = "write_cloud";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_cloud(cloud, path, monitor);
  }
};
/// The step that writes the cloud to `path` and passes it on unchanged.
export [[nodiscard]] auto write_cloud(std::filesystem::path path, task_monitor monitor = {}) {
  return tap_step{write_cloud_tap{std::move(path), std::move(monitor)}};
}

}  // namespace cilantro
