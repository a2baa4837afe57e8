// SPDX-License-Identifier: MIT
//
// LAZ files made apart from the library: an encoder for what it decodes. That other programs read
// what this writes was tried with laz-perf 0.0.7 of npm, record by record.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "las_bytes.hpp"

namespace test::laz {

struct model {
  std::vector<std::uint32_t> counts, shares;
  std::uint32_t total = 0, cycle = 0, left = 0;

  explicit model(std::uint32_t n = 0) : counts(n, 1), shares(n), cycle{n} {
    if (n == 0) return;
    update();
    cycle = left = (n + 6) / 2;
  }
  void update() {
    total += cycle;
    if (total > 32768) {
      total = 0;
      for (auto& c : counts) total += c = (c + 1) / 2;
    }
    const std::uint32_t scale = 0x80000000u / total;
    std::uint32_t sum = 0;
    for (std::size_t k = 0; k < counts.size(); ++k) {
      shares[k] = (scale * sum) >> 16;
      sum += counts[k];
    }
    cycle = left =
        std::min<std::uint32_t>(5 * cycle / 4, 8 * (static_cast<std::uint32_t>(counts.size()) + 6));
  }
};

struct bit {
  std::uint32_t zeros = 1, total = 2, share = 4096, cycle = 4, left = 4;
};

/// Codes into a string, with a model for each name and context.
class coder {
 public:
  std::string out;

  void symbol(const std::string& name, std::uint32_t n, std::uint32_t value) {
    model& m = models_.try_emplace(name, n).first->second;
    const std::uint32_t part = length_ >> 15, begin = m.shares[value] * part;
    const std::uint32_t end = value + 1 == n ? length_ : m.shares[value + 1] * part;
    add(begin, end - begin);
    ++m.counts[value];
    if (--m.left == 0) m.update();
  }
  void one_bit(const std::string& name, std::uint32_t value) {
    bit& m = bits_[name];
    const std::uint32_t split = m.share * (length_ >> 13);
    value ? add(split, length_ - split) : add(0, split);
    if (!value) ++m.zeros;
    if (--m.left > 0) return;
    m.total += m.cycle;
    if (m.total > 8192) {
      m.total = (m.total + 1) / 2;
      m.zeros = (m.zeros + 1) / 2;
      if (m.zeros == m.total) ++m.total;
    }
    m.share = (m.zeros * (0x80000000u / m.total)) >> 18;
    m.cycle = m.left = std::min(5 * m.cycle / 4, 64u);
  }
  void raw(std::uint32_t count, std::uint32_t value) {
    if (count > 19) {
      raw(16, value & 0xffff);
      return raw(count - 16, value >> 16);
    }
    const std::uint32_t part = length_ >> count;
    add(value * part, part);
  }
  /// Returns how many bits the difference has.
  std::uint32_t integer(const std::string& name, std::uint32_t bits, std::uint32_t context,
                        std::int32_t prediction, std::int32_t value) {
    const std::uint32_t by =
        static_cast<std::uint32_t>(value) - static_cast<std::uint32_t>(prediction);
    std::int64_t c = bits == 32 ? std::int64_t{static_cast<std::int32_t>(by)}
                                : std::int64_t{static_cast<std::int16_t>(by)};
    std::uint32_t k = 0;
    for (std::int64_t rest = c <= 0 ? -c : c - 1; rest > 0; rest /= 2) ++k;
    symbol(name + 'k' + std::to_string(context), bits + 1, k);
    if (k == 0) {
      one_bit(name, static_cast<std::uint32_t>(c));
    } else if (k < 32) {
      c += c < 0 ? (std::int64_t{1} << k) - 1 : -1;
      const auto low = k > 8 ? k - 8 : 0;
      symbol(name + 'c' + std::to_string(k), 1u << std::min(k, 8u),
             static_cast<std::uint32_t>(c >> low));
      if (low > 0) raw(low, static_cast<std::uint32_t>(c) & ((1u << low) - 1));
    }
    return k;
  }
  std::string finish() {
    const bool more = length_ > 2u << 24;
    if (more)
      add(1u << 24, 1u << 23);
    else
      add(1u << 23, 1u << 15);
    out.append(more ? 3 : 2, '\0');
    return out;
  }

