// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "cloud/color.hpp"
#include "io/common/random_bytes.hpp"
#include "io/las/las_record.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_source;
import :file_scope;
import :las_file;
import :las_table;

namespace cilantro {
namespace {

using detail::load_little;
using las::field;

constexpr bool swapped = std::endian::native == std::endian::big;
/// Colours are stored by 16 bits, of which some writers use 8.
constexpr std::uint16_t most_of_eight_bit = 255;

template <Scalar S, int D>
class las_reader {
 public:
  las_reader(const detail::random_bytes& file, const read_options& options)
      : options_{options},
        layout_{read_las_layout(file)},
        table_{las_table_of(layout_)},
        records_{open_records(file, layout_)},
        comments_{las_comments(layout_.info)} {
    const auto noted = take_origin<D>(comments_);
    if (options.origin == origin_policy::automatic) origin_ = noted ? *noted : choose_origin();
  }

  [[nodiscard]] std::uint64_t size() const { return layout_.info.points; }
  [[nodiscard]] const las_info& info() const { return layout_.info; }

  point_cloud<S, D> read() {
    if (size() > std::uint64_t{std::numeric_limits<std::int32_t>::max()})
      throw detail::failure{"there are more than 2^31 - 1 points", false, 107};
    auto cloud = read(0, static_cast<index_t>(size()), origin_, options_.monitor);
    watch(options_.monitor, 1, 1);
    return cloud;
  }

  /// A piece of the points, relative to `origin`, if that is given.
  point_cloud<S, D> read_piece(std::uint64_t first, index_t count,
                               const std::optional<point_vector<double, D>>& origin) {
    if (las::has_colors(layout_.info.point_format) && !are_eight_bit_)
      are_eight_bit_ = !has_deep_color();
    task_monitor monitor = options_.monitor;
    if (monitor.progress)
      monitor.progress = [&](double done) {
        options_.monitor.progress((double(first) + done * double(count)) / double(size()));
      };
    return read(first, count, origin ? *origin : origin_, monitor);
  }

 private:
  [[nodiscard]] point_vector<double, D> choose_origin() const {
    const auto middle = sampled_middle(*records_, layout_.info);
    point_vector<double, D> origin = point_vector<double, D>::Zero();
    constexpr double far = 10'000;
    for (index_t d = 0; d < D; ++d) {
      if (std::same_as<S, float>) {
        if (std::abs(middle[d]) >= far) origin[d] = middle[d];
        continue;
      }
      // Steps that a double of that size still tells apart need no origin.
      const double resolution = std::abs(middle[d]) * std::numeric_limits<double>::epsilon();
      if (std::abs(layout_.info.scale[d]) < 4 * resolution) origin[d] = layout_.info.offset[d];
    }
    return origin;
  }

  /// Whether a colour is above 255, which is found at once unless there is none.
  bool has_deep_color() {
    if (layout_.info.generating_software == library_name) return true;
    std::atomic<bool> found = false;
    records_->visit(0, size(), {.stop = options_.monitor.stop},
                    [&](std::uint64_t, index_t n, const char* records) {
                      if (!found && most_color(n, records) > most_of_eight_bit) found = true;
                    });
    return found;
  }

  [[nodiscard]] std::uint16_t most_color(index_t n, const char* records) const {
    const char* color = records + las::colors_at(layout_.info.point_format);
    std::uint16_t most = 0;
    for (index_t i = 0; i < n; ++i, color += layout_.info.record_length)
      for (std::size_t c = 0; c < 3; ++c)
        most = std::max(most, load_little<std::uint16_t>(color + 2 * c));
    return most;
  }

  point_cloud<S, D> read(std::uint64_t first, index_t count, const point_vector<double, D>& origin,
                         const task_monitor& monitor) {
    cloud_builder<S, D> builder{table_.fields, origin_policy::none};
    builder.resize(count);
    std::array<double, 3> shift;
    for (index_t d = 0; d < 3; ++d) shift[d] = layout_.info.offset[d] - (d < D ? origin[d] : 0.0);
    std::atomic<std::uint16_t> most = 0;
    const bool with_colors = las::has_colors(layout_.info.point_format);
    records_->visit(first, static_cast<std::uint64_t>(count), monitor,
                    [&](std::uint64_t at, index_t n, const char* records) {
                      const auto begin = static_cast<index_t>(at - first);
                      store_coordinates(builder, begin, n, records, shift);
                      store_columns(builder, begin, n, records);
                      if (!with_colors) return;
                      store_colors(builder, begin, n, records);
                      if (most > most_of_eight_bit) return;
                      const std::uint16_t more = most_color(n, records);
                      for (auto now = most.load(); now < more;)
                        most.compare_exchange_weak(now, more);
                    });
    auto cloud = builder.finish(comments_);
    cloud.origin = origin;
    // Where all points are read, their colours are looked at only once.
    if (with_colors && !are_eight_bit_ && most <= most_of_eight_bit &&
        layout_.info.generating_software != library_name)
      for (float& c : cloud.colors.reshaped())
        c = detail::from_eight_bit(static_cast<std::uint8_t>(c * 65535.0f + 0.5f));
    return cloud;
  }

