// SPDX-License-Identifier: MIT
module;
#include "io/common/random_bytes.hpp"
#include "io/las/las_record.hpp"
#include "io/las/laz_chunks.hpp"
#include "io/las/laz_layers.hpp"
module cilantro.io;

import :las_file;

namespace cilantro {
namespace {

using detail::failure;
using detail::load_little;
using laz::item;

constexpr std::uint32_t variable_size = std::numeric_limits<std::uint32_t>::max();

/// How the points are compressed, as the record of LASzip says.
struct laz_scheme {
  enum compressor : std::uint16_t { none, pointwise, pointwise_chunked, layered_chunked };
  std::uint16_t compressor = none;
  std::uint32_t chunk_size = 0;
  std::vector<item> items;
};

[[noreturn]] void refuse(const std::string& what, std::uint64_t at) {
  throw failure{what, false, at};
}

/// The items that a format has, before extra bytes.
std::vector<item> items_of(int format) {
  std::vector<item> items;
  if (las::is_extended(format)) {
    items.push_back({item::point14, 30});
    if (las::has_infrared(format))
      items.push_back({item::color_infrared14, 8});
    else if (las::has_colors(format))
      items.push_back({item::color14, 6});
  } else {
    items.push_back({item::point10, 20});
    if (las::has_time(format)) items.push_back({item::time11, 8});
    if (las::has_colors(format)) items.push_back({item::color12, 6});
  }
  return items;
}

laz_scheme read_scheme(const las_layout& layout) {
  const las_info& info = layout.info;
  const std::uint64_t at = layout.points_at;
  const las_record* record = info.find_record(laszip_user, laszip_id);
  constexpr std::size_t fixed = 34, each = 6;
  if (record == nullptr || record->data.size() < fixed)
    refuse("the points are compressed, and no record says how", at);
  const char* data = reinterpret_cast<const char*>(record->data.data());
  laz_scheme scheme{.compressor = load_little<std::uint16_t>(data),
                    .chunk_size = load_little<std::uint32_t>(data + 12),
                    .items = {}};
  if (scheme.compressor != laz_scheme::pointwise_chunked &&
      scheme.compressor != laz_scheme::layered_chunked)
    refuse("the points are compressed in way " + std::to_string(scheme.compressor) +
               " of LASzip; only 2 and 3, those in chunks, are read",
           at);
  if (load_little<std::uint16_t>(data + 2) != 0)
    refuse("the points are compressed by another coder than the arithmetic one", at);
  const auto count = load_little<std::uint16_t>(data + 32);
  if (record->data.size() < fixed + each * std::size_t{count})
    refuse("the record that says how points are compressed is cut", at);
  for (std::size_t i = 0; i < count; ++i)
    scheme.items.push_back({load_little<std::uint16_t>(data + fixed + each * i),
                            load_little<std::uint16_t>(data + fixed + each * i + 2),
                            load_little<std::uint16_t>(data + fixed + each * i + 4)});
  return scheme;
}

/// Refuses what is not decoded, and what does not fit the points of the header.
void check(const laz_scheme& scheme, const las_layout& layout) {
  const las_info& info = layout.info;
  if (las::has_waves(info.point_format))
    refuse("compressed points of format " + std::to_string(info.point_format) +
               ", those with waveforms, are not read",
           layout.points_at);
  const bool layered = las::is_extended(info.point_format);
  auto expected = items_of(info.point_format);
  const std::size_t extra = info.record_length - las::record_size(info.point_format);
  if (extra > 0)
    expected.push_back({layered ? item::bytes14 : item::bytes, static_cast<std::uint16_t>(extra)});
  const bool fits = std::ranges::equal(expected, scheme.items,
                                       [](const item& a, const item& b) {
                                         return a.kind == b.kind && a.size == b.size;
                                       }) &&
                    layered == (scheme.compressor == laz_scheme::layered_chunked);
  if (!fits)
    refuse("the compressed parts of a point are not those of format " +
               std::to_string(info.point_format),
           layout.points_at);
  for (const item& i : scheme.items)
    if (layered ? i.version != 3 && i.version != 4 : i.version != 2)
      refuse("the points are compressed by version " + std::to_string(i.version) +
                 " of LASzip's parts, which is not read",
             layout.points_at);
  if (scheme.chunk_size == 0) refuse("the chunks of compressed points are empty", layout.points_at);
}

/// Where a chunk is, and what is in it.
struct chunk {
  std::uint64_t at = 0, bytes = 0, first = 0, points = 0;
};

/// The bytes from the first chunk to the table of chunks.
std::pair<std::uint64_t, std::uint64_t> extent_of(const detail::random_bytes& file,
                                                  const las_layout& layout) {
  const std::uint64_t begin = layout.points_at + 8;
  constexpr const char* missing = "the table of the chunks of compressed points is missing";
  if (begin > file.size()) refuse(missing, file.size());
  auto table = load_little<std::uint64_t>(file.read(layout.points_at, 8).data());
  // Who writes to a pipe puts at the end where the table is.
  if (table == std::numeric_limits<std::uint64_t>::max())
    table = load_little<std::uint64_t>(file.read(file.size() - 8, 8).data());
  if (table < begin || table > file.size() || file.size() - table < 8) refuse(missing, begin);
  return {begin, table};
}

std::vector<chunk> read_chunks(const detail::random_bytes& file, const las_layout& layout,
                               std::uint32_t chunk_size) {
  const auto [begin, table] = extent_of(file, layout);
  const auto count = load_little<std::uint32_t>(file.read(table + 4, 4).data());
  const std::uint64_t points = layout.info.points;
  // Each chunk begins with a record as it is.
  if (count > (table - begin) / layout.info.record_length)
    refuse("the table promises " + std::to_string(count) +
               " chunks of compressed points, for which the file is too short",
           table);
  // A difference takes less than eight bytes; the rest may be other records.
  const auto coded = file.read(
      table + 8, std::min<std::uint64_t>(file.size() - table - 8, std::uint64_t{count} * 16 + 16));
  std::vector<chunk> chunks;
  laz::decoder in{coded.data(), coded.data() + coded.size()};
  laz::integer_model sizes{32, 2};
  std::int32_t bytes = 0, size = 0;
  chunk next{.at = begin};
  for (std::uint32_t i = 0; i < count; ++i) {
    if (chunk_size == variable_size) size = sizes.decode(in, size, 0);
    bytes = sizes.decode(in, bytes, 1);
    constexpr unsigned flushed = 3;
    if (in.beyond() > flushed) refuse("the table of the chunks of compressed points is cut", table);
    next.bytes = static_cast<std::uint32_t>(bytes);
    next.points = chunk_size == variable_size
                      ? static_cast<std::uint32_t>(size)
                      : std::min<std::uint64_t>(chunk_size, points - next.first);
    if (next.bytes > table - next.at || next.points > points - next.first)
      refuse("the table of the chunks of compressed points is damaged", table);
    chunks.push_back(next);
    next.at += next.bytes;
    next.first += next.points;
  }
  if (next.first != points)
    refuse("the header promises " + std::to_string(points) + " points, and the chunks have " +
               std::to_string(next.first),
           table);
  return chunks;
}

/// What points that take next to nothing may grow to. Real ones are compressed to a tenth.
void expect_bounded(const las_info& info, const std::vector<chunk>& chunks) {
  constexpr std::uint64_t free = std::uint64_t{1} << 24, most_growth = 1000;
  std::uint64_t bytes = 0;
  for (const chunk& c : chunks) bytes += c.bytes;
  if (info.points > std::max(free, bytes * most_growth) / info.record_length)
    refuse("the header promises " + std::to_string(info.points) + " points in " +
               std::to_string(bytes) + " bytes, which is a thousandth of their size or less",
           107);
}

class compressed_records : public las_records {
 public:
  compressed_records(const detail::random_bytes& file, const las_layout& layout)
      : file_{file}, length_{layout.info.record_length}, scheme_{read_scheme(layout)} {
    check(scheme_, layout);
    if (layout.info.points == 0) return;
    chunks_ = read_chunks(file, layout, scheme_.chunk_size);
    expect_bounded(layout.info, chunks_);
  }