 private:
  void add(std::uint32_t begin, std::uint32_t length) {
    const std::uint32_t before = base_;
    base_ += begin;
    if (base_ < before) {
      auto i = out.size();
      while (static_cast<unsigned char>(out[--i]) == 0xff) out[i] = 0;
      ++out[i];
    }
    for (length_ = length; length_ < 1u << 24; length_ <<= 8, base_ <<= 8)
      out += static_cast<char>(base_ >> 24);
  }

  std::uint32_t base_ = 0, length_ = 0xffffffffu;
  std::map<std::string, model> models_;
  std::map<std::string, bit> bits_;
};

/// The third of five, of which the ends are dropped by turns.
struct median {
  std::vector<std::int32_t> five = std::vector<std::int32_t>(5);
  bool high = true;
  void add(std::int32_t v) {
    const bool was_high = high;
    if (was_high ? v >= five[2] : v <= five[2]) high = !high;
    five.erase(was_high ? five.end() - 1 : five.begin());
    // Among equals, last if the greatest was dropped, else first: that does not matter to values.
    five.insert(std::upper_bound(five.begin(), five.end(), v), v);
  }
};

template <class T>
T get(const std::string& record, std::size_t at) {
  T value;
  std::memcpy(&value, record.data() + at, sizeof value);
  return value;
}
inline std::uint32_t byte(const std::string& record, std::size_t at) {
  return static_cast<unsigned char>(record[at]);
}

struct times {
  std::array<std::int64_t, 4> last{};
  std::array<std::int32_t, 4> step{}, extreme{};
  std::size_t now = 0, newest = 0;

  /// `old` is whether an unchanged time has a symbol of its own.
  void encode(coder& out, const std::string& name, std::int64_t time, bool old) {
    const auto plus = static_cast<std::uint32_t>(old ? 1 : 0);
    if (step[now] == 0) {
      if (time == last[now] && old) return out.symbol(name + "0", 6, 0);
      const std::int64_t by = minus(time, last[now]);
      if (by == static_cast<std::int32_t>(by)) {
        out.symbol(name + "0", 5 + plus, plus);
        out.integer(name, 32, 0, 0, static_cast<std::int32_t>(by));
        step[now] = static_cast<std::int32_t>(by);
        extreme[now] = 0;
        last[now] = time;
        return;
      }
      if (const auto other = sequence(time)) {
        out.symbol(name + "0", 5 + plus, plus + 1 + other);
        now = (now + other) & 3;
        return encode(out, name, time, old);
      }
      out.symbol(name + "0", 5 + plus, plus + 1);
      return begin(out, name, time);
    }
    const std::int64_t by = minus(time, last[now]);
    if (by == 0 && old) return out.symbol(name + "m", 516, 511);
    if (by == static_cast<std::int32_t>(by)) {
      const auto d = static_cast<std::int32_t>(by);
      const float ratio = float(d) / float(step[now]);
      const int multiple = int(ratio > 0 ? ratio + 0.5f : ratio - 0.5f);
      const auto predicted = [&](int m, std::uint32_t code, std::uint32_t context) {
        out.symbol(name + "m", 515 + plus, code);
        out.integer(name, 32, context,
                    static_cast<std::int32_t>(static_cast<std::uint32_t>(m) *
                                              static_cast<std::uint32_t>(step[now])),
                    d);
      };
      const auto note = [&] {
        if (++extreme[now] > 3) {
          step[now] = d;
          extreme[now] = 0;
        }
      };
      if (multiple == 1) {
        predicted(1, 1, 1);
        extreme[now] = 0;
      } else if (multiple > 0 && multiple < 500) {
        predicted(multiple, static_cast<std::uint32_t>(multiple), multiple < 10 ? 2 : 3);
      } else if (multiple >= 500) {
        predicted(500, 500, 4);
        note();
      } else if (multiple < 0 && multiple > -10) {
        predicted(multiple, static_cast<std::uint32_t>(500 - multiple), 5);
      } else if (multiple <= -10) {
        predicted(-10, 510, 6);
        note();
      } else {
        predicted(0, 0, 7);
        note();
      }
      last[now] = time;
      return;
    }
    if (const auto other = sequence(time)) {
      out.symbol(name + "m", 515 + plus, 511 + plus + other);
      now = (now + other) & 3;
      return encode(out, name, time, old);
    }
    out.symbol(name + "m", 515 + plus, 511 + plus);
    begin(out, name, time);
  }

