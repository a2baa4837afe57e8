// SPDX-License-Identifier: MIT
module;
#include <cctype>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_source;
import :file_ending;
import :file_scope;

namespace cilantro {
namespace {

/// The usual names of the columns of an array: coordinates, then an intensity, or others.
template <int D>
std::vector<file_field> usual_fields(index_t columns, detail::number type) {
  std::vector<file_field> fields;
  for (const char* axis : {"x", "y", "z"})
    if (std::ssize(fields) < D) fields.push_back({axis, type});
  if (columns == D + 1) fields.push_back({"intensity", type});
  while (std::ssize(fields) < columns)
    fields.push_back({"column_" + std::to_string(fields.size() + 1), type});
  return fields;
}

/// A point from each row of an array.
template <Scalar S, int D>
point_cloud<S, D> read_rows(const std::filesystem::path& path, const read_options& options) {
  const auto rows = read_matrix<double>(path, options.monitor);
  if (rows.cols() < D || rows.cols() > 4096 ||
      rows.rows() > std::numeric_limits<std::int32_t>::max())
    throw io_error{path, "each row must hold the " + std::to_string(D) +
                             " coordinates of a point, or more, but the array is " +
                             std::to_string(rows.rows()) + " x " + std::to_string(rows.cols())};
  const auto fields = usual_fields<D>(rows.cols(), detail::number::float64);
  cloud_builder<S, D> builder{fields, options.origin};
  builder.resize(rows.rows());
  for (index_t c = 0; c < rows.cols() && rows.rows() > 0; ++c)
    builder.store_column(static_cast<std::size_t>(c), 0, rows.rows(),
                         reinterpret_cast<const char*>(&rows(0, c)), sizeof(double), false);
  return builder.finish({});
}

/// Floats x, y, z and an intensity for each point, in the byte order of nearly all machines, and
/// nothing else: the scans of KITTI.
template <Scalar S, int D>
class raw_source : public cloud_source<S, D> {
 public:
  raw_source(const std::filesystem::path& path, const read_options& options)
      : file_{path}, options_{options} {
    auto& in = file_.stream();
    if (in.size() % record != 0)
      in.fail_at_byte("the file has " + std::to_string(in.size()) +
                      " bytes, and a point of four floats takes 16");
    count_ = in.size() / record;
  }

  [[nodiscard]] std::optional<std::uint64_t> size() const override { return count_; }
  point_cloud<S, D> read(index_t most) override {
    const std::uint64_t done = count_ - file_.stream().remaining() / record;
    const auto n = static_cast<index_t>(std::min(static_cast<std::uint64_t>(most), count_ - done));
    cloud_builder<S, D> builder{usual_fields<D>(4, detail::number::float32), options_.origin};
    builder.agree_with(this->agreement());
    builder.resize(n);
    for (index_t first = 0; first < n; first += piece) {
      watch(options_.monitor, double(done) + double(first), double(count_));
      const index_t some = std::min<index_t>(piece, n - first);
      const char* data = file_.stream().take(static_cast<std::size_t>(some) * record);
      for (std::size_t c = 0; c < 4; ++c)
        builder.store_column(c, first, some, data + c * sizeof(float), record,
                             std::endian::native == std::endian::big);
    }
    return builder.finish({});
  }
  bool seek(std::uint64_t first) override {
    file_.seek(std::min(first, count_) * record);
    return true;
  }

 private:
  static constexpr std::size_t record = 4 * sizeof(float), piece = 4096;

