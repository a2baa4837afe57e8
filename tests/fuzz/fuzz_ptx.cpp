// SPDX-License-Identifier: MIT
//
// Any bytes are a cloud that can be used and written, or an io_error; nothing else may happen.
#include <cstddef>
#include <cstdint>
#include <span>

import fuzz_cloud;
import cilantro;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz_cloud(data, size, [](std::span<const std::byte> bytes) {
    return cilantro::read_ptx<float>(bytes);
  });
}
