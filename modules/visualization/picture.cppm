// SPDX-License-Identifier: MIT
export module cilantro.visualization:picture;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :clouds;
import :render;
import :scene;
import :view;

namespace cilantro {

/// How the name of a file ends, in small letters: `.png`.
[[nodiscard]] std::string ending_of(const std::filesystem::path& path);

/// Throws `invalid_input` for a name that does not end in `.png`.
void expect_picture_name(const std::filesystem::path& path);

/// Renders a scene and writes the picture as a PNG file, of all of it or of a view. The file
/// appears under its name when it is complete. Throws `invalid_input` for a name that does not end
/// in `.png`, and as `render` and `write_png` do.
export void write_picture(const scene& all, const std::filesystem::path& path,
                          const render_options& options = {});
export void write_picture(const scene& all, const view& from, const std::filesystem::path& path,
                          const render_options& options = {});
/// As above, of a cloud alone, or of points of any kind.
export template <PointsSource P>
void write_picture(const P& points, const std::filesystem::path& path, const cloud_look& look = {},
                   const render_options& options = {}) {
  expect_picture_name(path);
  write_picture(scene{}.set("points", points, look), path, options);
}

struct write_picture_tap {
  std::filesystem::path path;
  cloud_look how;
  render_options options;

  static constexpr const char* name = "write_picture";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void look(const C& cloud) const {
    write_picture(cloud, path, how, options);
  }
};
/// The step that writes a picture of the cloud, and passes it on unchanged.
export [[nodiscard]] auto write_picture(std::filesystem::path path, cloud_look look = {},
                                        render_options options = {}) {
  expect_picture_name(path);
  return tap_step{write_picture_tap{std::move(path), std::move(look), std::move(options)}};
}

}  // namespace cilantro
