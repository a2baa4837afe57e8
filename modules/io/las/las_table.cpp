// SPDX-License-Identifier: MIT
module;
#include <set>

#include "io/common/number.hpp"
#include "io/common/random_bytes.hpp"
#include "io/las/las_record.hpp"
module cilantro.io;

import :cloud_builder;
import :las_file;
import :las_table;

namespace cilantro {
namespace {

using detail::number;

class table_maker {
 public:
  las_table table;

  void add(const std::string& name, const las_column& column) {
    std::string free = name;
    for (int i = 2; is_special(free) || !taken_.insert(free).second; ++i)
      free = name + '_' + std::to_string(i);
    table.fields.push_back({std::move(free), column.from.type});
    table.columns.push_back(column);
  }

 private:
  /// Case does not matter to what becomes coordinates and colours.
  [[nodiscard]] bool is_special(std::string_view name) const {
    return std::any_of(table.fields.begin(),
                       table.fields.begin() + static_cast<std::ptrdiff_t>(table.first_column),
                       [&](const file_field& f) { return same_name(f.name, name); });
  }

  /// There may be as many as a record has bytes.
  std::set<std::string> taken_;
};

}  // namespace

las_table las_table_of(const las_layout& layout) {
  table_maker maker;
  las_table& table = maker.table;
  for (const char* name : {"x", "y", "z"}) table.fields.push_back({name, number::float64});
  const int format = layout.info.point_format;
  if (las::has_colors(format))
    for (const char* name : {"red", "green", "blue"})
      table.fields.push_back({name, number::float32});
  table.first_column = table.fields.size();
  for (const auto& f : las::fields_of(format)) maker.add(std::string{f.name}, {.from = f});
  std::size_t at = las::record_size(format);
  for (const auto& e : layout.extras)
    for (std::size_t k = 0; k < e.count; ++k, at += detail::size_of(e.type)) {
      const std::size_t i = std::min<std::size_t>(k, 2);
      const auto name = attribute_name(e.name);
      las_column column{
          .from = {.name = {}, .type = e.is_scaled ? number::float64 : e.type, .at = at}};
      if (e.is_scaled) column.scaled = {.type = e.type, .scale = e.scale[i], .offset = e.offset[i]};
      maker.add(e.count == 1 ? name : name + '[' + std::to_string(k) + ']', column);
    }
  return table;
}

Eigen::Vector3d sampled_middle(const las_records& records, const las_info& info) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const auto sample = records.sample();
  const std::size_t n = sample.size() / info.record_length;
  std::vector<double> values(n);
  for (index_t d = 0; d < 3 && n > 0; ++d) {
    const char* data = sample.data() + 4 * static_cast<std::size_t>(d);
    for (double& v : values) {
      v = double(detail::load_little<std::int32_t>(data)) * info.scale[d] + info.offset[d];
      data += info.record_length;
    }
    const auto median = values.begin() + static_cast<std::ptrdiff_t>(n / 2);
    std::ranges::nth_element(values, median);
    if (std::isfinite(std::round(*median))) middle[d] = std::round(*median);
  }
  return middle;
}

}  // namespace cilantro
