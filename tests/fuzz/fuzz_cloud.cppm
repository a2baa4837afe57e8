// SPDX-License-Identifier: MIT
//
// What every reader of clouds is asked.
module;
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
export module fuzz_cloud;

import cilantro;

/// Reads, and aborts unless that gives a sound cloud of a size that the bytes can hold. (One byte
/// is up to 88 after decompression, and a point at least two; or as many as `each` points.)
export template <class Read>
int fuzz_cloud(const std::uint8_t* data, std::size_t size, Read read, std::size_t each = 44) {
  try {
    const auto cloud = read(std::as_bytes(std::span{data, size}));
    for (const auto& a : cloud.attributes)
      if (a.size() != cloud.size()) std::abort();
    if (cloud.size() > static_cast<cilantro::index_t>(size * each)) std::abort();
    // Throws for a cloud that is not consistent.
    (void)cilantro::remove_invalid(cloud);
  } catch (const cilantro::io_error&) {
  }
  return 0;
}
