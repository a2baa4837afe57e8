// SPDX-License-Identifier: MIT
//
// JPEG files of every kind, which the library reads and does not write.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace test {

struct jpeg_file_options {
  int channels = 3;  ///< 1: grey, 3: red, green and blue, 4: CMYK.
  bool progressive = false, arithmetic = false;
};

/// The bytes of a JPEG file of the best quality, made of `channels` bytes a pixel.
std::string jpeg_file(const std::vector<std::uint8_t>& pixels, int width, int height,
                      const jpeg_file_options& options = {});

}  // namespace test
