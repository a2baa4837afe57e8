// SPDX-License-Identifier: MIT
export module cilantro.io:cloud_reader;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

template <Scalar S, int D>
class cloud_source;

/// Reads a file in pieces, for clouds that are larger than memory:
/// `while (!(piece = reader.read(1'000'000)).empty()) …`
///
/// The formats are those of `read_cloud`. Pieces joined give what `read_cloud` gives, except that
/// what is guessed from the numbers (the origin, the unit of colours, the columns of a text) is
/// guessed from the first piece, or, if reading does not begin at the front, from the first 65,536
/// points, and kept; the first piece of a text should not be small. Files of PLY, PCD, LAS, LAZ and
/// text, and those of KITTI, are read piece by piece; compressed PCD, E57, PTX and NPY as a whole.
/// `width` and `height` are not kept.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
class cloud_reader {
 public:
  /// Opens a file, and reads its header. Throws as `read_cloud` does.
  explicit cloud_reader(std::filesystem::path path, const read_options& options = {});
  cloud_reader(cloud_reader&&) noexcept;
  cloud_reader& operator=(cloud_reader&&) noexcept;
  ~cloud_reader();

  /// The next points, up to `count` of them, which must be positive; an empty cloud at the end.
  /// Throws `io_error` for a file that is malformed or truncated.
  [[nodiscard]] point_cloud<S, D> read(index_t count);
  /// How many points the file has; nothing for a text, of which only reading it tells.
  [[nodiscard]] std::optional<std::uint64_t> size() const;
  /// Makes point `first` the next one that is read; the end, if there are no more than that. Takes
  /// no time for files of records of one size; of others, what comes before is read again.
  void seek(std::uint64_t first);
  /// Makes this the origin of all pieces from now on, in world coordinates.
  void set_origin(const point_vector<double, D>& origin);

 private:
  std::filesystem::path path_;
  read_options options_;
  std::unique_ptr<cloud_source<S, D>> source_;
  std::optional<point_vector<double, D>> origin_;
  std::uint64_t next_ = 0;
};

#define CILANTRO_COMPILED_ELSEWHERE(S, D) extern template class cloud_reader<S, D>;
CILANTRO_COMPILED_ELSEWHERE(float, 2)
CILANTRO_COMPILED_ELSEWHERE(float, 3)
CILANTRO_COMPILED_ELSEWHERE(double, 2)
CILANTRO_COMPILED_ELSEWHERE(double, 3)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
