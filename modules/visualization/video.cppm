// SPDX-License-Identifier: MIT
export module cilantro.visualization:video;

import cilantro.standard;
import cilantro.core;
import :render;
import :scene;
import :view;

namespace cilantro {

/// Options of `video` and `write_video`.
export struct video_options {
  /// From 0.01 to 1000; kept as the nearest multiple of 1/1000, or of 1000/1001 as television has
  /// it.
  double frames_per_second = 30;
};

/// A film in the making, frame by frame. The ending of its name says what it becomes:
///
/// - `.mp4`: H.264, which every player and browser shows. The program `ffmpeg` makes it, and must
///   be installed. A last column or row is doubled where the size is odd.
/// - `.y4m`: without any program, uncompressed: three bytes a pixel, for other programs to read.
///   YUV4MPEG2 without subsampling (C444), BT.601 in the limited range, rounded to the nearest.
/// - `.png` with `%d`, or `%04d` for at least four digits, in its name: a picture of each frame,
///   numbered from 0. Each appears when it is added, and stays.
///
/// A film appears under its name when `finish` has returned. Until then, what had that name stays
/// as it was; without `finish`, as when an exception ends the loop, nothing remains of the film.
export class video {
 public:
  /// Throws `invalid_input` for a name with another ending and for a rate out of range; `io_error`
  /// if there can be no file of that name.
  explicit video(const std::filesystem::path& path, const video_options& options = {});
  video(video&& other) noexcept;
  video& operator=(video&& other) noexcept;
  ~video();

  /// Appends a frame. All have the size of the first: throws `invalid_input` otherwise, for a frame
  /// without pixels, and after `finish`. Throws `io_error` if it cannot be written or the program
  /// ended; the film is given up then.
  void add(const image<rgb>& frame);
  /// Ends the film, and gives it its name. Throws `invalid_input` for a film without frames or one
  /// that is finished already, and `io_error` as `add` does.
  void finish();

 private:
  struct film;
  std::unique_ptr<film> film_;  ///< None when it is finished or given up.
};

/// Renders a scene from each of the views, such as those of `turntable`, as a film, in one call.
/// Progress is that over all views. Throws as `video` and `render` do; `invalid_input` without
/// views, and for views of several sizes.
export void write_video(const scene& all, std::span<const view> views,
                        const std::filesystem::path& path, const render_options& options = {},
                        const video_options& film = {});

}  // namespace cilantro
