// SPDX-License-Identifier: MIT
export module cilantro.visualization:html;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :clouds;
import :scene;
import :view;

namespace cilantro {

/// Options of `write_html`.
export struct html_options {
  std::string title = "cilantro";  ///< Of the page.
  rgb background = {24, 26, 32};   ///< Where nothing is.
  bool blend = true;               ///< Whether splats that lie on each other are mixed, at first.
  double edges = 1;     ///< How dark what lies behind an edge becomes, as of `render_options`.
  bool labels = true;   ///< Whether texts are shown, at first.
  bool legends = true;  ///< Whether bars of colours are shown, at first.
  int threads = 0;
  task_monitor monitor = {};
};

/// Writes a scene as a web page that a browser shows without a network: turned, moved, measured,
/// layer by layer, hidden ones at first hidden. One file that any browser with WebGL 2 opens, also
/// from a disk. At first all of it is seen, or what `from` shows.
///
/// Points sized in length are moved by at most 1/64 of the diameter of half of all, others by at
/// most 1/131070 of the longest side of their box, and by 1/4194302 of it in any case. Sizes are
/// within 2 % (of more than 10,000 to 1 in a batch, the smallest grow), normals within 1 degree.
/// Points that are not finite are left out. About 5 bytes a point and, since they are written as
/// text, 6.5 in the file.
///
/// The file appears under its name when it is complete. Throws `invalid_input` for a name that does
/// not end in `.html` and for more than 10⁷ points, more than 10⁷ lines and triangles or their
/// points, textures with more than 8192 pixels on a side, for views that `render` or `orbit`
/// refuse; `io_error` if the file cannot be written; `cancelled`. Time grows as N log N.
export void write_html(const scene& all, const std::filesystem::path& path,
                       const html_options& options = {});
export void write_html(const scene& all, const view& from, const std::filesystem::path& path,
                       const html_options& options = {});
/// As above, of a cloud alone, or of points of any kind.
export template <PointsSource P>
void write_html(const P& points, const std::filesystem::path& path, const cloud_look& look = {},
                const html_options& options = {}) {
  write_html(scene{}.set("points", points, look), path, options);
}

struct write_html_tap {
  std::filesystem::path path;
  cloud_look how;
  html_options options;

  static constexpr const char* name = "write_html";
  static bool writes_outside() { return true; }
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void look(const C& cloud) const {
    write_html(cloud, path, how, options);
  }
};
/// The step that writes a page of the cloud, and passes it on unchanged.
export [[nodiscard]] auto write_html(std::filesystem::path path, cloud_look look = {},
                                     html_options options = {}) {
  return tap_step{write_html_tap{std::move(path), std::move(look), std::move(options)}};
}

}  // namespace cilantro
