// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import :places;
import :survey;

namespace cilantro {
namespace {

/// Names of attributes that no file of anybody else has.
constexpr const char* place_name = "cilantro_place";
constexpr std::array color_names{"cilantro_red", "cilantro_green", "cilantro_blue"};

/// Cells as numbers that ascend in the order of `voxel_grid`: by the first coordinate, then by the
/// others.
template <int D>
class cell_numbers {
 public:
  /// Of all cells that points of the survey may be in. Nothing if these are too many.
  static std::optional<cell_numbers> of(const tile_survey<D>& survey,
                                        const cell_layout_of<D>& cells) {
    cell_numbers numbers{cells};
    double all = 1;
    for (int d = 0; d < D && !survey.bounds.empty(); ++d) {
      const auto cell_of = [&](double x) {
        return std::floor((x - cells.corner[d]) / cells.edges[d]);
      };
      // Bounds were not rounded as the points of a cloud are.
      numbers.low_[d] = cell_of(survey.bounds.lower[d]) - 1;
      numbers.count_[d] = cell_of(survey.bounds.upper[d]) + 2 - numbers.low_[d];
      all *= numbers.count_[d];
    }
    // The bits of a number below this are those of a double, too, and not one that is no number.
    if (!(all < 0x1p62)) return std::nullopt;
    return numbers;
  }

  template <Scalar S>
  [[nodiscard]] std::vector<std::uint64_t> operator()(const point_cloud<S, D>& cloud) const {
    // As `voxel_downsample` of clouds counts cells: relative to the origin of the points.
    const point_vector<double, D> corner = cells_.corner - cloud.full_origin();
    std::vector<std::uint64_t> all(static_cast<std::size_t>(cloud.size()));
    for (index_t i = 0; i < cloud.size(); ++i) {
      std::uint64_t number = 0;
      for (int d = 0; d < D; ++d) {
        const double cell =
            std::floor((double(cloud.points(d, i)) - corner[d]) / cells_.edges[d]) - low_[d];
        // A point that is not finite is in no cell, whatever its number.
        const double within = cell >= 0 ? std::min(cell, count_[d] - 1) : 0;
        number =
            number * static_cast<std::uint64_t>(count_[d]) + static_cast<std::uint64_t>(within);
      }
      all[i] = number;
    }
    return all;
  }

 private:
  explicit cell_numbers(const cell_layout_of<D>& cells) : cells_{cells} {}

