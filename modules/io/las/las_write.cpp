// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "io/common/file.hpp"
#include "io/common/random_bytes.hpp"
#include "io/las/las_record.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_columns;
import :file_scope;
import :las_file;
import :las_plan;

namespace cilantro {
namespace {

using detail::store_little;

constexpr std::size_t longest_record = 65'535;

/// The format that a file was of, or the next one that has a place for what the cloud has.
int format_for(const auto& cloud, std::optional<int> wish) {
  const bool colors = cloud.has_colors();
  const bool infrared = cloud.find_attribute("near_infrared") != nullptr;
  const bool time = cloud.find_attribute("gps_time") != nullptr;
  const int format = wish.value_or(6);
  if ((!colors || las::has_colors(format)) && (!time || las::has_time(format)) &&
      (!infrared || las::has_infrared(format) || !las::is_extended(format)))
    return format;
  if (las::is_extended(format)) return las::has_waves(format) ? 10 : infrared ? 8 : 7;
  if (las::has_waves(format)) return 5;
  return (colors || las::has_colors(format) ? 2 : 0) + (time || las::has_time(format) ? 1 : 0);
}

/// The same without the waveforms, which stay in the file that was read.
int without_waves(int format) {
  constexpr std::array plain{0, 1, 2, 3, 1, 3, 6, 7, 8, 6, 8};
  return plain[static_cast<std::size_t>(format)];
}

/// Whether a record says how the file that it is from is stored, which is not how this one is.
bool is_of_its_file(const las_record& r) {
  return (r.user_id == las_spec && (r.id == extra_bytes_id || r.id == wave_packets_id)) ||
         r.user_id == laszip_user || r.user_id == "copc";
}

void replace(std::vector<las_record>& records, const las_record& next) {
  std::erase_if(records,
                [&](const auto& r) { return r.user_id == next.user_id && r.id == next.id; });
  records.push_back(next);
}

/// The comments of a cloud, as the description of the area.
std::optional<las_record> text_of(const std::vector<std::string>& comments) {
  if (comments.empty()) return std::nullopt;
  las_record record{
      .user_id = std::string{las_spec}, .id = text_area_id, .description = "comments"};
  for (const std::string& comment : comments) {
    for (const char c : comment)
      if (c != '\0') record.data.push_back(static_cast<std::byte>(c));
    record.data.push_back(std::byte{'\n'});
  }
  return record;
}

/// Everything that the cloud, its comments and the options say about the file.
template <Scalar S, int D>
las_plan plan_for(const point_cloud<S, D>& cloud, const las_write_options& options) {
  expects(!options.format || (*options.format >= 0 && *options.format < las::formats),
          "write_las: the point format must be from 0 to 10");
  las_plan plan;
  las_info& info = plan.info;
  auto comments = cloud.comments;
  auto hints = take_las_hints(comments);
  if (cloud.has_origin()) comments.push_back(origin_comment<D>(cloud.origin));
  if (cloud.is_organized()) comments.push_back(size_comment(cloud.width, cloud.height));
  const las_info* hint = options.like ? &*options.like : hints.info ? &*hints.info : nullptr;
  if (options.like) {
    info = *options.like;
    info.records.clear();
    expects(info.point_format >= 0 && info.point_format < las::formats,
            "write_las: the point format of `like` must be from 0 to 10");
  } else if (hint) {
    info.global_encoding = hint->global_encoding;
  }
  info.is_compressed = false;
  const auto wish = options.like ? info.point_format
                    : hint       ? without_waves(hint->point_format)
                                 : std::optional<int>{};
  info.point_format = options.format ? *options.format : format_for(cloud, wish);
  const int least = las::is_extended(info.point_format) ? 4 : info.point_format > 3 ? 3 : 2;
  info.version_minor = std::max(least, hint ? hint->version_minor : least);
  info.points = static_cast<std::uint64_t>(cloud.size());
  info.generating_software = library_name;

  info.records = std::move(hints.records);
  if (options.like)
    for (const auto& r : options.like->records)
      if (!is_of_its_file(r)) replace(info.records, r);
  if (const auto text = text_of(comments)) replace(info.records, *text);

  auto columns =
      columns_of(cloud, {.normal_prefix = "normal_", .colors = column_style::colors::floating});
  expect_writable_names(columns, "write_las");
  const auto coordinates = take_coordinates(columns, D);
  place_coordinates(coordinates, cloud.size(), options, hint, plan);
  place_columns(columns, cloud.size(), options, plan);
  for (const auto& r : options.records) replace(info.records, r);

  constexpr std::uint16_t waves_inside = 2, is_wkt = 16;
  const auto has = [&](std::uint16_t id) {
    return info.find_record(las_projection, id) != nullptr;
  };
  info.global_encoding &= static_cast<std::uint16_t>(~(waves_inside | is_wkt));
  if (info.version_minor == 4 &&
      (has(2112) || (las::is_extended(info.point_format) && !has(34735))))
    info.global_encoding |= is_wkt;
  return plan;
}

/// How many points are which return of their pulse.
std::array<std::uint64_t, 15> returns_of(const las_plan& plan, index_t size) {
  std::array<std::uint64_t, 15> counts{};
  for (const auto& p : plan.columns)
    if (p.from.name == "return_number" && p.bits > 0)
      std::visit(
          [&](const auto* data) {
            for (index_t i = 0; i < size; ++i) {
              const auto number = std::llround(static_cast<double>(data[i * p.from.stride]));
              if (number >= 1 && number <= 15) ++counts[static_cast<std::size_t>(number - 1)];
            }
          },
          p.from.data);
  return counts;
}

void put_text(char* out, std::string_view text, std::size_t most) {
  std::memcpy(out, text.data(), std::min(text.size(), most));
}

void append(std::string& bytes, const las_record& record, bool extended) {
  expects(record.user_id.size() <= 16 && record.description.size() <= 32,
          "write_las: the record \"" + record.user_id +
              "\" has a name of more than 16, or a "
              "description of more than 32 characters");
  std::string head(extended ? 60 : 54, '\0');
  put_text(head.data() + 2, record.user_id, 16);
  store_little(head.data() + 18, record.id);
  if (extended)
    store_little(head.data() + 20, static_cast<std::uint64_t>(record.data.size()));
  else
    store_little(head.data() + 20, static_cast<std::uint16_t>(record.data.size()));
  put_text(head.data() + (extended ? 28 : 22), record.description, 32);
  bytes += head;
  bytes.append(reinterpret_cast<const char*>(record.data.data()), record.data.size());
}

/// The bytes before and behind the points.
struct surroundings {
  std::string before, behind;
};

void put_counts(char* header, const las_info& info,
                const std::array<std::uint64_t, 15>& by_return) {
  if (!las::is_extended(info.point_format)) {
    store_little(header + 107, static_cast<std::uint32_t>(info.points));
    for (std::size_t i = 0; i < 5; ++i)
      store_little(header + 111 + 4 * i, static_cast<std::uint32_t>(by_return[i]));
  }
  if (info.version_minor < 4) return;
  store_little(header + 247, info.points);
  for (std::size_t i = 0; i < 15; ++i) store_little(header + 255 + 8 * i, by_return[i]);
}

surroundings surroundings_of(const las_plan& plan, const std::array<std::uint64_t, 15>& by_return) {
  const las_info& info = plan.info;
  const bool is_latest = info.version_minor == 4;
  const std::size_t size = is_latest ? 375 : info.version_minor == 3 ? 235 : 227;
  surroundings all{.before = std::string(size, '\0'), .behind = {}};
  std::uint32_t before = 0, behind = 0;
  for (const auto& r : info.records) {
    const bool is_long = r.data.size() > longest_record;
    expects(!is_long || is_latest, "write_las: the record \"" + r.user_id + "\" has " +
                                       std::to_string(r.data.size()) +
                                       " bytes, and LAS before 1.4 holds 65,535");
    const bool extended = is_latest && (is_long || r.is_extended);
    append(extended ? all.behind : all.before, r, extended);
    ++(extended ? behind : before);
  }
  char* header = all.before.data();
  std::ranges::copy(std::string_view{"LASF"}, header);
  store_little(header + 4, info.file_source_id);
  store_little(header + 6, info.global_encoding);
  std::memcpy(header + 8, info.project_id.data(), 16);
  header[24] = 1;
  header[25] = static_cast<char>(info.version_minor);
  put_text(header + 26, info.system_identifier, 32);
  put_text(header + 58, info.generating_software, 32);
  store_little(header + 90, static_cast<std::uint16_t>(info.creation_day));
  store_little(header + 92, static_cast<std::uint16_t>(info.creation_year));
  store_little(header + 94, static_cast<std::uint16_t>(size));
  expects(all.before.size() <= 0xffffffffu, "write_las: the records are larger than 4 GiB");
  store_little(header + 96, static_cast<std::uint32_t>(all.before.size()));
  store_little(header + 100, before);
  header[104] = static_cast<char>(info.point_format);
  store_little(header + 105, info.record_length);
  for (std::size_t d = 0; d < 3; ++d) {
    const auto i = static_cast<index_t>(d);
    store_little(header + 131 + 8 * d, info.scale[i]);
    store_little(header + 155 + 8 * d, info.offset[i]);
    store_little(header + 179 + 16 * d, info.upper[i]);
    store_little(header + 187 + 16 * d, info.lower[i]);
  }
  put_counts(header, info, by_return);
  if (is_latest && behind > 0) {
    store_little(header + 235, all.before.size() + info.points * info.record_length);
    store_little(header + 243, behind);
  }
  return all;
}

void write_points(const las_plan& plan, index_t size, const task_monitor& monitor,
                  detail::output_file& file) {
  const std::size_t length = plan.info.record_length;
  constexpr std::size_t cached = std::size_t{3} << 15;
  const auto block = std::clamp<index_t>(static_cast<index_t>(cached / length), 1, most_records);
  const index_t at_a_time = std::max<index_t>(1, std::min(size, 64 * block));
  std::vector<char> bytes(static_cast<std::size_t>(at_a_time) * length);
  for (index_t first = 0; first < size; first += at_a_time) {
    watch(monitor, double(first), double(size));
    const index_t n = std::min(at_a_time, size - first);
    parallel_blocks(n, block, {.monitor = {.stop = monitor.stop}},
                    [&](index_t, index_t begin, index_t end) {
                      char* out = bytes.data() + static_cast<std::size_t>(begin) * length;
                      std::memset(out, 0, static_cast<std::size_t>(end - begin) * length);
                      encode_las(plan, first + begin, end - begin, out);
                    });
    file.write(bytes.data(), static_cast<std::size_t>(n) * length);
  }
  watch(monitor, 1, 1);
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_las(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
               const las_write_options& options) {
  expect_consistent(cloud, "write_las");
  const auto plan = plan_for(cloud, options);
  const auto around = surroundings_of(plan, returns_of(plan, cloud.size()));
  with_output(path, [&](detail::output_file& file) {
    file.write(around.before.data(), around.before.size());
    write_points(plan, cloud.size(), options.monitor, file);
    file.write(around.behind.data(), around.behind.size());
  });
}

template void write_las(const point_cloud<float, 2>&, const std::filesystem::path&,
                        const las_write_options&);
template void write_las(const point_cloud<float, 3>&, const std::filesystem::path&,
                        const las_write_options&);
template void write_las(const point_cloud<double, 2>&, const std::filesystem::path&,
                        const las_write_options&);
template void write_las(const point_cloud<double, 3>&, const std::filesystem::path&,
                        const las_write_options&);

}  // namespace cilantro
