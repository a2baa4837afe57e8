// SPDX-License-Identifier: MIT
// message: family.residual(model, i)
#include <cstdint>
#include <optional>
#include <span>
import cilantro;

struct no_residual {
  using model_type = double;
  static cilantro::index_t size() { return 1; }
  static cilantro::index_t sample_size() { return 1; }
  static std::optional<double> fit(std::span<const std::int32_t>) { return 0; }
};

int main() {
  return cilantro::ransac(no_residual{}, {.max_residual = 1}).has_value();
}
