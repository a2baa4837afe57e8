// SPDX-License-Identifier: MIT
//
// Any bytes are a matrix of as many numbers as they can hold, or an io_error.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

import cilantro;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto matrix = cilantro::read_matrix<float>(std::as_bytes(std::span{data, size}));
    if (matrix.size() > cilantro::index_t(size)) std::abort();
  } catch (const cilantro::io_error&) {
  }
  return 0;
}
