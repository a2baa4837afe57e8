// SPDX-License-Identifier: MIT
export module cilantro.core:violations;

import cilantro.standard;

namespace cilantro {

/// Collects the rules that a contract test finds broken, each once.
export class violation_list {
 public:
  /// Adds `rule` to the list unless `condition` holds or it is there already.
  void expect(bool condition, const char* rule) {
    if (!condition && std::ranges::find(found_, rule) == found_.end()) found_.emplace_back(rule);
  }
  [[nodiscard]] bool empty() const { return found_.empty(); }
  /// The broken rules in the order in which they were found, moved out of the list.
  [[nodiscard]] std::vector<std::string> take() { return std::move(found_); }

 private:
  std::vector<std::string> found_;
};

}  // namespace cilantro
