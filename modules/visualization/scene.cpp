// SPDX-License-Identifier: MIT
module cilantro.visualization;

namespace cilantro {

std::vector<scene::layer>::iterator scene::named(std::string_view name) {
  const auto found = std::ranges::find(layers_, name, &layer::name);
  if (found != layers_.end()) return found;
  std::string names;
  for (const auto& one : layers_) names += (names.empty() ? "" : ", ") + one.name;
  throw invalid_input{"scene: there is no layer \"" + std::string{name} + "\", but " +
                      (names.empty() ? "none at all" : names)};
}

scene& scene::put(std::string name, canvas content) {
  auto drawn = std::make_shared<const canvas>(std::move(content));
  if (const auto known = std::ranges::find(layers_, name, &layer::name); known != layers_.end())
    known->content = std::move(drawn);
  else
    layers_.push_back({std::move(name), std::move(drawn)});
  return *this;
}

scene& scene::remove(std::string_view name) {
  layers_.erase(named(name));
  return *this;
}

scene& scene::hide(std::string_view name, bool is_hidden) {
  named(name)->is_hidden = is_hidden;
  return *this;
}

Eigen::AlignedBox3d scene::bounds() const {
  Eigen::AlignedBox3d box;
  for (const auto& one : layers_)
    if (!one.is_hidden) box.extend(one.content->bounds());
  return box;
}

}  // namespace cilantro
