// SPDX-License-Identifier: MIT
export module cilantro.io:las;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.cloud;
import :file_options;

namespace cilantro {

/// A variable length record of a LAS file: a coordinate system, a description, or anything that
/// somebody has registered a number for. `data` is kept as it is.
export struct las_record {
  std::string user_id;               ///< Up to 16 characters, such as "LASF_Projection".
  std::uint16_t id = 0;              ///< Unique for that user.
  std::string description = {};      ///< Up to 32 characters.
  std::vector<std::byte> data = {};  ///< At most 65,535 bytes, unless `is_extended`.
  bool is_extended = false;          ///< Whether it stands behind the points, as LAS 1.4 allows.

  friend bool operator==(const las_record&, const las_record&) = default;
};

/// What a LAS or LAZ file says about its points.
export struct las_info {
  int version_major = 1, version_minor = 4;  ///< Such as 1 and 4.
  int point_format = 6;                      ///< From 0 to 10.
  bool is_compressed = false;                ///< Whether it is a LAZ file.
  std::uint64_t points = 0;                  ///< How many the file has.
  /// How many points are the first, second, … return of their pulse, as the file says.
  std::array<std::uint64_t, 15> points_by_return = {};
  std::uint16_t record_length = 30;  ///< Bytes per point, before compression.
  /// World coordinates are whole numbers × scale + offset.
  Eigen::Vector3d scale = Eigen::Vector3d::Constant(0.001);
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< See `scale`.
  /// The least and greatest coordinates, as the file says.
  Eigen::Vector3d lower = Eigen::Vector3d::Zero(), upper = Eigen::Vector3d::Zero();
  /// The number of the flight line, and bits: the lowest for times of the GPS instead of its week,
  /// 16 for a coordinate system as text.
  std::uint16_t file_source_id = 0, global_encoding = 0;
  std::array<std::byte, 16> project_id = {};  ///< As somebody chose it.
  std::string system_identifier = {},
              generating_software = {};     ///< Who made the points, and the file.
  int creation_day = 0, creation_year = 0;  ///< The day of the year, from 1; 0 if it is not known.
  std::vector<las_record> records = {};     ///< All variable length records.

  /// The record of that name and number, or null if there is none.
  [[nodiscard]] const las_record* find_record(std::string_view user_id, std::uint16_t id) const
      [[clang::lifetimebound]] {
    for (const auto& r : records)
      if (r.user_id == user_id && r.id == id) return &r;
    return nullptr;
  }
};

/// Options of `write_las`. What is not chosen is as in `like`, else as in the file that the cloud
/// was read from, which its comments tell, else as `write_las` says.
export struct las_write_options {
  /// The point format, from 0 to 10. Formats 0 to 3 make a file of version 1.2, 4 and 5 of version
  /// 1.3, others of version 1.4, unless `like` has a later one.
  std::optional<int> format = {};
  /// The step of coordinates, and what they are counted from. Coordinates are rounded to
  /// whole multiples of `scale`, and must lie within 2^31 of them around `offset`.
  std::optional<Eigen::Vector3d> scale = {}, offset = {};
  /// A file whose format, scale, offset, identifiers and records are taken over, such as
  /// `las_header("a.las")`.
  std::optional<las_info> like = {};
  /// Further records. They replace those of the same user and number.
  std::vector<las_record> records = {};
  task_monitor monitor = {};
};

/// Reads what a LAS or LAZ file of version 1.0 to 1.4 says about its points, and its records,
/// without reading points. Records of waveforms have no data. Throws `io_error`.
export [[nodiscard]] las_info las_header(const std::filesystem::path& path);
/// As above, from memory; errors refer to it as `name`.
export [[nodiscard]] las_info las_header(std::span<const std::byte> bytes,
                                         const std::filesystem::path& name = "memory");

/// Reads the points of a LAS file of version 1.0 to 1.4 in any point format, or of a LAZ file.
///
/// Every value of a point becomes an attribute: intensity, return_number, number_of_returns,
/// scan_direction, edge_of_flight_line, classification, synthetic, key_point, withheld, overlap,
/// scanner_channel, scan_angle (in degrees, float), user_data, point_source_id, gps_time,
/// near_infrared and wave_…, as far as the format has them. Extra bytes become attributes of their
/// names, with _ for white space, in their own types, or in double if they have a scale; those
/// that nothing describes become extra_bytes[0] and so on. Colours are of 16 bits, or, if none is
/// above 255 and the file is not of this library, of 8. In two dimensions, z is an attribute.
///
/// Coordinates that S would round get an origin, unless `origin_policy` is `none`. For float it is
/// the median of a thousand points, rounded to whole numbers, along axes where it is 10,000 or
/// more. For double it is the offset of the file, if the scale is too fine for double beside it.
///
/// Comments keep what `write_las` needs to write the cloud as the file was, also after steps: one
/// that begins with "cilantro las" tells version, format, scale and offset; one for each record of
/// a coordinate system holds its bytes, those that are no letters as %XX. All other records are in
/// `las_header`. A description of the file's area is a comment for each line.
///
/// Throws `io_error` with path and byte for a malformed or truncated file, and for more than 2^31 −
/// 1 points. Memory is bounded by the size of the file, whatever its header claims: for LAZ, which
/// packs equal points into nothing, to 4096 times that. On several threads.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_las(const std::filesystem::path& path,
                                         const read_options& options = {});

/// As above, from memory; errors refer to it as `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_las(std::span<const std::byte> bytes,
                                         const std::filesystem::path& name = "memory",
                                         const read_options& options = {});

/// Writes a LAS file, uncompressed. Attributes with the names that `read_las` gives are written
/// where the point format has a place for them, rounded to whole numbers where it holds such; an
/// intensity of fractions from 0 to 1 is multiplied by 65,535. All others, and normals, are
/// described and written as extra bytes. Comments are written as the description of the area.
///
/// If nothing chooses them, the format is 6, 7 with colours, or 8 with near_infrared. A format that
/// the cloud's comments tell is exchanged for the next that has place for colours and times. The
/// scale is the finest power of ten, but at most 0.001, with which the coordinates fit, and the
/// offset the middle of the points, rounded to whole numbers.
///
/// The file appears under its name when it is complete, as with `write_ply`. Throws `io_error`;
/// and `invalid_input` for mismatched sizes, for coordinates that are not finite or that the scale
/// cannot span, for a value that its place cannot hold, and for names of more than 32 bytes.
export template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_las(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const las_write_options& options = {});

struct write_las_tap {
  std::filesystem::path path;
  las_write_options options;

  static constexpr const char* name = "write_las";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
    requires(D == 2 || D == 3)
  void look(const point_cloud<S, D>& cloud) const {
    write_las(cloud, path, options);
  }
};
/// The step that writes the cloud to `path` and passes it on unchanged.
export [[nodiscard]] auto write_las(std::filesystem::path path, las_write_options options = {}) {
  return tap_step{write_las_tap{std::move(path), std::move(options)}};
}

}  // namespace cilantro
