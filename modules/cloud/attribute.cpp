// SPDX-License-Identifier: MIT
module cilantro.cloud;

namespace cilantro {

std::string_view type_name(const attribute_values& values) {
  constexpr std::array names{"int8",   "uint8", "int16",  "uint16", "int32",
                             "uint32", "float", "double", "int64",  "uint64"};
  return names[values.index()];
}
namespace {

template <std::floating_point T>
T reduce_values(const std::vector<T>& values, std::span<const std::int32_t> members,
                std::vector<T>&) {
  double sum = 0;
  index_t count = 0;
  for (const auto i : members) {
    const T value = values[i];
    if (!std::isfinite(value)) continue;
    sum += double(value);
    ++count;
  }
  return count > 0 ? static_cast<T>(sum / double(count)) : std::numeric_limits<T>::quiet_NaN();
}

template <std::integral T>
T reduce_values(const std::vector<T>& values, std::span<const std::int32_t> members,
                std::vector<T>& room) {
  // Most cells have one, two or three points.
  const auto value = [&](std::size_t i) { return values[members[i]]; };
  switch (members.size()) {
    case 1:
      return value(0);
    case 2:
      return std::min(value(0), value(1));
    case 3: {
      const auto [low, high] = std::minmax({value(0), value(1)});
      return std::clamp(value(2), low, high);
    }
    default:
      break;
  }
  room.clear();
  for (const auto i : members) room.push_back(values[i]);
  const auto median = room.begin() + (std::ssize(room) - 1) / 2;
  std::ranges::nth_element(room, median);
  return *median;
}

}  // namespace

index_t attribute::size() const {
  return std::visit([](const auto& v) { return static_cast<index_t>(v.size()); }, values);
}

attribute select(const attribute& all, std::span<const std::int32_t> indices) {
  return {all.name, std::visit(
                        [&]<class T>(const std::vector<T>& values) -> attribute_values {
                          std::vector<T> selected;
                          selected.reserve(indices.size());
                          for (const auto i : indices) selected.push_back(values[i]);
                          return selected;
                        },
                        all.values)};
}

attribute reduce(const attribute& all, const point_groups& groups) {
  return {all.name, std::visit(
                        [&]<class T>(const std::vector<T>& values) -> attribute_values {
                          const index_t count = groups.size();
                          std::vector<T> reduced(static_cast<std::size_t>(count)), room;
                          for (index_t g = 0; g < count; ++g)
                            reduced[g] = reduce_values(values, groups[g], room);
                          return reduced;
                        },
                        all.values)};
}

std::optional<std::string_view> repeated_name(std::vector<std::string_view> names) {
  std::ranges::sort(names);
  const auto twice = std::ranges::adjacent_find(names);
  return twice != names.end() ? std::optional{*twice} : std::nullopt;
}

attribute concatenate(attribute a, const attribute& b) {
  expects(a.values.index() == b.values.index(),
          "append: the attribute \"" + a.name + "\" has different types in the two clouds");
  std::visit(
      [&]<class T>(std::vector<T>& values) {
        const auto& more = std::get<std::vector<T>>(b.values);
        values.insert(values.end(), more.begin(), more.end());
      },
      a.values);
  return a;
}

}  // namespace cilantro
