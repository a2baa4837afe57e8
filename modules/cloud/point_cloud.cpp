// SPDX-License-Identifier: MIT
module;
#include <ostream>

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

#define CILANTRO_INSTANTIATE(S, D)                                              \
  template struct point_cloud<S, D>;                                            \
  template bool operator==(const point_cloud<S, D>&, const point_cloud<S, D>&); \
  template void expect_consistent(const point_cloud<S, D>&, const char*);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
