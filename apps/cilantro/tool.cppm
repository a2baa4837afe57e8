// SPDX-License-Identifier: MIT
//
// What the commands share: reading any input, and a line that shows progress.
module;
#include <unistd.h>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>
export module tool;

import cilantro;
import cilantro.visualization;
using namespace cilantro;

/// Shows the progress of long work on a terminal, on one line that disappears at the end.
export class progress_line {
 public:
  progress_line(std::string what, bool quiet)
      : what_{std::move(what)}, shown_{!quiet && ::isatty(STDERR_FILENO) == 1} {}
  progress_line(const progress_line&) = delete;
  progress_line& operator=(const progress_line&) = delete;
  ~progress_line() {
    if (drawn_ >= 0) std::fputs("\r\033[K", stderr);
  }

  [[nodiscard]] task_monitor monitor() {
    if (!shown_) return {};
    return {.progress = [this](double share) { draw(static_cast<int>(100 * share)); }};
  }

 private:
  void draw(int percent) {
    if (percent == drawn_) return;
    drawn_ = percent;
    const std::string bar(static_cast<std::size_t>(percent) / 4, '=');
    std::fprintf(stderr, "\r%s [%-25s] %3d %%", what_.c_str(), bar.c_str(), percent);
    std::fflush(stderr);
  }

  std::string what_;
  bool shown_;
  int drawn_ = -1;
};

/// How all pictures are drawn.
export const render_options picture_look{.supersampling = 2};

/// What a depth image is read with.
export struct depth_settings {
  std::vector<double> camera = {};  ///< fx, fy, cx, cy; if empty, that of a Kinect.
  double per_metre = 1000;          ///< What the image stores for a metre.
};

/// In float where that holds what the file says to the bit, otherwise in double.
export using tool_cloud = std::variant<point_cloud<float, 3>, point_cloud<double, 3>>;

/// Clouds that are larger than memory: surveys, which need double.
export using tool_tiles = tiled_cloud<double, 3>;

/// Whether an argument means many files, or a folder of them.
export bool means_tiles(const std::string& argument) {
  std::error_code error;
  return std::filesystem::is_directory(argument, error) ||
         (argument.find_first_of("*?") != argument.npos &&
          !std::filesystem::exists(argument, error));
}

export struct tiling_settings {
  double edge = 0;
  std::uint64_t megabytes = 0;
  int threads = 0;
};

/// Opens files or folders; for all ranks of a job, if there is one.
export template <class Job>
tool_tiles open_for_tool(const std::vector<std::filesystem::path>& inputs,
                         const tiling_settings& tiling, Job* ranks, bool quiet) {
  progress_line line{"opening", quiet};
  const auto survey = open_tiles<double>(inputs, {.edge = tiling.edge,
                                                  .memory = tiling.megabytes * 1'000'000,
                                                  .threads = tiling.threads,
                                                  .monitor = line.monitor()});
  return ranks != nullptr ? survey.on(*ranks) : survey;
}

export struct tool_input {
  tool_cloud cloud;
  std::optional<pinhole_camera<float>> camera;  ///< Of a depth image.
};

/// How the name of a file ends, in small letters: `.png`.
export std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}
export bool is_depth_image(const std::filesystem::path& path) {
  return ending_of(path) == ".png";
}

bool are_floats(const Eigen::Matrix3Xd& m) {
  return std::ranges::all_of(m.reshaped(),
                             [](double x) { return std::isnan(x) || double(float(x)) == x; });
}

/// A cloud, a depth image as one, or all points of a folder or of a pattern of files.
export tool_input read_input(const std::filesystem::path& path, const depth_settings& depth,
                             bool quiet) {
  if (!is_depth_image(path)) {
    progress_line line{"reading", quiet};
    auto cloud = means_tiles(path.string()) ? open_tiles<double>(path).read()
                                            : read_cloud<double>(path, {.monitor = line.monitor()});
    if (are_floats(cloud.points) && are_floats(cloud.normals))
      return {cast<float>(cloud), std::nullopt};
    return {std::move(cloud), std::nullopt};
  }
  const auto image = read_depth_png(path);
  const float focal = 585.0f * float(image.width()) / 640;
  pinhole_camera<float> camera{image.width(), image.height(),           focal,
                               focal,         float(image.width()) / 2, float(image.height()) / 2};
  if (!depth.camera.empty()) {
    camera.fx = float(depth.camera[0]);
    camera.fy = float(depth.camera[1]);
    camera.cx = float(depth.camera[2]);
    camera.cy = float(depth.camera[3]);
  }
  return {cloud_from_depth(image, camera, {}, depth_scale{depth.per_metre}), camera};
}