  cell_layout_of<D> cells_;
  std::array<double, D> low_{}, count_{};  ///< The first cell along each axis, and how many.
};

template <Scalar S, int D>
std::optional<attribute_values> take(point_cloud<S, D>& cloud, std::string_view name) {
  const auto found = std::ranges::find(cloud.attributes, name, &attribute::name);
  if (found == cloud.attributes.end()) return std::nullopt;
  auto values = std::move(found->values);
  cloud.attributes.erase(found);
  return values;
}

}  // namespace

template <Scalar S, int D>
std::optional<std::size_t> first_with_places(const tile_survey<D>& survey,
                                             std::span<const tile_step<S, D>> steps) {
  for (std::size_t s = steps.size(); s-- > 0;) {
    const auto& order = steps[s].order;
    if (!order.is_known) return std::nullopt;
    if (!order.cells) continue;
    if (!cell_numbers<D>::of(survey, *order.cells)) return std::nullopt;
    return s;
  }
  return 0;
}

template <Scalar S, int D>
void set_places_by_cell(point_cloud<S, D>& cloud, const tile_survey<D>& survey,
                        const cell_layout_of<D>& cells) {
  set_places(cloud, (*cell_numbers<D>::of(survey, cells))(cloud));
}

template <Scalar S, int D>
void set_places(point_cloud<S, D>& cloud, std::vector<std::uint64_t> places) {
  cloud.set_attribute(place_name, attribute_values{std::move(places)});
}

template <Scalar S, int D>
std::span<const std::uint64_t> places_of(const point_cloud<S, D>& cloud) {
  const auto noted = std::ranges::find(cloud.attributes, place_name, &attribute::name);
  if (noted == cloud.attributes.end()) return {};
  return std::get<std::vector<std::uint64_t>>(noted->values);
}

template <Scalar S, int D>
void drop_places(point_cloud<S, D>& cloud) {
  (void)take(cloud, place_name);
}

template <Scalar S, int D>
void put_aside(point_cloud<S, D>& cloud) {
  if (const auto noted = take(cloud, place_name)) {
    const auto& places = std::get<std::vector<std::uint64_t>>(*noted);
    expects(std::ranges::is_sorted(places),
            "a step that chooses points changes their order, which no step on tiles may");
    // PLY has no integers of 64 bits. A double has as many, and nothing computes with it.
    std::vector<double> bits(places.size());
    std::ranges::transform(places, bits.begin(),
                           [](std::uint64_t place) { return std::bit_cast<double>(place); });
    cloud.set_attribute(place_name, attribute_values{std::move(bits)});
  }
  if (!cloud.has_colors()) return;
  // Files have colours of eight bits; means of them have more.
  for (index_t c = 0; c < 3; ++c) {
    const auto channel = cloud.colors.row(c);
    cloud.set_attribute(color_names[c],
                        attribute_values{std::vector<float>(channel.begin(), channel.end())});
  }
  cloud.colors.resize(3, 0);
}

template <Scalar S, int D>
std::vector<index_t> sort_by_border(point_cloud<S, D>& cloud, const tile_info& tile, double edge,
                                    double border) {
  if (!(border > 0) || 2 * border >= edge ||
      std::ranges::find(cloud.attributes, place_name, &attribute::name) == cloud.attributes.end())
    return {cloud.size()};
  const std::array<std::int64_t, 2> square{tile.x, tile.y};
  std::array<index_list, 9> parts;
  for (index_t i = 0; i < cloud.size(); ++i) {
    std::size_t part = 0;
    for (int d = 0; d < 2; ++d) {
      const double in_tile =
          double(cloud.points(d, i)) + cloud.origin[d] - double(square[d]) * edge;
      part = 3 * part + (in_tile <= border ? 0 : in_tile < edge - border ? 1 : 2);
    }
    parts[part].push_back(static_cast<std::int32_t>(i));
  }
  index_list order;
  std::vector<index_t> ends;
  order.reserve(static_cast<std::size_t>(cloud.size()));
  for (const auto& part : parts) {
    order.insert(order.end(), part.begin(), part.end());
    ends.push_back(std::ssize(order));
  }
  cloud = select(std::move(cloud), order);
  return ends;
}

template <Scalar S, int D>
std::vector<std::uint64_t> take_back(point_cloud<S, D>& cloud) {
  for (index_t c = 0; c < 3; ++c)
    if (const auto channel = take(cloud, color_names[c])) {
      const auto& values = std::get<std::vector<float>>(*channel);
      cloud.colors.resize(3, cloud.size());
      cloud.colors.row(c) = Eigen::Map<const Eigen::RowVectorXf>(values.data(), cloud.size());
    }
  std::vector<std::uint64_t> places;
  if (const auto noted = take(cloud, place_name))
    for (const double bits : std::get<std::vector<double>>(*noted))
      places.push_back(std::bit_cast<std::uint64_t>(bits));
  return places;
}

#define CILANTRO_INSTANTIATE(S, D)                                                           \
  template std::optional<std::size_t> first_with_places(const tile_survey<D>&,               \
                                                        std::span<const tile_step<S, D>>);   \
  template void set_places_by_cell(point_cloud<S, D>&, const tile_survey<D>&,                \
                                   const cell_layout_of<D>&);                                \
  template void set_places(point_cloud<S, D>&, std::vector<std::uint64_t>);                  \
  template std::span<const std::uint64_t> places_of(const point_cloud<S, D>&);               \
  template void drop_places(point_cloud<S, D>&);                                             \
  template void put_aside(point_cloud<S, D>&);                                               \
  template std::vector<index_t> sort_by_border(point_cloud<S, D>&, const tile_info&, double, \
                                               double);                                      \
  template std::vector<std::uint64_t> take_back(point_cloud<S, D>&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
