// SPDX-License-Identifier: MIT
module;
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/closed_spaces.hpp"
module cilantro.cloud;

namespace cilantro {

void print(std::ostream& out, const cloud_summary& cloud) {
  out << cloud.size << (cloud.size == 1 ? " point" : " points") << " in " << cloud.dimension << 'D';
  if (cloud.width > 0) out << ", " << cloud.width << " x " << cloud.height;
  if (cloud.has_normals) out << ", normals";
  if (cloud.has_colors) out << ", colors";
  for (const auto& a : cloud.attributes)
    out << ", " << a.name << " (" << type_name(a.values) << ')';
  if (cloud.origin.size() > 0) {
    out << ", origin";
    for (const double x : cloud.origin) out << ' ' << in_digits(x);
  }
}

void expect_consistent(index_t points, index_t normals, index_t colors,
                       std::span<const attribute> attributes, const char* who) {
  const auto differ = [&](index_t count, const std::string& what) {
    return std::string{who} + ": the cloud has " + std::to_string(points) + " points but " +
           std::to_string(count) + ' ' + what;
  };
  if (normals != 0 && normals != points) throw invalid_input{differ(normals, "normals")};
  if (colors != 0 && colors != points) throw invalid_input{differ(colors, "colors")};
  std::vector<std::string_view> names;
  for (const attribute& a : attributes) {
    if (a.size() != points)
      throw invalid_input{differ(a.size(), "values of the attribute \"" + a.name + '"')};
    names.push_back(a.name);
  }
  if (const auto twice = repeated_name(std::move(names)))
    throw invalid_input{std::string{who} + ": the cloud has two attributes \"" +
                        std::string{*twice} + '"'};
}

template <Scalar S, int D>
point_matrix<S, D> gather_columns(points_view<S, D> all, std::span<const std::int32_t> indices) {
  point_matrix<S, D> selected(all.dimension(), std::ssize(indices));
  for (index_t i = 0; i < selected.cols(); ++i)
    selected.col(i) = all[indices[static_cast<std::size_t>(i)]];
  return selected;
}

template <Scalar S, int D>
std::vector<std::int32_t> finite_columns(points_view<S, D> all) {
  std::vector<std::int32_t> finite;
  finite.reserve(static_cast<std::size_t>(all.size()));
  for (index_t i = 0; i < all.size(); ++i)
    if (is_finite(all[i])) finite.push_back(static_cast<std::int32_t>(i));
  return finite;
}

#define CILANTRO_INSTANTIATE(S, D)                                                            \
  template point_matrix<S, D> gather_columns<S, D>(points_view<S, D>,                         \
                                                   std::span<const std::int32_t>);            \
  template std::vector<std::int32_t> finite_columns<S, D>(points_view<S, D>);                 \
  template struct point_cloud<S, D>;                                                          \
  template bool operator==(const point_cloud<S, D>&, const point_cloud<S, D>&);               \
  template void expect_consistent(const point_cloud<S, D>&, const char*);                     \
  template point_cloud<S, D> gather(const point_cloud<S, D>&, std::span<const std::int32_t>); \
  template point_cloud<S, D> append(point_cloud<S, D>, const point_cloud<S, D>&);             \
  template point_cloud<S, D> estimate_normals(point_cloud<S, D>, neighborhood_spec,           \
                                              const normals_options&);                        \
  template point_cloud<S, D> voxel_downsample(const point_cloud<S, D>&, const voxel_size&,    \
                                              const voxel_downsample_options&);               \
  template point_cloud<S, D> orient_to_viewpoint(point_cloud<S, D>, const coordinates&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