  open_file file_;
  read_options options_;
  std::uint64_t count_ = 0;
};

template <Scalar S, int D>
point_cloud<S, D> read_raw(const std::filesystem::path& path, const read_options& options) {
  return with_file(path, [&] {
    raw_source<S, D> source{path, options};
    if (*source.size() > std::uint64_t{std::numeric_limits<std::int32_t>::max()})
      throw io_error{path, "there are more than 2^31 - 1 points"};
    auto cloud = source.read(static_cast<index_t>(*source.size()));
    watch(options.monitor, 1, 1);
    return cloud;
  });
}

}  // namespace

ending ending_of(const std::filesystem::path& path, const char* who) {
  std::string name = path.extension().string();
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (name == ".ply") return ending::ply;
  if (name == ".pcd") return ending::pcd;
  if (name == ".xyz" || name == ".txt" || name == ".asc") return ending::text;
  if (name == ".csv") return ending::csv;
  if (name == ".pts") return ending::pts;
  if (name == ".npy") return ending::npy;
  if (name == ".bin") return ending::raw;
  if (name == ".las") return ending::las;
  if (name == ".laz") return ending::laz;
  if (name == ".ptx") return ending::ptx;
  if (name == ".e57") return ending::e57;
  throw invalid_input{std::string{who} + ": \"" + path.string() + "\" does not end in " +
                      known_cloud_files() + "; .laz, .e57, .ptx, .npy and .bin are read, too"};
}

std::string known_cloud_files() {
  return ".ply, .pcd, .las, .xyz, .txt, .asc, .csv or .pts";
}

template <Scalar S, int D>
source_pointer<S, D> open_source(const std::filesystem::path& path, const read_options& options) {
  return with_file(path, [&]() -> source_pointer<S, D> {
    switch (ending_of(path, "cloud_reader")) {
      case ending::ply:
        return open_ply<S, D>(path, options);
      case ending::pcd:
        return open_pcd<S, D>(path, options);
      case ending::text:
      case ending::csv:
      case ending::pts:
        return open_text<S, D>(path, options);
      case ending::las:
      case ending::laz:
        return open_las<S, D>(path, options);
      case ending::raw:
        return std::make_unique<raw_source<S, D>>(path, options);
      case ending::npy:
      case ending::ptx:
      case ending::e57:
        break;
    }
    return std::make_unique<whole_source<S, D>>(read_cloud<S, D>(path, options));
  });
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_cloud(const std::filesystem::path& path, const read_options& options) {
  switch (ending_of(path, "read_cloud")) {
    case ending::ply:
      return read_ply<S, D>(path, options);
    case ending::pcd:
      return read_pcd<S, D>(path, options);
    case ending::text:
    case ending::csv:
    case ending::pts:
      break;
    case ending::npy:
      return read_rows<S, D>(path, options);
    case ending::raw:
      return read_raw<S, D>(path, options);
    case ending::las:
    case ending::laz:
      return read_las<S, D>(path, options);
    case ending::ptx:
      return read_ptx<S, D>(path, options);
    case ending::e57:
      return read_e57<S, D>(path, options);
  }
  return read_text<S, D>(
      path, {.origin = options.origin, .threads = options.threads, .monitor = options.monitor});
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_cloud(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
                 const task_monitor& monitor) {
  switch (ending_of(path, "write_cloud")) {
    case ending::ply:
      return write_ply(cloud, path, {.monitor = monitor});
    case ending::pcd:
      return write_pcd(cloud, path, {.monitor = monitor});
    case ending::text:
      return write_text(cloud, path, {.monitor = monitor});
    case ending::csv:
      return write_text(cloud, path, {.separator = ',', .monitor = monitor});
    case ending::pts:
      if constexpr (D == 3)
        return write_pts(cloud, path, monitor);
      else
        throw invalid_input{"write_cloud: the points of a PTS file have three coordinates"};
    case ending::las:
      return write_las(cloud, path, {.monitor = monitor});
    case ending::npy:
    case ending::raw:
    case ending::laz:
    case ending::ptx:
    case ending::e57:
      break;
  }
  throw invalid_input{"write_cloud: \"" + path.string() +
                      "\" has a format that can only be read; clouds are written to " +
                      known_cloud_files()};
}

#define CILANTRO_INSTANTIATE(S, D)                                                                \
  template source_pointer<S, D> open_source(const std::filesystem::path&, const read_options&);   \
  template point_cloud<S, D> read_cloud<S, D>(const std::filesystem::path&, const read_options&); \
  template void write_cloud(const point_cloud<S, D>&, const std::filesystem::path&,               \
                            const task_monitor&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
