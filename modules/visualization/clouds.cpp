// SPDX-License-Identifier: MIT
module;
#include "cloud/color.hpp"
module cilantro.visualization;

import cilantro.clustering;
import :value_colors;

namespace cilantro {
namespace {

color_matrix in_bytes(points_view<float, 3> shares) {
  color_matrix colors(3, shares.size());
  for (index_t i = 0; i < colors.cols(); ++i)
    for (int k = 0; k < 3; ++k) colors(k, i) = detail::to_eight_bit(shares[i][k]);
  return colors;
}

const attribute& attribute_named(const points_to_draw& all, const std::string& name) {
  const auto found = std::ranges::find(all.attributes, name, &attribute::name);
  if (found != all.attributes.end()) return *found;
  std::string names;
  for (const auto& one : all.attributes) names += (names.empty() ? "" : ", ") + one.name;
  throw invalid_input{"draw: the cloud has no attribute \"" + name + "\", but " +
                      (names.empty() ? "none at all" : names)};
}

std::vector<double> values_of(const attribute& from) {
  return std::visit(
      [](const auto& values) { return std::vector<double>(values.begin(), values.end()); },
      from.values);
}

/// Colours by the map, and says in a legend what they mean.
color_matrix colored_by(const std::vector<double>& values, const auto& by, std::string title,
                        canvas& on) {
  const value_colors color_of{values, by.map, by.low, by.high};
  color_matrix colors(3, std::ssize(values));
  for (index_t i = 0; i < colors.cols(); ++i) {
    const rgb color = color_of(values[i]);
    colors.col(i) << color[0], color[1], color[2];
  }
  on.add(color_of.legend(std::move(title)));
  return colors;
}

/// The colours that a look asks for.
struct colorer {
  const points_to_draw& all;
  canvas& on;

  color_matrix operator()(const rgb& one) const { return one_color(one); }
  color_matrix operator()(const own_colors& own) const {
    if (all.colors.empty()) return one_color(own.otherwise);
    return in_bytes(all.colors);
  }
  color_matrix operator()(const by_attribute& by) const {
    return colored_by(values_of(attribute_named(all, by.name)), by, by.name, on);
  }
  color_matrix operator()(const by_coordinate& by) const {
    expects(0 <= by.axis && (by.axis < all.dimension || all.points.cols() == 0) && by.axis < 3,
            "by_coordinate: the points have no such axis; the first is 0");
    std::vector<double> values;
    for (const float x : all.points.row(by.axis)) values.push_back(double(x) + all.origin[by.axis]);
    return colored_by(values, by, std::string{"xyz"[by.axis]}, on);
  }
  color_matrix operator()(const by_label& by) const {
    const auto& labels = attribute_named(all, by.name);
    std::vector<clusters::label> numbers;
    std::visit(
        [&]<class T>(const std::vector<T>& values) {
          expects(std::integral<T>,
                  "by_label: the attribute \"" + by.name +
                      "\" does not hold whole numbers; by_attribute takes any numbers");
          for (const T value : values)
            numbers.push_back(value < T{0} ? -1
                                           : clusters::label(std::uint64_t(value) & 0x3fffffff));
        },
        labels.values);
    const auto colors = label_colors(numbers);
    return in_bytes(as_points(colors));
  }
  color_matrix operator()(const by_normal&) const {
    expects(all.normals.cols() > 0 || all.points.cols() == 0,
            "by_normal: the cloud has no normals; estimate them first");
    color_matrix colors(3, all.normals.cols());
    for (index_t i = 0; i < colors.cols(); ++i)
      for (int k = 0; k < 3; ++k) {
        const float along = all.normals(k, i);
        colors(k, i) = std::uint8_t(
            std::isfinite(along) ? 127.5f * (1 + std::clamp(along, -1.0f, 1.0f)) + 0.5f : 128);
      }
    return colors;
  }
};

/// The middle one of some numbers, which are put in another order.
float middle_of(std::vector<float>& numbers) {
  const auto middle = numbers.begin() + std::ssize(numbers) / 2;
  std::ranges::nth_element(numbers, middle);
  return *middle;
}

Eigen::VectorXf spacing_of(const Eigen::Matrix3Xf& points, double factor, int threads) {
  const kd_tree tree{points, {.threads = threads}};
  constexpr knn with_itself{9};
  const visit_options how{.ascending = false, .threads = threads};
  Eigen::VectorXf farthest = Eigen::VectorXf::Zero(points.cols());
  const auto measure = [&](const neighborhood_block<float>& block) {
    for (index_t i = 0; i < block.size(); ++i)
      for (const auto& near : block[i])
        farthest[block.query(i)] = std::max(farthest[block.query(i)], near.distance);
  };
  visit_neighborhoods(tree, points, with_itself, measure, how);
  // At the border of a surface neighbours are on one side only, and so farther than inside.
  Eigen::VectorXf sizes = farthest;
  const auto compare = [&](const neighborhood_block<float>& block) {
    std::vector<float> around;
    for (index_t i = 0; i < block.size(); ++i) {
      around.clear();
      for (const auto& near : block[i]) around.push_back(farthest[near.index]);
      float& size = sizes[block.query(i)];
      if (!around.empty()) size = std::min(size, middle_of(around));
    }
  };
  visit_neighborhoods(tree, points, with_itself, compare, how);
  // Points that are far from all others must not hide anything, and nine at one place be seen.
  constexpr float largest = 3;
  std::vector<float> known;
  for (const float size : sizes)
    if (size > 0) known.push_back(size);
  const float usual = known.empty() ? 0 : middle_of(known);
  for (float& size : sizes)
    size = float(std::min(double(size > 0 ? std::min(size, largest * usual) : usual) * factor,
                          double(std::numeric_limits<float>::max())));
  return sizes;
}

struct sizer {
  const Eigen::Matrix3Xf& points;
  index_t dimension;
  int threads;

  point_size operator()(const automatic_size&) const {
    return dimension == 3 ? (*this)(local_spacing{}) : (*this)(splat_pixels{5});
  }

  point_size operator()(const splat_pixels& size) const {
    return {point_size::unit::pixels, Eigen::VectorXf::Constant(1, float(double(size.diameter)))};
  }
  point_size operator()(const splat_length& size) const {
    return {point_size::unit::length, Eigen::VectorXf::Constant(1, float(double(size.diameter)))};
  }
  point_size operator()(const local_spacing& by) const {
    if (points.cols() == 0) return (*this)(splat_pixels{});
    auto sizes = spacing_of(points, by.factor, threads);
    if (sizes.maxCoeff() == 0) return (*this)(splat_pixels{5});
    return {point_size::unit::length, std::move(sizes)};
  }
};

}  // namespace

void draw_points(points_to_draw all, canvas& on, const cloud_look& look) {
  point_batch batch;
  batch.colors = std::visit(colorer{all, on}, look.color);
  batch.size = std::visit(sizer{all.points, all.dimension, look.threads}, look.size);
  batch.opacity = look.opacity;
  batch.origin = all.origin;
  const bool is_photo = std::holds_alternative<own_colors>(look.color) && !all.colors.empty();
  batch.lit = look.lit.value_or(!is_photo);
  batch.along_normals = look.along_normals && all.normals.cols() > 0;
  if (batch.lit || batch.along_normals) batch.normals = std::move(all.normals);
  batch.points = std::move(all.points);
  if (batch.points.cols() == 0) batch.colors = one_color({200, 200, 200});
  on.add(std::move(batch));
}

}  // namespace cilantro
