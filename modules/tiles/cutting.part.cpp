// SPDX-License-Identifier: MIT
//
// Files into tiles, each file read once. Internal.
module;
#include <fcntl.h>
#include <unistd.h>
#include <cerrno>
module cilantro.tiles:cutting;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.cloud;
import :communicator;
import :survey;

namespace cilantro {

/// A file for points of tiles until all of them are known. Whoever does not append to it reads it.
class scratch_file {
 public:
  scratch_file(const std::filesystem::path& path, bool is_new);
  scratch_file(const scratch_file&) = delete;
  scratch_file& operator=(const scratch_file&) = delete;
  ~scratch_file();

  /// Where it ends.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  void append(const void* data, std::size_t bytes);
  /// May be called by several threads at once.
  void read(std::uint64_t at, void* data, std::size_t bytes) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// The points of all tiles, in a scratch file of each rank.
template <Scalar S, int D>
class tile_cutter {
 public:
  /// Reads all files, each by one rank, and keeps what is in the tiles `wanted`. Memory: `piece`
  /// points at a time.
  tile_cutter(const tile_survey<D>& survey, const process_group* ranks,
              const std::map<tile_key, index_t>& wanted, const std::filesystem::path& folder,
              index_t piece, const task_monitor& monitor);
  ~tile_cutter();

  /// The points of a tile, in the order of the files but sorted into smaller squares.
  [[nodiscard]] point_cloud<S, D> tile(index_t number) const;

 private:
  /// Points of a tile that follow each other in a file.
  struct chunk {
    index_t tile = 0, file = 0;
    std::uint64_t at = 0;
    index_t points = 0;
    std::int64_t rank = 0;
  };
  void read_files(const std::map<tile_key, index_t>& wanted, index_t piece,
                  const task_monitor& monitor);
  void keep(const point_cloud<S, D>& piece, index_t file,
            const std::map<tile_key, index_t>& wanted);
  void share_chunks();
  [[nodiscard]] std::filesystem::path scratch_of(int rank) const;

  const tile_survey<D>& survey_;
  const process_group* ranks_;
  std::filesystem::path folder_;
  std::vector<std::unique_ptr<scratch_file>> scratch_;  ///< By rank.
  std::vector<chunk> chunks_;                           ///< By tile, then by file.
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
