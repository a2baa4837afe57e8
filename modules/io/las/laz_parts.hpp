// SPDX-License-Identifier: MIT
//
// What else than the point itself is coded in layers. A plain header, which needs nothing of any
// module.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "io/las/laz_chunks.hpp"
#include "io/las/laz_items.hpp"

namespace cilantro::laz {

/// What else a point has, byte by byte: a colour, its infrared part, or extra bytes.
class layered_part {
 public:
  layered_part(const item& what, std::size_t at) : what_{what}, at_{at} {}

  [[nodiscard]] std::size_t layers() const {
    return what_.kind == item::color14 ? 1 : what_.kind == item::color_infrared14 ? 2 : what_.size;
  }
  void add_layer(std::optional<decoder> in) { in_.push_back(in); }

  void first(const char* record, unsigned channel) {
    channel_ = channel;
    channels_[channel].emplace(record + at_, what_.size);
  }

  void next(char* record, unsigned channel) {
    state* last = &*channels_[channel_];
    if (channel != channel_) {
      channel_ = channel;
      const bool is_new = !channels_[channel];
      if (is_new) channels_[channel].emplace(last->bytes.data(), what_.size);
      // Version 3 goes on from the point before, of whichever channel.
      if (is_new || what_.version != 3) last = &*channels_[channel];
    }
    state& now = *channels_[channel];
    if (what_.kind == item::bytes14)
      next_bytes(now, last->bytes);
    else if (in_[0])
      next_color(now, last->bytes);
    std::memcpy(record + at_, last->bytes.data(), what_.size);
    if (what_.kind == item::color_infrared14) next_infrared(now, last->bytes, record + at_);
  }

 private:
  struct state {
    state(const char* last, std::size_t size) : bytes(last, last + size), models(size) {}
    std::vector<char> bytes;
    std::vector<symbol_model> models;
    color_item color{"\0\0\0\0\0"};
    symbol_model infrared;
  };

  void next_bytes(state& models, std::vector<char>& last) {
    for (std::size_t i = 0; i < last.size(); ++i)
      if (in_[i]) add(*in_[i], models.models[i], last[i]);
  }

  void next_color(state& models, std::vector<char>& last) {
    std::array<std::uint8_t, color_item::size> before;
    for (std::size_t i = 0; i < before.size(); ++i) before[i] = byte_at(last.data(), i);
    const auto now = models.color.next_after(*in_[0], before);
    for (std::size_t i = 0; i < now.size(); ++i) last[i] = static_cast<char>(now[i]);
  }

  /// Infrared is remembered by the channel of the point in all versions.
  void next_infrared(state& now, const std::vector<char>& last, char* out) {
    constexpr std::size_t at = color_item::size;
    if (in_[1]) {
      if (now.infrared.empty()) now.infrared.begin(4);
      const unsigned changes = in_[1]->symbol(now.infrared);
      for (std::size_t b = 0; b < 2; ++b) {
        char byte = last[at + b];
        if (changes & (1u << b)) add(*in_[1], now.models[b], byte);
        now.bytes[at + b] = byte;
      }
    }
    std::memcpy(out + at, now.bytes.data() + at, 2);
  }

  static void add(decoder& in, symbol_model& model, char& byte) {
    if (model.empty()) model.begin(256);
    byte = static_cast<char>(static_cast<std::uint8_t>(byte) + in.symbol(model));
  }

  item what_;
  std::size_t at_;
  std::vector<std::optional<decoder>> in_;
  unsigned channel_ = 0;
  std::array<std::optional<state>, 4> channels_;
};

}  // namespace cilantro::laz
