// SPDX-License-Identifier: MIT
module cilantro.cloud;

namespace cilantro {

std::vector<float> intensities(points_view<float, 3> colors) {
  std::vector<float> means;
  means.reserve(colors.size());
  for (const auto& color : colors) means.push_back(color.mean());
  return means;
}

rounded_values rounded_values_of(const attribute& all) {
  return std::visit([](const auto& values) { return rounded_values::of(values); }, all.values);
}

}  // namespace cilantro
