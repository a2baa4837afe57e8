// SPDX-License-Identifier: MIT
export module cilantro.core:violations;

import cilantro.standard;

namespace cilantro {

/// What a contract test collects: each rule that is broken, once.
export class violation_list {
 public:
  void expect(bool condition, const char* rule) {
    if (!condition && std::ranges::find(found_, rule) == found_.end()) found_.emplace_back(rule);
  }
  [[nodiscard]] bool empty() const { return found_.empty(); }
  [[nodiscard]] std::vector<std::string> take() { return std::move(found_); }

 private:
  std::vector<std::string> found_;
};

}  // namespace cilantro
