// SPDX-License-Identifier: MIT
export module cilantro.cloud:report;

import cilantro.standard;
import cilantro.core;
import :pipeline;
import :point_cloud;

namespace cilantro {

/// What one stage of a pipeline did.
export struct stage_report {
  std::string name;
  index_t points_in = 0;
  index_t points_out = 0;
  index_t invalid_dropped = 0;  ///< Non-finite points that came in and did not go out.
  double milliseconds = 0;      ///< Wall time, without what reporting itself took.
};

/// Collects what `report_to` sees; writing it to a stream prints a table, a line a stage.
export class pipeline_report {
 public:
  /// The clock of the first stage starts here.
  pipeline_report() : begun_{clock::now()} {}

  [[nodiscard]] const std::vector<stage_report>& stages() const [[clang::lifetimebound]] {
    return stages_;
  }

  /// Closes the stage `name`, whose result has so many points, and starts the next one.
  void add(std::string name, index_t points, index_t invalid);
  /// Stops the clock of the current stage, before its result is counted.
  void stop() { stopped_ = clock::now(); }

 private:
  using clock = std::chrono::steady_clock;
  std::vector<stage_report> stages_;
  std::optional<index_t> invalid_before_;
  clock::time_point begun_, stopped_;
};
export std::ostream& operator<<(std::ostream& out, const pipeline_report& report);

struct report_tap {
  pipeline_report* report;
  std::string stage;

  static constexpr const char* name = "report_to";
  static step_reach reach() { return {}; }
  template <Scalar S, int D>
  void look(const point_cloud<S, D>& cloud) const {
    report->stop();
    report->add(stage, cloud.size(), count_non_finite(cloud.points));
  }
};

/// A tap: notes under `name` what has happened since the tap before it, or since `report` was made,
/// and hands the cloud on. `report` must outlive the step.
export [[nodiscard]] inline auto report_to(pipeline_report& report [[clang::lifetimebound]],
                                           std::string name) {
  return tap_step{report_tap{&report, std::move(name)}};
}

/// The line with a tap behind each of its steps, under the step's name, and one before the first,
/// "input". Each step is then done by itself. `report` must outlive the result.
export template <PipelineStep Line>
[[nodiscard]] auto report_each(pipeline_report& report [[clang::lifetimebound]], Line line) {
  return std::apply(
      [&](auto... steps) {
        return (report_to(report, "input") | ... | (steps | report_to(report, name_of(steps))));
      },
      as_steps(std::move(line)));
}

}  // namespace cilantro