  void store_coordinates(cloud_builder<S, D>& builder, index_t first, index_t n,
                         const char* records, const std::array<double, 3>& shift) const {
    const std::size_t length = layout_.info.record_length;
    std::array<double, most_records> values;
    for (std::size_t d = 0; d < 3; ++d) {
      const double scale = layout_.info.scale[static_cast<index_t>(d)];
      const char* data = records + 4 * d;
      for (index_t i = 0; i < n; ++i, data += length)
        values[i] = double(load_little<std::int32_t>(data)) * scale + shift[d];
      store(builder, d, first, n, values.data());
    }
  }

  void store_colors(cloud_builder<S, D>& builder, index_t first, index_t n,
                    const char* records) const {
    const std::size_t length = layout_.info.record_length;
    std::array<float, most_records> values;
    for (std::size_t c = 0; c < 3; ++c) {
      const char* data = records + las::colors_at(layout_.info.point_format) + 2 * c;
      const bool is_eight_bit = are_eight_bit_ && *are_eight_bit_;
      for (index_t i = 0; i < n; ++i, data += length) {
        const auto value = load_little<std::uint16_t>(data);
        values[i] = is_eight_bit ? detail::from_eight_bit(static_cast<std::uint8_t>(value))
                                 : float(value) / 65535.0f;
      }
      store(builder, 3 + c, first, n, values.data());
    }
  }

  void store_columns(cloud_builder<S, D>& builder, index_t first, index_t n,
                     const char* records) const {
    const std::size_t length = layout_.info.record_length;
    const auto convert = [&]<class T, class V>(std::size_t f, std::size_t at, T, V, auto value) {
      std::array<V, most_records> values;
      const char* data = records + at;
      for (index_t i = 0; i < n; ++i, data += length) values[i] = value(load_little<T>(data));
      store(builder, f, first, n, values.data());
    };
    for (std::size_t c = 0; c < table_.columns.size(); ++c) {
      const auto& [from, scaled] = table_.columns[c];
      const std::size_t f = table_.first_column + c;
      if (scaled) {
        detail::visit_number(scaled->type, [&]<class T>(T) {
          convert(f, from.at, T{}, double{},
                  [&](T v) { return double(v) * scaled->scale + scaled->offset; });
        });
        continue;
      }
      switch (from.as) {
        case field::form::plain:
          builder.store_column(f, first, n, records + from.at, length, swapped);
          break;
        case field::form::bits:
          convert(f, from.at, std::uint8_t{}, std::uint8_t{},
                  [shift = from.shift, mask = (1u << from.bits) - 1](std::uint8_t v) {
                    return static_cast<std::uint8_t>((unsigned{v} >> shift) & mask);
                  });
          break;
        case field::form::rank:
          convert(f, from.at, std::int8_t{}, float{}, [](std::int8_t v) { return float(v); });
          break;
        case field::form::angle:
          convert(f, from.at, std::int16_t{}, float{},
                  [](std::int16_t v) { return static_cast<float>(v * las::angle_step); });
      }
    }
  }

  template <class T>
  static void store(cloud_builder<S, D>& builder, std::size_t f, index_t first, index_t n,
                    const T* values) {
    builder.store_column(f, first, n, reinterpret_cast<const char*>(values), sizeof(T), false);
  }

  read_options options_;
  las_layout layout_;
  las_table table_;
  std::unique_ptr<las_records> records_;
  std::vector<std::string> comments_;
  std::optional<bool> are_eight_bit_;  ///< Of the colours; not known before it is asked for.
  point_vector<double, D> origin_ = point_vector<double, D>::Zero();
};

template <Scalar S, int D>
class las_source : public cloud_source<S, D> {
 public:
  las_source(const std::filesystem::path& path, const read_options& options)
      : file_{path}, reader_{file_, options} {}

  [[nodiscard]] std::optional<std::uint64_t> size() const override { return reader_.size(); }
  point_cloud<S, D> read(index_t count) override {
    const auto n =
        static_cast<index_t>(std::min(static_cast<std::uint64_t>(count), reader_.size() - next_));
    auto piece = reader_.read_piece(next_, n, this->agreement().origin);
    next_ += static_cast<std::uint64_t>(n);
    return piece;
  }
  bool seek(std::uint64_t first) override {
    next_ = std::min(first, reader_.size());
    return true;
  }

 private:
  detail::random_bytes file_;
  las_reader<S, D> reader_;
  std::uint64_t next_ = 0;
};

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_las(const std::filesystem::path& path, const read_options& options) {
  return with_file(path, [&] {
    const detail::random_bytes file{path};
    return las_reader<S, D>{file, options}.read();
  });
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_las(std::span<const std::byte> bytes, const std::filesystem::path& name,
                           const read_options& options) {
  return with_place(name, [&] {
    const detail::random_bytes file{bytes};
    return las_reader<S, D>{file, options}.read();
  });
}

template <Scalar S, int D>
source_pointer<S, D> open_las(const std::filesystem::path& path, const read_options& options) {
  return std::make_unique<las_source<S, D>>(path, options);
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template source_pointer<S, D> open_las(const std::filesystem::path&, const read_options&);    \
  template point_cloud<S, D> read_las<S, D>(const std::filesystem::path&, const read_options&); \
  template point_cloud<S, D> read_las<S, D>(std::span<const std::byte>,                         \
                                            const std::filesystem::path&, const read_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
