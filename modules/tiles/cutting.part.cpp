// SPDX-License-Identifier: MIT
//
// Files into tiles, each file read once. Internal.
module;
#include <fcntl.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <stop_token>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>
module cilantro.tiles:cutting;

import cilantro.eigen;
import cilantro.core;
import cilantro.cloud;
import :survey;

namespace cilantro {

/// A file that has no name, for points of tiles until all of them are known.
class scratch_file {
 public:
  explicit scratch_file(const std::filesystem::path& folder);
  scratch_file(const scratch_file&) = delete;
  scratch_file& operator=(const scratch_file&) = delete;
  ~scratch_file();

  /// Where it ends.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  void append(const void* data, std::size_t bytes);
  /// May be called by several threads at once.
  void read(std::uint64_t at, void* data, std::size_t bytes) const;

 private:
  std::filesystem::path folder_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// The points of all tiles, in a scratch file.
template <Scalar S, int D>
class tile_cutter {
 public:
  /// Reads all files, and keeps what is in the tiles `wanted`. Memory: `piece` points at a time.
  tile_cutter(const tile_survey<D>& survey, const std::map<tile_key, index_t>& wanted,
              const std::filesystem::path& folder, index_t piece, const task_monitor& monitor);

  /// The points of a tile, in the order of the files but sorted into smaller squares.
  [[nodiscard]] point_cloud<S, D> tile(index_t number) const;

 private:
  struct chunk {
    std::uint64_t at = 0;
    index_t points = 0;
  };
  void keep(const point_cloud<S, D>& piece, const std::map<tile_key, index_t>& wanted);

  const tile_survey<D>& survey_;
  scratch_file file_;
  std::vector<std::vector<chunk>> chunks_;  ///< By the number of the tile.
};

/// Calls `f(data, bytes)` for the memory of each part of the points.
template <class Cloud, class F>
void for_each_part(Cloud& cloud, F f) {
  const auto matrix = [&](auto& m) {
    f(m.data(), static_cast<std::size_t>(m.size()) * sizeof(*m.data()));
  };
  matrix(cloud.points);
  matrix(cloud.normals);
  matrix(cloud.colors);
  for (auto& a : cloud.attributes)
    std::visit([&](auto& values) { f(values.data(), values.size() * sizeof(*values.data())); },
               a.values);
}

}  // namespace cilantro
