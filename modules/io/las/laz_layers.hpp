// SPDX-License-Identifier: MIT
//
// A chunk of the points of LAS 1.4 in a LAZ file, each value of which is coded in a layer of its
// own. A plain header, which needs nothing of any module.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "io/las/laz_chunks.hpp"
#include "io/las/laz_items.hpp"
#include "io/las/laz_parts.hpp"

namespace cilantro::laz {

/// A model for each value of a context, made when it is needed.
template <std::size_t contexts, unsigned symbols>
class context_models {
 public:
  symbol_model& of(std::size_t context) {
    auto& model = models_[context];
    if (model.empty()) model.begin(symbols);
    return model;
  }

 private:
  std::vector<symbol_model> models_ = std::vector<symbol_model>(contexts);
};

/// The layers of a point of 30 bytes, in the order of the file.
struct point_layers {
  enum layer { places, heights, classes, flags, intensities, angles, users, sources, times, count };
  std::array<std::optional<decoder>, count> in;  ///< None for a value that never changes.
};

/// What is known about the points of one scanner channel.
class channel_state {
 public:
  static constexpr std::size_t size = 30;

  /// Nothing but the point before, of this or another channel.
  explicit channel_state(const std::array<char, size>& last)
      : last_{last}, times_{load_little<std::int64_t>(last.data() + 22), false} {
    intensities_.fill(load_little<std::uint16_t>(last.data() + 12));
    heights_.fill(load_little<std::int32_t>(last.data() + 8));
  }

  [[nodiscard]] const std::array<char, size>& last() const { return last_; }
  void set_channel(unsigned channel) { set(15, (byte(15) & ~0x30u) | channel << 4); }

  /// What is different in the next point, which comes after one of this channel.
  unsigned next_changes(decoder& in) {
    const unsigned r = byte(14) & 15u, n = byte(14) >> 4;
    return in.symbol(changes_.of((r == 1 ? 1u : 0) + (r >= n ? 2u : 0) + (has_new_time_ ? 4u : 0)));
  }
  /// By how much the channel changes.
  unsigned next_step(decoder& in) { return in.symbol(steps_.of(0)) + 1; }

  void next(point_layers& layers, unsigned changes) {
    const bool new_source = changes & 32, new_time = changes & 16, new_angle = changes & 8;
    decoder& in = *layers.in[point_layers::places];
    const unsigned n = next_count(in, changes), r = next_return(in, changes, new_time);
    set(14, n << 4 | r);
    const unsigned kind = return_kinds[n][r], level = std::min(n > r ? n - r : r - n, 7u);
    const unsigned place = (r == 1 ? 2u : 0) + (r >= n ? 1u : 0);
    next_place(layers, kind << 1 | (new_time ? 1u : 0), level, n == 1);
    if (auto& layer = layers.in[point_layers::classes])
      set(16, layer->symbol(classes_.of((byte(16) & 31u) << 1 | (place == 3 ? 1u : 0))));
    if (auto& layer = layers.in[point_layers::flags]) next_flags(*layer);
    if (auto& layer = layers.in[point_layers::intensities]) {
      auto& intensity = intensities_[place << 1 | (new_time ? 1u : 0)];
      intensity = static_cast<std::uint16_t>(intensity_.decode(*layer, intensity, place));
      store_little(last_.data() + 12, intensity);
    }
    if (auto& layer = layers.in[point_layers::angles]; layer && new_angle)
      store_little(last_.data() + 18,
                   static_cast<std::uint16_t>(angle_.decode(
                       *layer, load_little<std::uint16_t>(last_.data() + 18), new_time ? 1 : 0)));
    if (auto& layer = layers.in[point_layers::users])
      set(17, layer->symbol(users_.of(byte(17) / 4)));
    if (auto& layer = layers.in[point_layers::sources]; layer && new_source)
      store_little(last_.data() + 20, static_cast<std::uint16_t>(source_.decode(
                                          *layer, load_little<std::uint16_t>(last_.data() + 20))));
    if (auto& layer = layers.in[point_layers::times]; layer && new_time)
      store_little(last_.data() + 22, times_.next(*layer));
    has_new_time_ = new_time;
  }

 private:
  /// Which points are alike, by the number of their return r among n, as [n][r].
  static constexpr std::uint8_t return_kinds[16][16] = {
      {0, 1, 2, 3, 4, 5, 3, 4, 4, 5, 5, 5, 5, 5, 5, 5},
      {1, 0, 1, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3},
      {2, 1, 2, 4, 4, 4, 4, 4, 4, 4, 4, 3, 3, 3, 3, 3},
      {3, 3, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4},
      {4, 3, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4},
      {5, 3, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4},
      {3, 3, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4},
      {4, 3, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4},
      {4, 3, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4},
      {5, 3, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4},
      {5, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4},
      {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 4, 4, 4},
      {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 4, 4},
      {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 4},
      {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5},
      {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5}};

  [[nodiscard]] unsigned byte(std::size_t at) const { return byte_at(last_.data(), at); }
  void set(std::size_t at, unsigned value) { last_[at] = static_cast<char>(value); }

