// SPDX-License-Identifier: MIT
//
// Any bytes are a cloud that can be used and written, or an io_error; nothing else may happen. The
// bytes are those of LAS or LAZ files.
#include <cstddef>
#include <cstdint>
#include <span>

import fuzz_cloud;
import cilantro;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto read = [](std::span<const std::byte> bytes) {
    return cilantro::read_las<float>(bytes);
  };
  // What is compressed may be a thousand times, or 16 MiB.
  return fuzz_cloud(data, size, read, 1000 + (std::size_t{1} << 24));
}
