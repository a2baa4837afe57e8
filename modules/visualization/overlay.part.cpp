// SPDX-License-Identifier: MIT
//
// Texts and bars of colours, over a finished picture. Internal.
module cilantro.visualization:overlay;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :canvas;
import :projector;
import :render;
import :scene;
import :strokes;

namespace cilantro {

/// As many digits as tell values of a range apart; what is next to nothing beside it is 0.
inline std::string in_few_digits(double value, double range) {
  range = std::min(range, std::numeric_limits<double>::max());
  if (std::abs(value) < 1e-6 * range) value = 0;
  const double steps = range > 0 ? std::max(std::abs(value) / range, 1.0) : 1;
  const int digits = std::clamp(4 + int(std::ceil(std::log10(steps))), 4, 15);
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::general, digits);
  return {text.data(), end.ptr};
}

namespace {

void mix(rgb& pixel, const rgb& color, float share) {
  for (std::size_t k = 0; k < 3; ++k)
    pixel[k] = static_cast<std::uint8_t>(
        std::lround(float(pixel[k]) + share * (float(color[k]) - float(pixel[k]))));
}

float distance_to_segment(const Eigen::Vector2f& p, const Eigen::Vector2f& a,
                          const Eigen::Vector2f& b) {
  const Eigen::Vector2f along = b - a;
  const float square = along.squaredNorm();
  const float t = square > 0 ? std::clamp((p - a).dot(along) / square, 0.0f, 1.0f) : 0;
  return (a + t * along - p).norm();
}

/// A text whose capital letters are `height` pixels high, the top left of its first at (x, y).
class written_text {
 public:
  written_text(std::string_view text, float height) : text_{strokes_of(text)}, height_{height} {}
  [[nodiscard]] float width() const { return text_.width * height_; }
  [[nodiscard]] float full_height() const { return text_.height * height_; }

  /// The letters, and around them, so that they can be read on anything, the background.
  void draw(image<rgb>& picture, float x, float y, const rgb& color, const rgb& background) const {
    const float half = std::max(height_ / 18, 0.55f);
    cover(picture, x, y, half + 1.2f, background, 0.6f);
    cover(picture, x, y, half, color, 1);
  }

 private:
  /// How much of each pixel is nearer to the strokes than `half`, about.
  void cover(image<rgb>& picture, float x, float y, float half, const rgb& color,
             float opacity) const {
    const float margin = half + 1;
    const auto within = [](float at, int size) { return int(std::clamp(at, -1.0f, float(size))); };
    const int left = std::max(0, within(std::floor(x - margin), picture.width()));
    const int right =
        std::min(picture.width() - 1, within(std::ceil(x + width() + margin), picture.width()));
    const int top = std::max(0, within(std::floor(y - 0.3f * height_ - margin), picture.height()));
    const int bottom =
        std::min(picture.height() - 1,
                 within(std::ceil(y + full_height() + 0.5f * height_ + margin), picture.height()));
    if (left > right || top > bottom) return;
    const int columns = right - left + 1;
    std::vector<float> shares(std::size_t(columns) * std::size_t(bottom - top + 1), 0.0f);
    for (const auto& stroke : text_.strokes)
      for (std::size_t i = 0; i + 1 < std::max<std::size_t>(stroke.size(), 2); ++i) {
        const Eigen::Vector2f a = at(stroke[i], x, y),
                              b = at(stroke[std::min(i + 1, stroke.size() - 1)], x, y);
        const int u0 =
            std::max(left, within(std::floor(std::min(a.x(), b.x()) - margin), picture.width()));
        const int u1 =
            std::min(right, within(std::ceil(std::max(a.x(), b.x()) + margin), picture.width()));
        const int v0 =
            std::max(top, within(std::floor(std::min(a.y(), b.y()) - margin), picture.height()));
        const int v1 =
            std::min(bottom, within(std::ceil(std::max(a.y(), b.y()) + margin), picture.height()));
        for (int v = v0; v <= v1; ++v)
          for (int u = u0; u <= u1; ++u) {
            float& share =
                shares[std::size_t(v - top) * std::size_t(columns) + std::size_t(u - left)];
            share = std::max(
                share, std::clamp(half + 0.5f - distance_to_segment({float(u), float(v)}, a, b),
                                  0.0f, 1.0f));
          }
      }
    for (int v = top; v <= bottom; ++v)
      for (int u = left; u <= right; ++u)
        mix(picture(u, v), color,
            opacity * shares[std::size_t(v - top) * std::size_t(columns) + std::size_t(u - left)]);
  }
  [[nodiscard]] Eigen::Vector2f at(const Eigen::Vector2f& p, float x, float y) const {
    return {x + height_ * p.x(), y + height_ * p.y()};
  }

  stroked_text text_;
  float height_;
};

rgb readable_on(const rgb& background) {
  const int light = 299 * background[0] + 587 * background[1] + 114 * background[2];
  return light > 128'000 ? rgb{20, 22, 26} : rgb{240, 240, 240};
}

/// What a bar of colours consists of, in a picture of a given height.
struct written_legend {
  float letter, bar_width, gap;
  written_text title;
  std::array<written_text, 3> numbers;
  float width;

