// SPDX-License-Identifier: MIT
module;
#include <cctype>

#include "io/common/random_bytes.hpp"
#include "io/e57/e57_pages.hpp"
#include "io/e57/e57_points.hpp"
#include "io/e57/e57_xml.hpp"
module cilantro.io;

import :e57_scan;
import :file_scope;

namespace cilantro {
namespace {

using detail::failure;
using detail::number;
using detail::random_bytes;
using e57::element;

/// rowIndex is row_index.
std::string snake_case(std::string_view name) {
  std::string result;
  for (const char c : name) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isupper(u) && !result.empty()) result += '_';
    result += u <= ' ' ? '_' : static_cast<char>(std::tolower(u));
  }
  return result;
}

double child_number(const element& parent, std::string_view name, double otherwise) {
  const element* child = parent.child(name);
  return child ? e57::real_in(child->text) : otherwise;
}

Eigen::Affine3d parse_pose(const element& scan) {
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
  const element* given = scan.child("pose");
  if (given == nullptr) return pose;
  if (const element* t = given->child("translation"))
    pose.translation() = Eigen::Vector3d{child_number(*t, "x", 0), child_number(*t, "y", 0),
                                         child_number(*t, "z", 0)};
  if (const element* r = given->child("rotation")) {
    const Eigen::Quaterniond rotation{child_number(*r, "w", 1), child_number(*r, "x", 0),
                                      child_number(*r, "y", 0), child_number(*r, "z", 0)};
    if (!(rotation.norm() > 0)) throw failure{"the rotation of a scan is no rotation", false, 0};
    pose.linear() = rotation.normalized().toRotationMatrix();
  }
  if (!pose.matrix().allFinite()) throw failure{"the pose of a scan is not finite", false, 0};
  return pose;
}

/// The columns of a scan by the names of the file.
class scan_values {
 public:
  scan_values(const element& scan, e57::points_section section,
              std::vector<std::vector<double>> columns)
      : scan_{scan}, section_{std::move(section)}, columns_{std::move(columns)} {}

  e57_scan take() {
    e57_scan result;
    if (const element* name = scan_.child("name")) result.name = name->text;
    result.pose = parse_pose(scan_);
    const auto kept = valid_points();
    take_places(result, kept);
    for (std::size_t f = 0; f < columns_.size(); ++f) {
      const auto& field = section_.fields[f];
      if (is_taken(field.name) || field.as == e57::field::form::text) continue;
      e57_column column{snake_case(field.name), field.type(), pick(columns_[f], kept)};
      for (const auto& [channel, name] :
           {std::pair{"Red", "red"}, {"Green", "green"}, {"Blue", "blue"}})
        if (field.name == std::string{"color"} + channel) {
          scale_color(column, channel, field);
          column.name = name;
        }
      result.columns.push_back(std::move(column));
    }
    return result;
  }

 private:
  static constexpr std::array cartesian{"cartesianX", "cartesianY", "cartesianZ"};
  static constexpr std::array spherical{"sphericalRange", "sphericalAzimuth", "sphericalElevation"};

  [[nodiscard]] const std::vector<double>* find(std::string_view name) const {
    for (std::size_t f = 0; f < columns_.size(); ++f)
      if (section_.fields[f].name == name) return &columns_[f];
    return nullptr;
  }
  [[nodiscard]] static bool is_taken(std::string_view name) {
    return std::ranges::find(cartesian, name) != cartesian.end() ||
           std::ranges::find(spherical, name) != spherical.end() ||
           name == "cartesianInvalidState" || name == "sphericalInvalidState";
  }

