// SPDX-License-Identifier: MIT
export module cilantro.io:image_file;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Reads a depth image: a PNG file of one channel with 16 bits, its values as they are.
/// Throws `io_error` for anything else, and for a file that is missing, malformed or truncated.
export [[nodiscard]] image<std::uint16_t> read_depth_png(const std::filesystem::path& path);

/// Reads a picture: any PNG or JPEG file, told apart by how they begin, as 8 bits a channel. Grey
/// becomes red, green and blue, 16 bits are rounded, and transparency is left out. Pixels stay
/// where the camera put them: a note that a viewer should turn the picture (Exif) is not followed.
/// Throws `io_error` for anything else (JPEG files in CMYK or with arithmetic coding among it), and
/// for a file that is missing, malformed or truncated.
export [[nodiscard]] image<rgb> read_color_image(const std::filesystem::path& path);

/// Writes a depth image as a PNG file of one channel with 16 bits. The file appears when it is
/// complete, as with `write_ply`. Throws `io_error`; `invalid_input` for an image without pixels.
export void write_png(const image<std::uint16_t>& depth, const std::filesystem::path& path);

/// Writes a picture as a PNG file with 8 bits a channel, in the same way.
export void write_png(const image<rgb>& picture, const std::filesystem::path& path);

namespace detail {
/// One of both, by the format.
[[nodiscard]] image<rgb> read_color_png(const std::filesystem::path& path);
[[nodiscard]] image<rgb> read_color_jpeg(const std::filesystem::path& path);
}  // namespace detail

}  // namespace cilantro