  void visit(std::uint64_t first, std::uint64_t count, const task_monitor& monitor,
             const record_visitor& visit) override {
    if (count == 0) return;
    const auto begin = chunk_of(first), end = chunk_of(first + count - 1) + 1;
    // A piece goes on in the chunk where the one before it ended.
    open_chunk before = std::move(last_), after;
    last_ = {};
    parallel_blocks(end - begin, 1, {.monitor = monitor}, [&](index_t, index_t i, index_t) {
      const chunk& c = chunks_[begin + i];
      const bool goes_on = i == 0 && before.of == begin && before.next <= first;
      open_chunk opened = goes_on ? std::move(before) : open(begin + i);
      decode(opened, std::max(first, c.first), std::min(first + count, c.first + c.points), monitor,
             visit);
      if (begin + i + 1 == end) after = std::move(opened);
    });
    last_ = std::move(after);
  }

  [[nodiscard]] std::vector<char> sample() const override {
    // The first record of a chunk is as it is.
    constexpr std::size_t coordinates = 12, most = 1000;
    const std::size_t n = std::min(chunks_.size(), most);
    std::vector<char> records(n * length_);
    for (std::size_t i = 0; i < n; ++i) {
      const chunk& c = chunks_[static_cast<index_t>(i * (chunks_.size() / n))];
      if (c.points > 0) file_.read(c.at, records.data() + i * length_, coordinates);
    }
    return records;
  }