  written_legend(const color_legend& legend, int picture_height)
      : letter{letter_height(picture_height)},
        bar_width{1.4f * letter},
        gap{0.6f * letter},
        title{legend.title, letter},
        numbers{number(legend.high, legend), number(legend.low / 2 + legend.high / 2, legend),
                number(legend.low, legend)} {
    float widest = 0;
    for (const auto& one : numbers) widest = std::max(widest, one.width());
    width = std::max(widest + gap + bar_width, title.width());
  }
  static float letter_height(int picture_height) {
    return std::clamp(float(picture_height) / 60, 7.0f, 24.0f);
  }
  /// What there is for each of some legends that stand above each other.
  static float height_of_each(std::size_t legends, int picture_height) {
    const float height = float(picture_height);
    const float letter = letter_height(picture_height);
    // As many as there is room for, rather than none that can be read.
    return std::min(
        std::max(std::min((height - 2 * letter) / float(legends), height / 2), 7.5f * letter),
        height - 2 * letter);
  }
  /// Of the bar within that; 0 if it would be too small to be read.
  [[nodiscard]] float bar_height(float room) const {
    const float height = room - 4 * letter;
    return height < 3 * letter ? 0 : height;
  }

 private:
  [[nodiscard]] written_text number(double value, const color_legend& legend) const {
    return {in_few_digits(value, legend.high - legend.low), letter};
  }
};

/// One bar at the right border, the first at the top; returns where the next one may begin.
float draw_legend(image<rgb>& picture, const color_legend& legend, float top, float room,
                  const rgb& background) {
  const written_legend written{legend, picture.height()};
  const float letter = written.letter, bar_width = written.bar_width;
  const rgb ink = readable_on(background);
  const float bar_height = written.bar_height(room);
  if (bar_height == 0) return top;

  const float left = float(picture.width()) - letter - written.width;
  // Whatever is there must not make the numbers unreadable.
  for (int y = std::max(0, int(top - letter / 2));
       y < std::min(picture.height(), int(top + room - letter)); ++y)
    for (int x = std::max(0, int(left - letter / 2)); x < picture.width(); ++x)
      mix(picture(x, y), background, 0.6f);
  written.title.draw(picture, left, top, ink, background);

  const int x0 = std::max(0, int(left)), x1 = std::min(picture.width() - 1, int(left + bar_width));
  const int y0 = std::max(0, int(top + 2 * letter));
  const int y1 = std::min(picture.height() - 1, int(top + 2 * letter + bar_height));
  for (int y = y0; y <= y1; ++y) {
    const double share = y1 > y0 ? double(y1 - y) / double(y1 - y0) : 0;
    const auto number =
        std::min(std::size_t(share * double(legend.colors.size())), legend.colors.size() - 1);
    for (int x = x0; x <= x1; ++x) picture(x, y) = legend.colors[number];
  }
  for (std::size_t k = 0; k < 3; ++k)
    written.numbers[k].draw(picture, left + bar_width + written.gap,
                            float(y0) + float(k) / 2 * float(y1 - y0) - letter / 2, ink,
                            background);
  return top + room;
}

}  // namespace

/// How many columns at the right border a legend takes that is the only one; 0 if the picture is
/// too low for it.
int legend_room(const color_legend& legend, int picture_height) {
  const written_legend written{legend, picture_height};
  if (written.bar_height(written_legend::height_of_each(1, picture_height)) == 0) return 0;
  return static_cast<int>(std::ceil(written.width + 2 * written.letter));
}

/// The bars beside a picture: those that say the same once.
inline std::vector<const color_legend*> legends_of(const scene& all) {
  std::vector<const color_legend*> legends;
  for (const auto& layer : all.layers())
    if (!layer.is_hidden)
      for (const auto& one : layer.content->legends())
        if (std::ranges::none_of(legends, [&](const auto* known) { return *known == one; }))
          legends.push_back(&one);
  return legends;
}

/// Draws the labels and legends of a scene over its picture.
void draw_overlay(image<rgb>& picture, const scene& all, const projector& by,
                  const render_options& options) {
  for (const auto& layer : all.layers()) {
    if (layer.is_hidden || !options.labels) continue;
    for (const auto& one : layer.content->labels()) {
      const Eigen::Vector3d p = by(one.place);
      if (!(p.z() > by.nearest)) continue;
      const auto [x, y, z] = by.seen(p);
      if (std::abs(x) > 1e6 || std::abs(y) > 1e6) continue;
      const written_text text{one.text, float(one.height)};
      text.draw(picture, float(x), float(y) - text.full_height(),
                one.color.value_or(readable_on(options.background)), options.background);
    }
  }
  if (!options.legends) return;
  const auto legends = legends_of(all);
  const float room = written_legend::height_of_each(legends.size(), picture.height());
  float top = written_legend::letter_height(picture.height());
  for (const auto* legend : legends)
    if (top + room <= float(picture.height()))
      top = draw_legend(picture, *legend, top, room, options.background);
}

}  // namespace cilantro
