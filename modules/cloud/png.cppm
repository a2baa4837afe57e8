// SPDX-License-Identifier: MIT
export module cilantro.cloud:png;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Reads a depth image: a PNG file of one channel with 16 bits, its values as they are.
/// Throws `io_error` for anything else, and for a file that is missing, malformed or truncated.
export [[nodiscard]] image<std::uint16_t> read_depth_png(const std::filesystem::path& path);

/// Reads a picture: any PNG file, as 8 bits a channel. Grey becomes red, green and blue, 16 bits
/// are rounded, and transparency is left out. Throws `io_error` for what is no PNG file, and for a
/// file that is missing, malformed or truncated.
export [[nodiscard]] image<rgb> read_color_png(const std::filesystem::path& path);

/// Writes a depth image as a PNG file of one channel with 16 bits. The file appears when it is
/// complete, as with `write_ply`. Throws `io_error`; `invalid_input` for an image without pixels.
export void write_png(const image<std::uint16_t>& depth, const std::filesystem::path& path);

/// Writes a picture as a PNG file with 8 bits a channel, in the same way.
export void write_png(const image<rgb>& picture, const std::filesystem::path& path);

}  // namespace cilantro