  /// Those that are neither without an echo nor otherwise invalid.
  [[nodiscard]] std::vector<std::size_t> valid_points() const {
    const auto* state =
        find(find(cartesian[0]) ? "cartesianInvalidState" : "sphericalInvalidState");
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < section_.count; ++i)
      if (state == nullptr || (*state)[i] == 0) kept.push_back(i);
    return kept;
  }

  static std::vector<double> pick(const std::vector<double>& all,
                                  const std::vector<std::size_t>& kept) {
    std::vector<double> some;
    some.reserve(kept.size());
    for (const std::size_t i : kept) some.push_back(all[i]);
    return some;
  }

  void take_places(e57_scan& result, const std::vector<std::size_t>& kept) const {
    const bool is_cartesian = find(cartesian[0]) != nullptr;
    std::array<const std::vector<double>*, 3> from{};
    for (std::size_t d = 0; d < 3; ++d) {
      from[d] = find(is_cartesian ? cartesian[d] : spherical[d]);
      if (from[d] == nullptr)
        throw failure{"the points of a scan have no coordinates", false, section_.at};
    }
    result.places.resize(3, static_cast<index_t>(kept.size()));
    for (index_t i = 0; i < result.places.cols(); ++i) {
      const std::size_t k = kept[i];
      const double a = (*from[0])[k], b = (*from[1])[k], c = (*from[2])[k];
      // Range, azimuth and elevation.
      result.places.col(i) = is_cartesian
                                 ? Eigen::Vector3d{a, b, c}
                                 : Eigen::Vector3d{a * std::cos(c) * std::cos(b),
                                                   a * std::cos(c) * std::sin(b), a * std::sin(c)};
    }
  }

  void scale_color(e57_column& column, std::string_view channel, const e57::field& field) const {
    double low = double(field.lowest) * field.scale + field.offset,
           high = double(field.highest) * field.scale + field.offset;
    if (field.as == e57::field::form::real) low = 0, high = 1;
    if (const element* limits = scan_.child("colorLimits")) {
      const auto name = "color" + std::string{channel};
      low = child_number(*limits, name + "Minimum", low);
      high = child_number(*limits, name + "Maximum", high);
    }
    const double range = high > low ? high - low : 1;
    for (double& v : column.values) v = std::clamp((v - low) / range, 0.0, 1.0);
    column.type = number::float32;
  }

  const element& scan_;
  e57::points_section section_;
  std::vector<std::vector<double>> columns_;
};

}  // namespace

std::vector<e57_scan> read_e57_data(const random_bytes& file, const task_monitor& monitor) {
  constexpr std::size_t header_size = 48;
  const auto header = file.read(0, std::min<std::uint64_t>(file.size(), header_size));
  if (header.size() < header_size || std::memcmp(header.data(), "ASTM-E57", 8) != 0)
    throw failure{"the file does not begin with ASTM-E57: this is not an E57 file", false, 0};
  if (const auto version = detail::load_little<std::uint32_t>(header.data() + 8); version != 1)
    throw failure{"version " + std::to_string(version) + " of E57 is not known", false, 8};
  if (const auto size = detail::load_little<std::uint64_t>(header.data() + 40);
      size != e57::pages::size)
    throw failure{"the pages have " + std::to_string(size) + " bytes instead of 1024", false, 40};
  if (const auto size = detail::load_little<std::uint64_t>(header.data() + 16); size > file.size())
    throw failure{"the header promises " + std::to_string(size) + " bytes, and the file has " +
                      std::to_string(file.size()),
                  false, 16};
  const e57::pages pages{file};
  const auto xml_at = detail::load_little<std::uint64_t>(header.data() + 24);
  const auto xml = pages.read(pages.content_place(xml_at),
                              detail::load_little<std::uint64_t>(header.data() + 32));
  const element root = e57::parse_xml({xml.data(), xml.size()}, xml_at);

  std::vector<e57_scan> scans;
  const element* data = root.child("data3D");
  if (data == nullptr) return scans;
  const auto all = double(data->children.size());
  // A small file can tell of the same points again and again.
  std::uint64_t points = 0, left = file.size();
  for (const element& scan : data->children) {
    const element* described = scan.child("points");
    if (described == nullptr) continue;
    auto section = e57::parse_points(*described, file.size());
    points += section.count;
    if (points > file.size() * 8)
      throw failure{"the scans promise more points than the file has bits", false, xml_at};
    const auto progress = [&](std::uint64_t done) {
      watch(monitor, double(scans.size()) + double(done) / double(section.count), all);
    };
    auto columns = e57::read_points(pages, section, left, progress);
    scans.push_back(scan_values{scan, std::move(section), std::move(columns)}.take());
  }
  return scans;
}

}  // namespace cilantro
