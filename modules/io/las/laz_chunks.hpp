// SPDX-License-Identifier: MIT
//
// A chunk of the points of a LAZ file, decoded from front to back. A plain header, which needs
// nothing of any module.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "io/las/laz_items.hpp"

namespace cilantro::laz {

/// A part of a record, as the file describes it.
struct item {
  enum type : std::uint16_t {
    bytes = 0,
    point10 = 6,
    time11 = 7,
    color12 = 8,
    wave13 = 9,
    point14 = 10,
    color14 = 11,
    color_infrared14 = 12,
    wave14 = 13,
    bytes14 = 14
  };
  std::uint16_t kind = 0, size = 0, version = 0;
};

/// Gives the records of a chunk one after another.
class chunk_reader {
 public:
  chunk_reader() = default;
  chunk_reader(const chunk_reader&) = delete;
  chunk_reader& operator=(const chunk_reader&) = delete;
  virtual ~chunk_reader() = default;

  /// The next record. Throws `detail::failure` if there is nothing left to decode it from.
  virtual void next(char* record) = 0;
};

/// A chunk whose points are coded one after another. The bytes must outlive it.
class point_chunk : public chunk_reader {
 public:
  /// `items` begin with a point of 20 bytes; all are known, and of version 2.
  point_chunk(std::span<const char> bytes, const std::vector<item>& items) : bytes_{bytes} {
    std::size_t at = 0;
    for (const item& i : items) {
      if (i.kind == item::time11) time_at_ = at;
      if (i.kind == item::color12) color_at_ = at;
      if (i.kind == item::bytes) extra_at_ = at;
      at += i.size;
    }
    length_ = at;
  }

  void next(char* record) override {
    if (!point_) return first(record);
    point_->next(in_, record);
    if (time_) store_little(record + time_at_, time_->next(in_));
    if (color_) color_->next(in_, record + color_at_);
    if (extra_) extra_->next(in_, record + extra_at_);
  }

 private:
  /// The first record is as it is.
  void first(char* record) {
    if (bytes_.size() < length_)
      throw detail::failure{"a chunk of compressed points is cut", false, 0};
    std::memcpy(record, bytes_.data(), length_);
    point_ = std::make_unique<point_item>(record);
    if (time_at_ > 0)
      time_ = std::make_unique<time_sequences>(load_little<std::int64_t>(record + time_at_), true);
    if (color_at_ > 0) color_ = std::make_unique<color_item>(record + color_at_);
    if (extra_at_ > 0)
      extra_ = std::make_unique<extra_item>(record + extra_at_, length_ - extra_at_);
    in_ = decoder{bytes_.data() + length_, bytes_.data() + bytes_.size()};
  }

  std::span<const char> bytes_;
  std::size_t length_ = 0, time_at_ = 0, color_at_ = 0, extra_at_ = 0;
  decoder in_;
  std::unique_ptr<point_item> point_;
  std::unique_ptr<time_sequences> time_;
  std::unique_ptr<color_item> color_;
  std::unique_ptr<extra_item> extra_;
};

}  // namespace cilantro::laz
