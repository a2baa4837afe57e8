// SPDX-License-Identifier: MIT
export module cilantro.cloud:report;

import cilantro.standard;
import cilantro.core;
import :pipeline;
import :point_cloud;

namespace cilantro {

/// What one stage of a pipeline, called `name`, did.
export struct stage_report {
  std::string name;
  index_t points_in = 0;        ///< Points before the stage.
  index_t points_out = 0;       ///< Points after it.
  index_t invalid_dropped = 0;  ///< Non-finite points that the stage has removed.
  double milliseconds = 0;      ///< Wall time, without the time for reporting.
};

/// Collects the reports of `report_to`. Written to a stream, it prints a table with one line per
/// stage.
export class pipeline_report {
 public:
  /// Starts the clock of the first stage.
  pipeline_report() : begun_{clock::now()} {}

  /// The stages so far, in order.
  [[nodiscard]] const std::vector<stage_report>& stages() const [[clang::lifetimebound]] {
    return stages_;
  }

  /// Ends the stage `name`, whose result has `points` points, of which `invalid` are not finite,
  /// and starts the next stage.
  void add(std::string name, index_t points, index_t invalid);
  /// Stops the clock of the current stage, before its result is counted.
  void stop() { stopped_ = clock::now(); }
  /// Starts over with another cloud, whose first stage has no other before it.
  void begin() {
    is_first_ = true;
    invalid_before_.reset();
    begun_ = clock::now();
  }

 private:
  using clock = std::chrono::steady_clock;
  std::vector<stage_report> stages_;
  bool is_first_ = true;
  std::optional<index_t> invalid_before_;
  clock::time_point begun_, stopped_;
};
export std::ostream& operator<<(std::ostream& out, const pipeline_report& report);

struct report_tap {
  pipeline_report* report;
  std::string stage;
  bool is_first = false;

  static constexpr const char* name = "report_to";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {}; }
  template <Scalar S, int D>
  void look(const point_cloud<S, D>& cloud) const {
    if (is_first) report->begin();
    report->stop();
    report->add(stage, cloud.size(), count_non_finite(cloud.points));
  }
};

/// A step that passes the cloud on unchanged, and records in `report`, under `name`, what has
/// happened since the previous record, or since `report` was made. `report` must outlive the step.
export [[nodiscard]] auto report_to(pipeline_report& report [[clang::lifetimebound]],
                                    std::string name) {
  return tap_step{report_tap{&report, std::move(name)}};
}

/// The pipeline with `report_to` after each of its steps, under the step's name, and before the
/// first, under "input". Steps then run one at a time, never joined in one pass. `report` must
/// outlive the result, which may be used for one cloud after another.
export template <PipelineStep Line>
[[nodiscard]] auto report_each(pipeline_report& report [[clang::lifetimebound]], Line line) {
  const tap_step first{report_tap{&report, "input", true}};
  return std::apply(
      [&](auto... steps) { return (first | ... | (steps | report_to(report, name_of(steps)))); },
      as_steps(std::move(line)));
}

}  // namespace cilantro
