// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "io/common/number.hpp"
#include "io/common/random_bytes.hpp"
module cilantro.io;

import :cloud_builder;
import :e57_scan;
import :file_scope;

namespace cilantro {
namespace {

using detail::failure;
using detail::number;
using detail::random_bytes;

/// The fields of all scans; of the widest type where they differ.
std::vector<file_field> fields_of(const std::vector<e57_scan>& scans) {
  std::vector<file_field> fields;
  for (const char* name : {"x", "y", "z"}) fields.push_back({name, number::float64});
  for (const auto& scan : scans)
    for (const auto& column : scan.columns) {
      const auto found = std::ranges::find(fields, column.name, &file_field::name);
      if (found == fields.end())
        fields.push_back({column.name, column.type});
      else if (found->type != column.type)
        found->type = number::float64;
    }
  if (scans.size() > 1) {
    std::erase_if(fields, [](const file_field& f) { return f.name == "scan"; });
    fields.push_back({"scan", number::int32});
  }
  return fields;
}

/// What a scan without such values has.
double missing(const file_field& field) {
  const bool is_color = field.name == "red" || field.name == "green" || field.name == "blue";
  return detail::is_floating(field.type) && !is_color ? std::numeric_limits<double>::quiet_NaN()
                                                      : 0;
}

/// Gives the points of all scans to a builder, moved by `pose(scan)`.
template <Scalar S, int D, class F>
point_cloud<S, D> build(const std::vector<e57_scan>& scans, origin_policy origin, F pose) {
  const auto fields = fields_of(scans);
  cloud_builder<S, D> builder{fields, origin};
  index_t all = 0;
  for (const auto& scan : scans) all += scan.places.cols();
  if (all > std::numeric_limits<std::int32_t>::max())
    throw failure{"there are more than 2^31 - 1 points", false, 0};
  builder.resize(all);
  index_t first = 0;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const auto& scan = scans[s];
    for (index_t i = 0; i < scan.places.cols(); ++i) {
      const Eigen::Vector3d place = pose(scan) * scan.places.col(i);
      for (std::size_t d = 0; d < 3; ++d)
        builder.store(d, first + i, place[static_cast<index_t>(d)]);
    }
    for (std::size_t f = 3; f < fields.size(); ++f) {
      const auto found = std::ranges::find(scan.columns, fields[f].name, &e57_column::name);
      const bool is_number = scans.size() > 1 && f + 1 == fields.size();
      const double otherwise = is_number ? double(s) : missing(fields[f]);
      const bool is_there = found != scan.columns.end() && !is_number;
      detail::visit_number(fields[f].type, [&]<class T>(T) {
        for (index_t i = 0; i < scan.places.cols(); ++i)
          builder.store(f, first + i, static_cast<T>(is_there ? found->values[i] : otherwise));
      });
    }
    first += scan.places.cols();
  }
  return builder.finish({});
}

template <Scalar S, int D>
point_cloud<S, D> read_file(const random_bytes& file, const read_options& options) {
  const auto scans = read_e57_data(file, options.monitor);
  auto cloud = build<S, D>(scans, options.origin, [](const e57_scan& scan) { return scan.pose; });
  watch(options.monitor, 1, 1);
  return cloud;
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_e57(const std::filesystem::path& path, const read_options& options) {
  return with_file(path, [&] { return read_file<S, D>(random_bytes{path}, options); });
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_e57(std::span<const std::byte> bytes, const std::filesystem::path& name,
                           const read_options& options) {
  return with_place(name, [&] { return read_file<S, D>(random_bytes{bytes}, options); });
}

template <Scalar S>
std::vector<posed_scan<S>> read_e57_scans(const std::filesystem::path& path,
                                          const task_monitor& monitor) {
  return with_file(path, [&] {
    std::vector<posed_scan<S>> scans;
    for (auto& scan : read_e57_data(random_bytes{path}, monitor)) {
      posed_scan<S> next{.name = scan.name, .pose = scan.pose};
      const std::vector<e57_scan> one{std::move(scan)};
      next.cloud = build<S, 3>(one, origin_policy::automatic,
                               [](const e57_scan&) { return Eigen::Affine3d::Identity(); });
      scans.push_back(std::move(next));
    }
    watch(monitor, 1, 1);
    return scans;
  });
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template point_cloud<S, D> read_e57<S, D>(const std::filesystem::path&, const read_options&); \
  template point_cloud<S, D> read_e57<S, D>(std::span<const std::byte>,                         \
                                            const std::filesystem::path&, const read_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE
template std::vector<posed_scan<float>> read_e57_scans(const std::filesystem::path&,
                                                       const task_monitor&);
template std::vector<posed_scan<double>> read_e57_scans(const std::filesystem::path&,
                                                        const task_monitor&);

}  // namespace cilantro
