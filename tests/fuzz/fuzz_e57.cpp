// SPDX-License-Identifier: MIT
//
// Any bytes are a cloud that can be used and written, or an io_error; nothing else may happen. The
// bytes are the content of an E57 file, which is cut into pages here, since hardly anything would
// get past their checksums.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "io/e57/e57_pages.hpp"

import fuzz_cloud;
import cilantro;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using cilantro::e57::pages;
  std::vector<std::uint8_t> file;
  for (std::size_t at = 0; at < size; at += pages::payload) {
    const std::size_t begin = file.size();
    file.resize(begin + pages::size);
    std::memcpy(file.data() + begin, data + at, std::min(pages::payload, size - at));
    const std::uint32_t sum = cilantro::e57::checksum::of(
        reinterpret_cast<const char*>(file.data() + begin), pages::payload);
    for (std::size_t i = 0; i < 4; ++i)
      file[begin + pages::payload + i] = static_cast<std::uint8_t>(sum >> (24 - 8 * i));
  }
  return fuzz_cloud(file.data(), file.size(), [](std::span<const std::byte> bytes) {
    return cilantro::read_e57<float>(bytes);
  });
}
