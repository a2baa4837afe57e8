// SPDX-License-Identifier: MIT
module;
#include <cstdio>
#include <ostream>
module cilantro.cloud;

namespace cilantro {

void pipeline_report::add(std::string name, index_t points, index_t invalid) {
  stages_.push_back({
      .name = std::move(name),
      .points_in = is_first_ ? points : stages_.back().points_out,
      .points_out = points,
      .invalid_dropped = std::max(index_t{0}, invalid_before_.value_or(invalid) - invalid),
      .milliseconds = std::chrono::duration<double, std::milli>(stopped_ - begun_).count(),
  });
  invalid_before_ = invalid;
  is_first_ = false;
  begun_ = clock::now();
}

std::ostream& operator<<(std::ostream& out, const pipeline_report& report) {
  std::size_t width = 5;
  for (const auto& stage : report.stages()) width = std::max(width, stage.name.size());
  const auto padded = [&](const std::string& name) {
    return name + std::string(width - name.size(), ' ');
  };
  out << padded("stage") << "   points in  points out  invalid dropped        ms\n";
  for (const auto& stage : report.stages()) {
    char numbers[128];
    std::snprintf(numbers, sizeof numbers, "%12td%12td%17td%10.1f\n", stage.points_in,
                  stage.points_out, stage.invalid_dropped, stage.milliseconds);
    out << padded(stage.name) << numbers;
  }
  return out;
}

void expect_parts(const cloud_parts& needed, bool has_normals, bool has_colors) {
  expects(has_normals || !needed.normals,
          "a step of the pipeline needs normals, but the cloud has none; estimate them first");
  expects(has_colors || !needed.colors,
          "a step of the pipeline needs colors, but the cloud has none");
}

}  // namespace cilantro
