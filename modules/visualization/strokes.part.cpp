// SPDX-License-Identifier: MIT
//
// Texts as polylines, for pictures that need neither a font file nor a library that reads one.
// Internal. The letters are cilantro's own.
module cilantro.visualization:strokes;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;

namespace cilantro {

/// A polyline of a text, in units of its height: x to the right, y down; (0, 0) is the top left of
/// the first line's capital letters, and a capital letter is 1 high. It has two points or more.
using stroke = std::vector<Eigen::Vector2f>;

/// A text as polylines.
struct stroked_text {
  std::vector<stroke> strokes;
  float width = 0;   ///< Of its longest line.
  float height = 0;  ///< Down to where the letters of its last line stand: tails hang 1/3 below.
};

/// How high a capital letter is on the grid that glyphs are drawn on; a small one is 8 high, and
/// tails hang 4 deep.
constexpr float grid_height = 12;

/// How a character is drawn.
struct glyph {
  char32_t code;
  int width;
  /// Strokes, with spaces between. A point is two digits, x and y down, where A is 10, B is 11 and
  /// so on. `00-C0` is a line; `06(00)60` is an arc that rounds the corner 00, a quarter of an
  /// ellipse where that is a right angle.
  std::string_view strokes;
};

/// In the order of their codes. All digits are equally wide, so that numbers beneath each other
/// line up.
constexpr std::array glyphs = {
    glyph{' ', 1, ""},
    glyph{'!', 0, "00-08 0B-0C"},
    glyph{'"', 3, "00-03 30-33"},
    glyph{'#', 9, "30-1C 80-6C 14-94 08-88"},
    glyph{'$', 8, "83(72)42(02)04(05)46(87)88(8A)4A(1A)09 40-4C"},
    glyph{'%', 12, "20(40)43(46)26(06)03(00)20 90-3C A6(C6)C9(CC)AC(8C)89(86)A6"},
    glyph{'&', 9, "9C-24(12)12(10)30-40(60)62(64)35(06)09(0C)3C-4C(7C)97"},
    glyph{'\'', 0, "00-03"},
    glyph{'(', 3, "30(03)07(0B)3E"},
    glyph{')', 3, "00(33)37(3B)0E"},
    glyph{'*', 6, "30-36 01-65 61-05"},
    glyph{'+', 8, "43-4B 07-87"},
    glyph{',', 1, "1B-1C-0E"},
    glyph{'-', 5, "07-57"},
    glyph{'.', 0, "0B-0C"},
    glyph{'/', 6, "60-0C"},
    glyph{'0', 8, "40(80)84-88(8C)4C(0C)08-04(00)40"},
    glyph{'1', 8, "14-50-5C"},
    glyph{'2', 8, "03(00)40(80)83(84)66-0C-8C"},
    glyph{'3', 8, "02(10)40(70)73(76)46-36 46(86)89(8C)4C(1C)0A"},
    glyph{'4', 8, "6C-60-08-88"},
    glyph{'5', 8, "70-10-06(15)44(84)88(8C)4C(1C)0A"},
    glyph{'6', 8, "71(60)50(00)07-08(0C)4C(8C)88(84)44(04)08"},
    glyph{'7', 8, "00-80-3C"},
    glyph{'8', 8, "40(70)73(76)46(16)13(10)40 46(86)89(8C)4C(0C)09(06)46"},
    glyph{'9', 8, "1B(2C)3C(8C)85-84(80)40(00)04(08)48(88)84"},
    glyph{':', 0, "05-06 0B-0C"},
    glyph{';', 1, "15-16 1B-1C-0E"},
    glyph{'<', 8, "83-07-8B"},
    glyph{'=', 8, "05-85 09-89"},
    glyph{'>', 8, "03-87-0B"},
    glyph{'?', 7, "02(10)30-40(70)73(75)56(47)48 4B-4C"},
    glyph{'@', 14, "BD(9E)7E(0E)07(00)70(E0)E7(EA)CA(AA)A8-A4 A7(A4)74(44)47(4A)7A(AA)A7"},
    glyph{'A', 10, "0C-50-AC 28-88"},
    glyph{'B', 8, "00-40(70)73(76)46-06 46-56(86)89(8C)5C-0C-00"},
    glyph{'C', 9, "92(80)50(00)06(0C)5C(8C)9A"},
    glyph{'D', 9, "00-30(90)96(9C)3C-0C-00"},
    glyph{'E', 7, "70-00-0C-7C 06-66"},
    glyph{'F', 7, "70-00-0C 06-66"},
    glyph{'G', 9, "92(80)50(00)06(0C)5C(9C)97-57"},
    glyph{'H', 9, "00-0C 90-9C 06-96"},
    glyph{'I', 0, "00-0C"},
    glyph{'J', 6, "60-69(6C)3C(0C)09"},
    glyph{'K', 8, "00-0C 80-07 34-8C"},
    glyph{'L', 7, "00-0C-7C"},
    glyph{'M', 10, "0C-00-59-A0-AC"},
    glyph{'N', 9, "0C-00-9C-90"},
    glyph{'O', 10, "50(A0)A6(AC)5C(0C)06(00)50"},
    glyph{'P', 8, "0C-00-50(80)83-84(87)57-07"},
    glyph{'Q', 10, "50(A0)A6(AC)5C(0C)06(00)50 79-AC"},
    glyph{'R', 8, "0C-00-50(80)83-84(87)57-07 47-8C"},
    glyph{'S', 8, "82(70)40(00)03(05)46(87)89(8C)4C(1C)0A"},
    glyph{'T', 8, "00-80 40-4C"},
    glyph{'U', 8, "00-08(0C)4C(8C)88-80"},
    glyph{'V', 10, "00-5C-A0"},
    glyph{'W', 14, "00-3C-70-BC-E0"},
    glyph{'X', 9, "00-9C 90-0C"},
    glyph{'Y', 8, "00-46-80 46-4C"},
    glyph{'Z', 8, "00-80-0C-8C"},
    glyph{'[', 3, "30-00-0E-3E"},
    glyph{'\\', 6, "00-6C"},
    glyph{']', 3, "00-30-3E-0E"},
    glyph{'^', 6, "04-30-64"},
    glyph{'_', 8, "0E-8E"},
    glyph{'`', 2, "00-22"},
    glyph{'a', 6, "05(14)34(64)67-6C 68-38(08)0A(0C)3C(6C)69"},
    glyph{'b', 7, "00-0C 08(04)34-44(74)78(7C)4C-3C(0C)08"},
    glyph{'c', 6, "65(54)34(04)08(0C)3C(5C)6B"},
    glyph{'d', 7, "70-7C 78(74)44-34(04)08(0C)3C-4C(7C)78"},
    glyph{'e', 7, "08-78(74)44-34(04)08(0C)3C-4C(6C)7A"},
    glyph{'f', 4, "40(10)13-1C 04-44"},
    glyph{'g', 7, "74-7C(7G)3G(1G)0F 78(74)44-34(04)08(0C)3C-4C(7C)78"},
    glyph{'h', 6, "00-0C 07(04)34(64)67-6C"},
    glyph{'i', 0, "00-01 04-0C"},
    glyph{'j', 2, "20-21 24-2D(2G)0G"},
    glyph{'k', 6, "00-0C 64-0A 37-6C"},
    glyph{'l', 2, "00-0A(0C)2C"},
    glyph{'m', 10, "04-0C 07(04)34(54)57-5C 57(54)84(A4)A7-AC"},
    glyph{'n', 6, "04-0C 07(04)34(64)67-6C"},
    glyph{'o', 7, "34-44(74)78(7C)4C-3C(0C)08(04)34"},
    glyph{'p', 7, "04-0G 08(04)34-44(74)78(7C)4C-3C(0C)08"},
    glyph{'q', 7, "74-7G 78(74)44-34(04)08(0C)3C-4C(7C)78"},
    glyph{'r', 4, "04-0C 08(04)44"},
    glyph{'s', 6, "65(54)34(04)06(07)38(69)6A(6C)3C(1C)0B"},
    glyph{'t', 4, "11-19(1C)4C 04-44"},
    glyph{'u', 6, "04-09(0C)3C(6C)69 64-6C"},
    glyph{'v', 6, "04-3C-64"},
    glyph{'w', 12, "04-3C-64-9C-C4"},
    glyph{'x', 6, "04-6C 64-0C"},
    glyph{'y', 6, "04-3C 64-3C(2G)0G"},
    glyph{'z', 6, "04-64-0C-6C"},
    glyph{'{', 4, "40(20)22-25(27)07(27)29-2C(2E)4E"},
    glyph{'|', 0, "00-0E"},
    glyph{'}', 4, "00(20)22-25(27)47(27)29-2C(2E)0E"},
    glyph{'~', 8, "08(06)26(36)47(58)68(88)86"},
    glyph{U'°', 4, "20(40)42(44)24(04)02(00)20"},
    glyph{U'±', 8, "41-49 05-85 0C-8C"},
    glyph{U'²', 4, "01(00)20(40)42-06-46"},
    glyph{U'\u00B5', 6, "04-0G 09(0C)3C(6C)69 64-6C"},
    glyph{U'\u03BC', 6, "04-0G 09(0C)3C(6C)69 64-6C"},
    glyph{U'\u2013', 8, "07-87"},  // The en dash,
    glyph{U'\u2212', 8, "07-87"},  // and the minus sign.
};
static_assert(std::ranges::is_sorted(glyphs, {}, &glyph::code));

/// Stands for what there is no glyph of.
constexpr glyph missing_glyph{0, 7, "00-70-7C-0C-00"};

static const glyph& glyph_of(char32_t code) {
  const auto* const found = std::ranges::lower_bound(glyphs, code, {}, &glyph::code);
  return found != glyphs.end() && found->code == code ? *found : missing_glyph;
}

/// What malformed UTF-8 is read as: one beyond the last code point.
constexpr char32_t malformed = 0x110000;

/// Takes the first code point off a text that is not empty; where it is malformed, one byte.
static char32_t take_code_point(std::string_view& utf8) {
  const auto byte = [&](index_t i) { return static_cast<unsigned char>(utf8[i]); };
  // The first byte tells how many there are: by its leading ones, or it is alone.
  const int ones = std::countl_one(byte(0));
  const index_t length = std::max(ones, 1);
  char32_t code = byte(0) & (0x7F >> ones);
  bool is_valid = ones != 1 && ones <= 4 && length <= std::ssize(utf8);
  for (index_t i = 1; is_valid && i < length; ++i) {
    is_valid = byte(i) >> 6 == 0b10;
    code = code << 6 | (byte(i) & 0x3F);
  }
  // Longer forms than needed are malformed, too, and so are surrogates.
  constexpr std::array<char32_t, 5> smallest{0, 0, 0x80, 0x800, 0x10000};
  is_valid =
      is_valid && smallest[ones] <= code && code < malformed && (code < 0xD800 || 0xDFFF < code);
  utf8.remove_prefix(is_valid ? length : 1);
  return is_valid ? code : malformed;
}

static bool is_control(char32_t code) {
  return code < 0x20 || (0x7F <= code && code < 0xA0);
}

static float digit(char c) {
  return static_cast<float>(c <= '9' ? c - '0' : c - 'A' + 10);
}

/// Appends the points of an arc, but for its first.
static void append_arc(stroke& points, const Eigen::Vector2f& corner, const Eigen::Vector2f& end) {
  constexpr int pieces = 8;
  const Eigen::Vector2f start = points.back();
  // A rational Bézier curve with this weight in the middle is an arc of an ellipse.
  const float weight = std::sqrt(0.5f);
  for (int i = 1; i <= pieces; ++i) {
    const float t = static_cast<float>(i) / pieces;
    const float a = (1 - t) * (1 - t), b = 2 * weight * t * (1 - t), c = t * t;
    points.push_back((a * start + b * corner + c * end) / (a + b + c));
  }
}

/// Appends the strokes of a glyph whose top left is at `origin`.
static void append_strokes(std::vector<stroke>& strokes, const glyph& drawn,
                           const Eigen::Vector2f& origin) {
  std::string_view rest = drawn.strokes;
  const auto take_point = [&] {
    const Eigen::Vector2f point{digit(rest[0]), digit(rest[1])};
    rest.remove_prefix(2);
    return Eigen::Vector2f{origin + point / grid_height};
  };
  while (!rest.empty()) {
    stroke& points = strokes.emplace_back();
    points.push_back(take_point());
    while (!rest.empty() && rest.front() != ' ') {
      const bool is_arc = rest.front() == '(';
      rest.remove_prefix(1);
      const Eigen::Vector2f next = take_point();
      if (is_arc) {
        rest.remove_prefix(1);
        append_arc(points, next, take_point());
      } else {
        points.push_back(next);
      }
    }
    if (!rest.empty()) rest.remove_prefix(1);
  }
}

/// The strokes of a text. `\n` begins a new line, other control characters are left out, and a box
/// stands for each character that there is no glyph of, and for each byte that is no UTF-8. There
/// are glyphs of ASCII and of ° ± ² µ – −.
[[nodiscard]] stroked_text strokes_of(std::string_view utf8) {
  constexpr float gap = 3.5f / grid_height;
  constexpr float line_pitch = 1.75f;
  stroked_text text{.height = 1};
  Eigen::Vector2f origin = Eigen::Vector2f::Zero();
  while (!utf8.empty()) {
    const char32_t code = take_code_point(utf8);
    if (code == '\n') {
      origin = {0, origin.y() + line_pitch};
      text.height += line_pitch;
    }
    if (is_control(code)) continue;
    const glyph& drawn = glyph_of(code);
    append_strokes(text.strokes, drawn, origin);
    const float end = origin.x() + static_cast<float>(drawn.width) / grid_height;
    text.width = std::max(text.width, end);
    origin.x() = end + gap;
  }
  return text;
}

}  // namespace cilantro