 private:
  [[nodiscard]] index_t chunk_of(std::uint64_t point) const {
    const auto after = std::ranges::upper_bound(chunks_, point, {}, &chunk::first);
    return after - chunks_.begin() - 1;
  }

  /// A chunk of which some points are decoded.
  struct open_chunk {
    index_t of = -1;
    std::uint64_t next = 0;  ///< Point, of all.
    std::vector<char> bytes;
    std::unique_ptr<laz::chunk_reader> reader;
  };

  [[nodiscard]] open_chunk open(index_t index) const {
    const chunk& c = chunks_[index];
    open_chunk opened{.of = index, .next = c.first, .bytes = file_.read(c.at, c.bytes)};
    if (scheme_.compressor == laz_scheme::layered_chunked)
      opened.reader = std::make_unique<laz::layered_chunk>(opened.bytes, scheme_.items);
    else
      opened.reader = std::make_unique<laz::point_chunk>(opened.bytes, scheme_.items);
    return opened;
  }

  /// The points from `first` to `last` − 1, all of which are in the chunk.
  void decode(open_chunk& opened, std::uint64_t first, std::uint64_t last,
              const task_monitor& monitor, const record_visitor& visit) const {
    std::vector<char> records(static_cast<std::size_t>(most_records) * length_);
    try {
      for (; opened.next < first; ++opened.next) opened.reader->next(records.data());
      while (opened.next < last) {
        if (monitor.stop.stop_requested()) throw cancelled{};
        const auto n = std::min<std::uint64_t>(most_records, last - opened.next);
        for (std::uint64_t i = 0; i < n; ++i) opened.reader->next(records.data() + i * length_);
        visit(opened.next, static_cast<index_t>(n), records.data());
        opened.next += n;
      }
    } catch (const failure& f) {
      refuse(f.what(), chunks_[opened.of].at);
    }
  }

  const detail::random_bytes& file_;
  std::size_t length_;
  laz_scheme scheme_;
  std::vector<chunk> chunks_;
  open_chunk last_;
};

}  // namespace

std::unique_ptr<las_records> open_compressed_records(const detail::random_bytes& file,
                                                     const las_layout& layout) {
  return std::make_unique<compressed_records>(file, layout);
}

}  // namespace cilantro