  unsigned next_count(decoder& in, unsigned changes) {
    const unsigned last = byte(14) >> 4;
    return changes & 4 ? in.symbol(counts_.of(last)) : last;
  }
  unsigned next_return(decoder& in, unsigned changes, bool new_time) {
    const unsigned last = byte(14) & 15u;
    switch (changes & 3) {
      case 0:
        return last;
      case 1:
        return (last + 1) & 15u;
      case 2:
        return (last + 15) & 15u;
      default:
        return new_time ? in.symbol(returns_.of(last))
                        : (last + in.symbol(returns_of_pulse_.of(0)) + 2) & 15u;
    }
  }

  void next_place(point_layers& layers, unsigned kind, unsigned level, bool is_single) {
    decoder& in = *layers.in[point_layers::places];
    const unsigned single = is_single ? 1 : 0;
    const std::int32_t dx = x_.decode(in, dx_[kind].get(), single);
    move(0, dx);
    dx_[kind].add(dx);
    const std::int32_t dy =
        y_.decode(in, dy_[kind].get(), single + std::min(x_.length() & ~1u, 20u));
    move(4, dy);
    dy_[kind].add(dy);
    auto& layer = layers.in[point_layers::heights];
    if (!layer) return;
    const unsigned mean = (x_.length() + y_.length()) / 2;
    heights_[level] = z_.decode(*layer, heights_[level], single + std::min(mean & ~1u, 18u));
    store_little(last_.data() + 8, heights_[level]);
  }

  /// The marks of the class, and of the scanner's way.
  void next_flags(decoder& in) {
    const unsigned last = byte(15);
    const unsigned flags = in.symbol(flags_.of((last >> 6) << 4 | (last & 15u)));
    set(15, (flags >> 4) << 6 | (last & 0x30u) | (flags & 15u));
  }

  void move(std::size_t at, std::int32_t by) {
    store_little(last_.data() + at,
                 load_little<std::uint32_t>(last_.data() + at) + static_cast<std::uint32_t>(by));
  }

  std::array<char, size> last_;
  bool has_new_time_ = false;
  std::array<std::uint16_t, 8> intensities_;
  std::array<std::int32_t, 8> heights_;
  std::array<running_median, 12> dx_, dy_;
  context_models<8, 128> changes_;
  context_models<1, 3> steps_;
  context_models<16, 16> counts_, returns_;
  context_models<1, 13> returns_of_pulse_;
  context_models<64, 256> classes_, users_;
  context_models<64, 64> flags_;
  integer_model x_{32, 2}, y_{32, 22}, z_{32, 20}, intensity_{16, 4}, angle_{16, 2}, source_{16, 1};
  time_sequences times_;
};

/// A chunk of layers. The bytes must outlive it.
class layered_chunk : public chunk_reader {
 public:
  /// `items` begin with a point of 30 bytes; all are known.
  layered_chunk(std::span<const char> bytes, const std::vector<item>& items) : bytes_{bytes} {
    for (const item& i : items) {
      if (i.kind != item::point14) parts_.emplace_back(i, length_);
      length_ += i.size;
    }
  }

  void next(char* record) override {
    if (!channels_[channel_]) return first(record);
    const unsigned changes = channels_[channel_]->next_changes(*layers_.in[point_layers::places]);
    if (changes & 64) change_channel();
    channel_state& state = *channels_[channel_];
    state.next(layers_, changes);
    std::memcpy(record, state.last().data(), state.size);
    for (auto& part : parts_) part.next(record, channel_);
  }

 private:
  void first(char* record) {
    std::memcpy(record, take(length_), length_);
    std::array<char, channel_state::size> point;
    std::memcpy(point.data(), record, point.size());
    channel_ = (byte_at(record, 15) >> 4) & 3u;
    channels_[channel_].emplace(point);
    take(4);  // How many points there are, which the table of chunks says, too.
    std::vector<std::uint32_t> sizes(point_layers::count);
    for (const auto& part : parts_) sizes.resize(sizes.size() + part.layers());
    for (auto& size : sizes) size = load_little<std::uint32_t>(take(4));
    std::size_t next = 0;
    for (auto& layer : layers_.in) layer = take_layer(sizes[next++]);
    if (!layers_.in[point_layers::places]) layers_.in[point_layers::places].emplace();
    for (auto& part : parts_) {
      for (std::size_t i = part.layers(); i > 0; --i) part.add_layer(take_layer(sizes[next++]));
      part.first(record, channel_);
    }
  }

  const char* take(std::size_t count) {
    if (count > bytes_.size() - at_)
      throw detail::failure{"a chunk of compressed points is cut", false, 0};
    const char* data = bytes_.data() + at_;
    at_ += count;
    return data;
  }
  std::optional<decoder> take_layer(std::uint32_t size) {
    if (size == 0) return std::nullopt;
    const char* data = take(size);
    return decoder{data, data + size};
  }

  void change_channel() {
    channel_state& before = *channels_[channel_];
    const unsigned next = (channel_ + before.next_step(*layers_.in[point_layers::places])) & 3u;
    if (!channels_[next]) channels_[next].emplace(before.last());
    channel_ = next;
    channels_[next]->set_channel(next);
  }

  std::span<const char> bytes_;
  std::size_t at_ = 0, length_ = 0;
  point_layers layers_;
  unsigned channel_ = 0;
  std::array<std::optional<channel_state>, 4> channels_;
  std::vector<layered_part> parts_;
};

}  // namespace cilantro::laz
