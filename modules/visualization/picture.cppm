// SPDX-License-Identifier: MIT
export module cilantro.visualization:picture;

import cilantro.standard;
import cilantro.core;
import :render;
import :scene;
import :view;

namespace cilantro {

/// How the name of a file ends, in small letters: `.png`.
[[nodiscard]] std::string ending_of(const std::filesystem::path& path);

/// Renders a scene and writes the picture as a PNG file, of all of it or of a view. The file
/// appears under its name when it is complete. Throws `invalid_input` for a name that does not end
/// in `.png`, and as `render` and `write_png` do.
export void write_picture(const scene& all, const std::filesystem::path& path,
                          const render_options& options = {});
export void write_picture(const scene& all, const view& from, const std::filesystem::path& path,
                          const render_options& options = {});

/// Throws `invalid_input` for a name that does not end in `.png`.
void expect_picture_name(const std::filesystem::path& path);

/// What the name of a file ends in, in lower case, such as ".png".
std::string ending_of(const std::filesystem::path& path);

}  // namespace cilantro