 private:
  [[nodiscard]] std::uint32_t sequence(std::int64_t time) const {
    for (std::uint32_t i = 1; i < 4; ++i) {
      const std::int64_t by = minus(time, last[(now + i) & 3]);
      if (by == static_cast<std::int32_t>(by)) return i;
    }
    return 0;
  }
  static std::int64_t minus(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
  }
  void begin(coder& out, const std::string& name, std::int64_t time) {
    out.integer(name, 32, 8, static_cast<std::int32_t>(last[now] >> 32),
                static_cast<std::int32_t>(time >> 32));
    out.raw(32, static_cast<std::uint32_t>(time));
    newest = (newest + 1) & 3;
    now = newest;
    last[now] = time;
    step[now] = extreme[now] = 0;
  }
};

inline void encode_color(coder& out, const std::string& name, const std::string& last,
                         const std::string& now) {
  std::uint32_t changes = 0;
  for (std::size_t i = 0; i < 6; ++i) changes |= (now[i] != last[i] ? 1u : 0u) << i;
  const bool grey = now.substr(0, 2) == now.substr(2, 2) && now.substr(0, 2) == now.substr(4, 2);
  if (!grey) changes |= 64;
  out.symbol(name, 128, changes);
  const auto difference = [&](std::size_t i) { return int(byte(now, i)) - int(byte(last, i)); };
  const auto put_byte = [&](std::size_t i, int expected) {
    if (changes & (1u << i))
      out.symbol(name + std::to_string(i), 256,
                 (byte(now, i) - static_cast<std::uint32_t>(std::clamp(expected, 0, 255))) & 255u);
  };
  put_byte(0, int(byte(last, 0)));
  put_byte(1, int(byte(last, 1)));
  if (grey) return;
  for (std::size_t b = 0; b < 2; ++b) {
    const int red = difference(b);
    put_byte(2 + b, red + int(byte(last, 2 + b)));
    put_byte(4 + b, (red + difference(2 + b)) / 2 + int(byte(last, 4 + b)));
  }
}

/// A chunk of points of the formats 0 to 3.
inline std::string encode_points(const std::vector<std::string>& records, int format) {
  static constexpr std::uint32_t kinds[8][8] = {
      {15, 14, 13, 12, 11, 10, 9, 8},  {14, 0, 1, 3, 6, 10, 10, 9},
      {13, 1, 2, 4, 7, 11, 11, 10},    {12, 3, 4, 5, 8, 12, 12, 11},
      {11, 6, 7, 8, 9, 13, 13, 12},    {10, 10, 11, 12, 13, 14, 14, 13},
      {9, 10, 11, 12, 13, 14, 15, 14}, {8, 9, 10, 11, 12, 13, 14, 15}};
  const bool timed = format == 1 || format == 3, colored = format >= 2;
  const std::size_t time_at = 20, color_at = timed ? 28 : 20,
                    extra_at = color_at + (colored ? 6 : 0);
  coder out;
  std::string last = records[0];
  std::array<std::int32_t, 16> intensity{};
  std::array<median, 16> dx, dy;
  std::array<std::int32_t, 8> height{};
  times clock;
  if (timed) clock.last[0] = get<std::int64_t>(last, time_at);
  for (std::size_t i = 1; i < records.size(); ++i) {
    const std::string& now = records[i];
    const std::uint32_t r = byte(now, 14) & 7, n = (byte(now, 14) >> 3) & 7, kind = kinds[n][r];
    const std::uint32_t level = n > r ? n - r : r - n, single = n == 1;
    const auto value = get<std::uint16_t>(now, 12);
    const auto differs = [&](std::size_t at) { return now[at] != last[at] ? 1u : 0u; };
    const bool source = get<std::uint16_t>(now, 18) != get<std::uint16_t>(last, 18);
    const bool brighter = value != intensity[kind];
    const std::uint32_t changes = differs(14) << 5 | (brighter ? 1u : 0u) << 4 | differs(15) << 3 |
                                  differs(16) << 2 | differs(17) << 1 | (source ? 1u : 0u);
    out.symbol("changes", 64, changes);
    if (changes & 32) out.symbol("r" + std::to_string(byte(last, 14)), 256, byte(now, 14));
    if (changes & 16) {
      out.integer("i", 16, std::min(kind, 3u), intensity[kind], value);
      intensity[kind] = value;
    }
    if (changes & 8) out.symbol("c" + std::to_string(byte(last, 15)), 256, byte(now, 15));
    if (changes & 4)
      out.symbol("a" + std::to_string((byte(now, 14) >> 6) & 1), 256,
                 (byte(now, 16) - byte(last, 16)) & 255u);
    if (changes & 2) out.symbol("u" + std::to_string(byte(last, 17)), 256, byte(now, 17));
    if (changes & 1)
      out.integer("s", 16, 0, get<std::uint16_t>(last, 18), get<std::uint16_t>(now, 18));
    const auto moved = [&](std::size_t at) {
      return static_cast<std::int32_t>(get<std::uint32_t>(now, at) - get<std::uint32_t>(last, at));
    };
    const auto kx = out.integer("x", 32, single, dx[kind].five[2], moved(0));
    dx[kind].add(moved(0));
    const auto ky =
        out.integer("y", 32, single + (kx < 20 ? kx & ~1u : 20), dy[kind].five[2], moved(4));
    dy[kind].add(moved(4));
    const std::uint32_t mean = (kx + ky) / 2;
    out.integer("z", 32, single + (mean < 18 ? mean & ~1u : 18), height[level],
                get<std::int32_t>(now, 8));
    height[level] = get<std::int32_t>(now, 8);
    if (timed) clock.encode(out, "t", get<std::int64_t>(now, time_at), true);
    if (colored) encode_color(out, "rgb", last.substr(color_at), now.substr(color_at));
    for (std::size_t b = extra_at; b < now.size(); ++b)
      out.symbol("e" + std::to_string(b), 256, (byte(now, b) - byte(last, b)) & 255u);
    last = now;
  }
  return records[0] + out.finish();
}

/// A chunk of points of the formats 6 to 8, of version 3 or 4.
inline std::string encode_layers(const std::vector<std::string>& records, int format, int version) {
  static constexpr std::uint32_t kinds[16][16] = {{0, 1, 2, 3, 4, 5, 3, 4, 4, 5, 5, 5, 5, 5, 5, 5},
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
  struct channel {
    bool used = false, new_time = false;
    std::string last;
    std::array<std::int32_t, 8> intensity{}, height{};
    std::array<median, 12> dx, dy;
    times clock;
    void begin(const std::string& record) {
      used = true;
      last = record;
      intensity.fill(get<std::uint16_t>(record, 12));
      height.fill(get<std::int32_t>(record, 8));
      clock.last[0] = get<std::int64_t>(record, 22);
    }
  };
  std::array<channel, 4> channels;
  const bool colored = format >= 7, infrared = format == 8;
  const std::size_t extra_at = 30 + (colored ? 6 : 0) + (infrared ? 2 : 0);
  const std::size_t layers = 9 + (colored ? 1 : 0) + (infrared ? 1 : 0),
                    extra = records[0].size() - extra_at;
  std::vector<coder> out(layers + extra);
  std::vector<bool> changed(layers + extra);
  changed[0] = true;
  std::uint32_t current = (byte(records[0], 15) >> 4) & 3;
  channels[current].begin(records[0]);
  // The parts behind the point, as each channel had them last; version 3 mixes up the channels.
  std::array<std::string, 4> parts;
  std::size_t part_of = current;
  parts[current] = records[0].substr(30);
  for (std::size_t i = 1; i < records.size(); ++i) {
    const std::string& now = records[i];
    channel& before = channels[current];
    const std::uint32_t next = (byte(now, 15) >> 4) & 3;
    const std::string& last = channels[next].used ? channels[next].last : before.last;
    const std::uint32_t r = byte(now, 14) & 15, n = byte(now, 14) >> 4,
                        last_r = byte(last, 14) & 15, last_n = byte(last, 14) >> 4;
    const std::uint32_t before_r = byte(before.last, 14) & 15,
                        before_n = byte(before.last, 14) >> 4;
    const auto differs = [&](std::size_t at, std::size_t size) {
      return last.compare(at, size, now, at, size) != 0;
    };
    const bool source = differs(20, 2), time = differs(22, 8), angle = differs(18, 2);
    std::uint32_t changes = (next != current ? 64u : 0) | (source ? 32u : 0) | (time ? 16u : 0) |
                            (angle ? 8u : 0) | (n != last_n ? 4u : 0);
    const std::uint32_t turn = (r + 16 - last_r) & 15;
    changes |= turn == 0 ? 0 : turn == 1 ? 1 : turn == 15 ? 2 : 3;
    const std::string of = std::to_string(current) + '/', to = std::to_string(next) + '/';
    out[0].symbol(of + "changes" +
                      std::to_string((before_r == 1 ? 1 : 0) + (before_r >= before_n ? 2 : 0) +
                                     (before.new_time ? 4 : 0)),
                  128, changes);
    if (next != current) {
      out[0].symbol(of + "step", 3, ((next + 4 - current) & 3) - 1);
      if (!channels[next].used) channels[next].begin(before.last);
    }
    current = next;
    channel& c = channels[next];
    const std::string old = c.last;
    if (n != last_n) out[0].symbol(to + "n" + std::to_string(last_n), 16, n);
    if ((changes & 3) == 3)
      time ? out[0].symbol(to + "r" + std::to_string(last_r), 16, r)
           : out[0].symbol(to + "turn", 13, turn - 2);
    const std::uint32_t kind = kinds[n][r] * 2 + (time ? 1 : 0),
                        level = std::min(n > r ? n - r : r - n, 7u),
                        place = (r == 1 ? 2u : 0) + (r >= n ? 1u : 0), single = n == 1;
    const auto moved = [&](std::size_t at) {
      return static_cast<std::int32_t>(get<std::uint32_t>(now, at) - get<std::uint32_t>(old, at));
    };
    const auto kx = out[0].integer(to + "x", 32, single, c.dx[kind].five[2], moved(0));
    c.dx[kind].add(moved(0));
    const auto ky = out[0].integer(to + "y", 32, single + (kx < 20 ? kx & ~1u : 20),
                                   c.dy[kind].five[2], moved(4));
    c.dy[kind].add(moved(4));
    const std::uint32_t mean = (kx + ky) / 2;
    changed[1] = changed[1] || get<std::int32_t>(now, 8) != get<std::int32_t>(old, 8);
    out[1].integer(to + "z", 32, single + (mean < 18 ? mean & ~1u : 18), c.height[level],
                   get<std::int32_t>(now, 8));
    c.height[level] = get<std::int32_t>(now, 8);
    changed[2] = changed[2] || now[16] != old[16];
    out[2].symbol(to + std::to_string((byte(old, 16) & 31) * 2 + (place == 3 ? 1 : 0)), 256,
                  byte(now, 16));
    const auto flags = [](const std::string& p) {
      return byte(p, 15) >> 6 << 4 | (byte(p, 15) & 15);
    };
    changed[3] = changed[3] || flags(now) != flags(old);
    out[3].symbol(to + std::to_string(flags(old)), 64, flags(now));
    const auto value = get<std::uint16_t>(now, 12);
    changed[4] = changed[4] || value != get<std::uint16_t>(old, 12);
    auto& intensity = c.intensity[place * 2 + (time ? 1 : 0)];
    out[4].integer(to, 16, place, intensity, value);
    intensity = value;
    if (angle) {
      changed[5] = true;
      out[5].integer(to, 16, time ? 1 : 0, get<std::uint16_t>(old, 18),
                     get<std::uint16_t>(now, 18));
    }
    changed[6] = changed[6] || now[17] != old[17];
    out[6].symbol(to + std::to_string(byte(old, 17) / 4), 256, byte(now, 17));
    if (source) {
      changed[7] = true;
      out[7].integer(to, 16, 0, get<std::uint16_t>(old, 20), get<std::uint16_t>(now, 20));
    }
    if (time) {
      changed[8] = true;
      c.clock.encode(out[8], to, get<std::int64_t>(now, 22), false);
    }
    c.last = now;
    c.new_time = time;

    std::size_t slot = next;
    if (next != part_of) {
      if (parts[next].empty())
        parts[next] = parts[part_of];
      else if (version == 3)
        slot = part_of;
    }
    std::string& part = parts[slot];
    const std::string tail = now.substr(30);
    if (colored) {
      changed[9] = changed[9] || part.substr(0, 6) != tail.substr(0, 6);
      encode_color(out[9], to, part, tail);
    }
    if (infrared) {
      const auto changes2 = (part[6] != tail[6] ? 1u : 0) | (part[7] != tail[7] ? 2u : 0);
      changed[10] = changed[10] || changes2 != 0;
      out[10].symbol(to, 4, changes2);
      for (std::size_t b = 0; b < 2; ++b)
        if (changes2 & (1u << b))
          out[10].symbol(to + std::to_string(b), 256,
                         (byte(tail, 6 + b) - byte(part, 6 + b)) & 255u);
    }
    for (std::size_t b = 0; b < extra; ++b) {
      const std::size_t at = extra_at - 30 + b;
      changed[layers + b] = changed[layers + b] || part[at] != tail[at];
      out[layers + b].symbol(to, 256, (byte(tail, at) - byte(part, at)) & 255u);
    }
    const std::string remembered = infrared ? part.substr(6, 2) : "";
    part = tail;
    // Version 3 remembers infrared by the channel of the point, unlike the rest.
    if (infrared) {
      part.replace(6, 2, remembered);
      parts[next].replace(6, 2, tail.substr(6, 2));
    }
    part_of = next;
  }
  std::string chunk = records[0], bytes;
  const auto put_number = [&](std::size_t value) {
    std::string four(4, '\0');
    put(four, 0, static_cast<std::uint32_t>(value));
    chunk += four;
  };
  put_number(records.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::string layer = changed[i] ? out[i].finish() : "";
    put_number(layer.size());
    bytes += layer;
  }
  return chunk + bytes;
}

/// A file with chunks of so many points; of sizes that the table tells if `variable`.
inline std::string file(las_bytes made, std::size_t chunk_size, int version = 0,
                        bool variable = false) {
  const bool layered = made.format >= 6;
  if (version == 0) version = layered ? 3 : 2;
  std::vector<std::string> records;
  for (std::size_t at = 0; at < made.points.size(); at += made.record_length)
    records.push_back(made.points.substr(at, made.record_length));

  std::string how(34, '\0');
  put(how, 0, static_cast<std::uint16_t>(layered ? 3 : 2));
  how[4] = 3;
  put(how, 12, variable ? 0xffffffffu : static_cast<std::uint32_t>(chunk_size));
  put(how, 16, std::int64_t{-1});
  put(how, 24, std::int64_t{-1});
  std::uint16_t items = 0;
  std::size_t known = 0;
  const auto add_item = [&](int kind, std::size_t size) {
    std::string six(6, '\0');
    put(six, 0, static_cast<std::uint16_t>(kind));
    put(six, 2, static_cast<std::uint16_t>(size));
    put(six, 4, static_cast<std::uint16_t>(version));
    how += six;
    ++items;
    known += size;
  };
  if (layered) {
    add_item(10, 30);
    if (made.format == 7) add_item(11, 6);
    if (made.format == 8) add_item(12, 8);
  } else {
    add_item(6, 20);
    if (made.format == 1 || made.format == 3) add_item(7, 8);
    if (made.format >= 2) add_item(8, 6);
  }
  if (made.record_length > known) add_item(layered ? 14 : 0, made.record_length - known);
  put(how, 32, items);
  made.add_record("laszip encoded", 22204, "", how);

  std::string chunks;
  std::vector<std::pair<std::size_t, std::size_t>> table;
  for (std::size_t at = 0; at < records.size();) {
    // Some sizes that differ.
    const std::size_t size = variable ? chunk_size + table.size() % 3 : chunk_size;
    const std::size_t end = std::min(records.size(), at + size);
    const std::vector<std::string> some(records.begin() + static_cast<std::ptrdiff_t>(at),
                                        records.begin() + static_cast<std::ptrdiff_t>(end));
    const auto chunk =
        layered ? encode_layers(some, made.format, version) : encode_points(some, made.format);
    table.emplace_back(some.size(), chunk.size());
    chunks += chunk;
    at = end;
  }
  std::string tail(8, '\0');
  put(tail, 4, static_cast<std::uint32_t>(table.size()));
  coder out;
  std::pair<std::size_t, std::size_t> last;
  for (const auto& entry : table) {
    if (variable)
      out.integer("s", 32, 0, static_cast<std::int32_t>(last.first),
                  static_cast<std::int32_t>(entry.first));
    // The same models of high bits serve both.
    out.integer("s", 32, 1, static_cast<std::int32_t>(last.second),
                static_cast<std::int32_t>(entry.second));
    last = entry;
  }
  if (!table.empty()) tail += out.finish();

  const std::uint64_t count = made.count();
  made.points.clear();
  auto bytes = made.file();
  bytes[104] = static_cast<char>(made.format | 0x80);
  if (made.format < 6) put(bytes, 107, static_cast<std::uint32_t>(count));
  if (made.minor == 4) put(bytes, 247, count);
  std::string where(8, '\0');
  put(where, 0, static_cast<std::uint64_t>(bytes.size() + 8 + chunks.size()));
  return bytes + where + chunks + tail;
}

}  // namespace test::laz
