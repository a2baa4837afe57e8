// SPDX-License-Identifier: MIT
export module cilantro.io:image_file;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Reads a depth image: a PNG file with one channel of 16 bits, whose values are returned
/// unchanged. Throws `io_error` for anything else, and for a file that is missing, malformed or
/// truncated.
export [[nodiscard]] image<std::uint16_t> read_depth_png(const std::filesystem::path& path);

/// Reads a colour image with 8 bits per channel from any PNG or JPEG file, recognised by its first
/// bytes. Grey becomes equal red, green and blue; 16 bits are rounded to 8; transparency is
/// dropped. The orientation noted in Exif data is ignored, so that pixels stay where the camera
/// recorded them. Throws `io_error` for other files, including JPEG files in CMYK or with
/// arithmetic coding, and for a file that is missing, malformed or truncated.
export [[nodiscard]] image<rgb> read_color_image(const std::filesystem::path& path);

/// Writes a depth image as a PNG file with one channel of 16 bits. The file appears under its name
/// when it is complete, as with `write_ply`. Throws `io_error`; `invalid_input` for an image
/// without pixels.
export void write_png(const image<std::uint16_t>& depth, const std::filesystem::path& path);

/// As above, for a colour image, with 8 bits per channel.
export void write_png(const image<rgb>& picture, const std::filesystem::path& path);

namespace detail {
/// `read_color_image` for each of the formats.
[[nodiscard]] image<rgb> read_color_png(const std::filesystem::path& path);
[[nodiscard]] image<rgb> read_color_jpeg(const std::filesystem::path& path);
}  // namespace detail

}  // namespace cilantro
