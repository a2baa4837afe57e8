// SPDX-License-Identifier: MIT
//
// What the reader and the writer of LAS share. Internal.
module;
#include "io/common/random_bytes.hpp"
#include "io/las/las_record.hpp"
module cilantro.io:las_file;

import cilantro.standard;
import cilantro.core;
import :las;

namespace cilantro {

/// A header, and where the points begin.
struct las_layout {
  las_info info;
  std::uint64_t points_at = 0;
  std::vector<las::extra_field> extras;
};

/// Throws `detail::failure`.
las_layout read_las_layout(const detail::random_bytes& file);

/// Is given `n` records from point `first` on; on several threads at once.
using record_visitor = std::function<void(std::uint64_t first, index_t n, const char* records)>;
/// At most so many at a time.
inline constexpr index_t most_records = 2048;

/// The records of all points as they are without compression.
class las_records {
 public:
  las_records() = default;
  las_records(const las_records&) = delete;
  las_records& operator=(const las_records&) = delete;
  virtual ~las_records() = default;

  /// Calls `visit` with the `count` records from `first` on. Throws `detail::failure`.
  virtual void visit(std::uint64_t first, std::uint64_t count, const task_monitor& monitor,
                     const record_visitor& visit) = 0;
  /// Points from all over the file that are found at once, at most a thousand, as records of which
  /// only the coordinates are there, `record_length` bytes apart.
  [[nodiscard]] virtual std::vector<char> sample() const = 0;
};

/// Of either kind of file. Throws `detail::failure` for counts that the file cannot hold.
std::unique_ptr<las_records> open_records(const detail::random_bytes& file,
                                          const las_layout& layout);
std::unique_ptr<las_records> open_compressed_records(const detail::random_bytes& file,
                                                     const las_layout& layout);

inline constexpr std::string_view las_spec = "LASF_Spec", las_projection = "LASF_Projection",
                                  laszip_user = "laszip encoded", library_name = "cilantro";
inline constexpr std::uint16_t extra_bytes_id = 4, text_area_id = 3, laszip_id = 22204,
                               wave_packets_id = 65535;

/// Whether a record says in which coordinate system the points are.
bool is_coordinate_system(const las_record& record);

/// The fields that a record of extra bytes describes. `room` is what there is for them in a point;
/// what is not described becomes fields of one byte.
std::vector<las::extra_field> extra_fields(const las_record* record, std::size_t room);

/// A name with _ for white space and what else no text holds.
std::string attribute_name(std::string_view name);

/// The comments of a cloud: what is known about the file, carried through steps, and its texts.
std::vector<std::string> las_comments(const las_info& info);
/// What such comments tell, and the other comments, which stay in `comments`.
struct las_hints {
  std::optional<las_info> info;  ///< Without records.
  std::vector<las_record> records;
};
las_hints take_las_hints(std::vector<std::string>& comments);

}  // namespace cilantro
