// SPDX-License-Identifier: MIT
module;
#include <cstdlib>

#include "core/vector_kernels.hpp"
module cilantro.core;

namespace cilantro {
namespace {

constexpr vector_target all_targets[] = {vector_target::avx512, vector_target::avx2,
                                         vector_target::baseline};

vector_target choose() {
  const char* named = std::getenv("CILANTRO_VECTOR_TARGET");
  const std::string_view widest = named ? named : "";
  bool is_allowed = true;
  for (const auto target : all_targets) is_allowed = is_allowed && name_of(target) != widest;
  for (const auto target : all_targets) {
    is_allowed = is_allowed || name_of(target) == widest;
    if (is_allowed && is_available(target)) return target;
  }
  return vector_target::baseline;
}

std::atomic<vector_target>& current() {
  static std::atomic<vector_target> target = choose();
  return target;
}

}  // namespace

std::string_view name_of(vector_target target) {
  switch (target) {
    case vector_target::avx2:
      return "avx2";
    case vector_target::avx512:
      return "avx512";
    case vector_target::baseline:
      break;
  }
  return "baseline";
}

bool is_available([[maybe_unused]] vector_target target) {
#if defined(__x86_64__)
  switch (target) {
    case vector_target::avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
             __builtin_cpu_supports("bmi2");
    case vector_target::avx512:
      return is_available(vector_target::avx2) && __builtin_cpu_supports("avx512f") &&
             __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
             __builtin_cpu_supports("avx512vl");
    case vector_target::baseline:
      break;
  }
#endif
  return target == vector_target::baseline;
}

vector_target current_vector_target() {
  return current().load(std::memory_order_relaxed);
}

void use_vector_target(vector_target target) {
  expects(is_available(target),
          "use_vector_target: not available on this machine: " + std::string{name_of(target)});
  current() = target;
}

}  // namespace cilantro
