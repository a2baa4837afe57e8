// SPDX-License-Identifier: MIT
//
// Any bytes are a cloud that can be used and written, or an io_error; nothing else may happen.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

import cilantro;

using namespace cilantro;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto cloud = read_ply<float>(std::as_bytes(std::span{data, size}));
    for (const auto& a : cloud.attributes)
      if (a.size() != cloud.size()) std::abort();
    if (cloud.size() > static_cast<index_t>(size)) std::abort();
    (void)remove_invalid(cloud);
  } catch (const io_error&) {
  }
  return 0;
}
