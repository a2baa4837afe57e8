// SPDX-License-Identifier: MIT
module;
#include <cctype>

#include "io/common/byte_stream.hpp"
#include "io/common/number.hpp"
module cilantro.io;

import :cloud_builder;

namespace cilantro {
namespace {

using detail::number;

// Such that no comment of anybody else is taken for it.
constexpr std::string_view origin_keyword = "cilantro origin ", size_keyword = "cilantro size ";

}  // namespace

bool same_name(std::string_view a, std::string_view b) {
  return std::ranges::equal(
      a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

template <Scalar S, int D>
cloud_builder<S, D>::cloud_builder(std::vector<file_field> fields, origin_policy origin, style how)
    : fields_{std::move(fields)}, origin_{origin}, is_text_{how == style::text} {
  targets_.resize(fields_.size());
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    if (fields_[f].is_skipped) continue;
    targets_[f].to = kind::attribute;
    detail::visit_number(fields_[f].type,
                         [&]<class T>(T) { targets_[f].values = std::vector<T>{}; });
  }
  if constexpr (D == 2) {
    has_points_ = assign({"x", "y"}, kind::point);
    with_normals_ =
        assign({"nx", "ny"}, kind::normal) || assign({"normal_x", "normal_y"}, kind::normal);
  } else {
    has_points_ = assign({"x", "y", "z"}, kind::point);
    with_normals_ = assign({"nx", "ny", "nz"}, kind::normal) ||
                    assign({"normal_x", "normal_y", "normal_z"}, kind::normal);
  }
  with_colors_ = assign({"red", "green", "blue"}, kind::color) ||
                 assign({"r", "g", "b"}, kind::color) ||
                 assign({"diffuse_red", "diffuse_green", "diffuse_blue"}, kind::color);
  if (how == style::packed && !with_colors_)
    with_colors_ = assign({"rgba"}, kind::packed_color) || assign({"rgb"}, kind::packed_color);
  for (std::size_t f = 0; f < targets_.size(); ++f)
    if (targets_[f].to == kind::point && std::same_as<S, float> &&
        detail::size_of(fields_[f].type) > 2 && fields_[f].type != number::float32)
      is_wide_ = origin_ == origin_policy::automatic;
}

template <Scalar S, int D>
bool cloud_builder<S, D>::assign(std::initializer_list<std::string_view> names, kind to) {
  std::vector<std::size_t> places;
  for (const auto name : names) {
    const auto found = std::ranges::find_if(fields_, [&](const file_field& f) {
      if (f.is_skipped || !same_name(f.name, name)) return false;
      if (to == kind::color) return f.type == number::uint8 || detail::is_floating(f.type);
      if (to == kind::packed_color)
        return f.type == number::float32 || f.type == number::uint32 || f.type == number::int32;
      return true;
    });
    if (found == fields_.end()) return false;
    places.push_back(found - fields_.begin());
  }
  index_t row = 0;
  for (const std::size_t f : places) {
    targets_[f].to = to;
    targets_[f].row = row++;
  }
  return true;
}

template <Scalar S, int D>
void cloud_builder<S, D>::resize(index_t count) {
  is_wide_ ? wide_.resize(D, count) : cloud_.points.resize(D, count);
  if (with_normals_) cloud_.normals.resize(D, count);
  if (with_colors_) cloud_.colors.resize(3, count);
  for (std::size_t f = 0; f < targets_.size(); ++f) {
    if (targets_[f].to == kind::attribute)
      std::visit([&](auto& v) { v.resize(count); }, targets_[f].values);
    if (targets_[f].to == kind::packed_color && same_name(fields_[f].name, "rgba"))
      targets_[f].alpha.resize(count);
  }
}

template <Scalar S, int D>
void cloud_builder<S, D>::store_column(std::size_t f, index_t first, index_t n, const char* data,
                                       std::size_t stride, bool swap) {
  if (n == 0) return;
  detail::visit_number(fields_[f].type, [&]<class T>(T) {
    swap ? store_column<T, true>(f, first, n, data, stride)
         : store_column<T, false>(f, first, n, data, stride);
  });
}

template <Scalar S, int D>
template <class T, bool swap>
void cloud_builder<S, D>::store_column(std::size_t f, index_t first, index_t n, const char* data,
                                       std::size_t stride) {
  auto& to = targets_[f];
  const auto each = [&](auto* out, index_t step, auto convert) {
    for (index_t i = 0; i < n; ++i, data += stride, out += step)
      *out = convert(detail::load_number<T>(data, swap));
  };
  const auto as_scalar = [](T v) { return static_cast<S>(v); };
  switch (to.to) {
    case kind::none:
      break;
    case kind::point:
      if (is_wide_)
        each(&wide_(to.row, first), D, [](T v) { return static_cast<double>(v); });
      else
        each(&cloud_.points(to.row, first), D, as_scalar);
      break;
    case kind::normal:
      each(&cloud_.normals(to.row, first), D, as_scalar);
      break;
    case kind::color:
      each(&cloud_.colors(to.row, first), 3, as_color<T>);
      break;
    case kind::packed_color:
      for (index_t i = first; i < first + n; ++i, data += stride)
        store_packed(to, i, detail::load_number<T>(data, swap));
      break;
    case kind::attribute:
      each(std::get_if<std::vector<T>>(&to.values)->data() + first, 1, [](T v) { return v; });
  }
}

/// The median, so that a point that strays does not take all others with it; of those that are far,
/// if they are more than a tenth, so that what was not measured and is 0 does not hide them.
template <Scalar S, int D>
void cloud_builder<S, D>::choose_origin() {
  if (wide_.cols() == 0) return;  // A row of nothing cannot even be looked at.
  constexpr double far = 10'000;
  point_vector<double, D> middle = point_vector<double, D>::Zero();
  bool is_rounded = false;
  std::vector<double> finite;
  for (index_t d = 0; d < D; ++d) {
    finite.clear();
    for (const double value : wide_.row(d))
      if (std::isfinite(value)) finite.push_back(value);
    if (finite.empty()) continue;
    const auto near = std::ranges::partition(finite, [](double v) { return std::abs(v) >= far; });
    const std::span all_far{finite.begin(), near.begin()};
    if (std::ssize(all_far) * 10 <= std::ssize(finite)) continue;
    const auto median = all_far.begin() + std::ssize(all_far) / 2;
    std::ranges::nth_element(all_far, median);
    middle[d] = std::round(*median);
    is_rounded =
        is_rounded || !std::ranges::all_of(all_far, [&](double value) { return is_exact(value); });
  }
  if (is_rounded) cloud_.origin = middle;
}

/// Removes the first comment of a writer that begins with `keyword` and that `parse` makes sense
/// of.
template <class F>
void take_comment(std::vector<std::string>& comments, std::string_view keyword, F parse) {
  const auto noted = std::ranges::find_if(comments, [&](std::string_view comment) {
    if (!comment.starts_with(keyword)) return false;
    detail::word_reader words{comment.substr(keyword.size())};
    return parse(words);
  });
  if (noted != comments.end()) comments.erase(noted);
}

template <Scalar S, int D>
void cloud_builder<S, D>::take_size(std::vector<std::string>& comments) {
  const index_t count = is_wide_ ? wide_.cols() : cloud_.points.cols();
  take_comment(comments, size_keyword, [&](detail::word_reader& words) {
    int width = 0, height = 0;
    if (!detail::parse_number(words.next(), width) || !detail::parse_number(words.next(), height) ||
        !words.done() || width < 1 || height < 1 || index_t{width} * height != count)
      return false;
    cloud_.width = width;
    cloud_.height = height;
    return true;
  });
}

/// Whether S holds a value: to the bit, or if the file is a text, to the digits that it has.
template <Scalar S, int D>
bool cloud_builder<S, D>::is_exact(double value) const {
  const S rounded = static_cast<S>(value);
  if (double(rounded) == value) return true;
  if (!is_text_) return false;
  std::array<char, 64> as_read, as_kept;
  const auto written = [](std::array<char, 64>& digits, auto number) {
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    return std::string_view{digits.data(), end};
  };
  return written(as_read, value) == written(as_kept, rounded);
}

/// Floating colours are from 0 to 1, or, if one of them is above 1, from 0 to 255, or to 65535.
template <Scalar S, int D>
bool cloud_builder<S, D>::has_floating_colors() const {
  for (std::size_t f = 0; f < fields_.size(); ++f)
    if (targets_[f].to == kind::color && detail::is_floating(fields_[f].type)) return true;
  return false;
}

template <Scalar S, int D>
void cloud_builder<S, D>::scale_colors() {
  if (!has_floating_colors()) return;
  float most = 0;
  for (const float c : cloud_.colors.reshaped())
    if (std::isfinite(c)) most = std::max(most, c);
  // With room for rounding, which must not change the unit of a whole cloud.
  float unit = most > 256 ? 65535.0f : most > 1.5f ? 255.0f : 1.0f;
  if (agreement_ != nullptr)
    unit = *(agreement_->color_unit ? agreement_->color_unit : agreement_->color_unit = unit);
  if (unit != 1) cloud_.colors /= unit;
  if (most > 1) cloud_.colors = cloud_.colors.cwiseMin(1.0f);
}

template <Scalar S, int D>
point_cloud<S, D> cloud_builder<S, D>::finish(std::vector<std::string> comments) {
  const auto noted = take_origin<D>(comments);
  take_size(comments);
  cloud_.comments = std::move(comments);
  if (agreement_ != nullptr && agreement_->origin)
    cloud_.origin = *agreement_->origin;
  else if (noted && origin_ == origin_policy::automatic)
    cloud_.origin = *noted;
  else if (is_wide_)
    choose_origin();
  if (is_wide_)
    cloud_.points = (wide_.colwise() - cloud_.origin).template cast<S>();
  else if (cloud_.has_origin())
    cloud_.points =
        (cloud_.points.template cast<double>().colwise() - cloud_.origin).template cast<S>();
  wide_.resize(D, 0);
  scale_colors();
  for (std::size_t f = 0; f < targets_.size(); ++f)
    if (targets_[f].to == kind::attribute)
      cloud_.attributes.push_back({fields_[f].name, std::move(targets_[f].values)});
  for (auto& to : targets_)
    if (!to.alpha.empty() && cloud_.find_attribute("alpha") == nullptr)
      cloud_.attributes.push_back({"alpha", std::move(to.alpha)});
  return std::move(cloud_);
}

template <int D>
std::optional<point_vector<double, D>> take_origin(std::vector<std::string>& comments) {
  std::optional<point_vector<double, D>> origin;
  take_comment(comments, origin_keyword, [&](detail::word_reader& words) {
    point_vector<double, D> noted;
    for (double& coordinate : noted)
      if (!detail::parse_number(words.next(), coordinate)) return false;
    if (!words.done() || !is_finite(noted)) return false;
    origin = noted;
    return true;
  });
  return origin;
}

template <int D>
std::string origin_comment(const point_vector<double, D>& origin) {
  std::string text{origin_keyword};
  std::array<char, 64> digits;
  for (index_t d = 0; d < D; ++d) {
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), origin[d]).ptr;
    text.append(digits.data(), end);
    if (d + 1 < D) text += ' ';
  }
  return text;
}

std::string size_comment(int width, int height) {
  return std::string{size_keyword} + std::to_string(width) + ' ' + std::to_string(height);
}

template class cloud_builder<float, 2>;
template class cloud_builder<float, 3>;
template class cloud_builder<double, 2>;
template class cloud_builder<double, 3>;
template std::optional<point_vector<double, 2>> take_origin<2>(std::vector<std::string>&);
template std::optional<point_vector<double, 3>> take_origin<3>(std::vector<std::string>&);
template std::string origin_comment<2>(const point_vector<double, 2>&);
template std::string origin_comment<3>(const point_vector<double, 3>&);

}  // namespace cilantro
