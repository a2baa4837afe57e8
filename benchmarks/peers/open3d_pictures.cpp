// SPDX-License-Identifier: MIT
//
// Pictures by Open3D, which needs a display even where nothing is shown: run.sh starts Xvfb.
#include <open3d/camera/PinholeCameraParameters.h>
#include <open3d/geometry/Image.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/visualization/visualizer/RenderOption.h>
#include <open3d/visualization/visualizer/ViewControl.h>
#include <open3d/visualization/visualizer/Visualizer.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "common.hpp"
#include "drawn.hpp"

namespace {

std::shared_ptr<open3d::geometry::PointCloud> drawn_points(std::ptrdiff_t count) {
  const many_points many{large_points()};
  const auto& own = large_colors();
  auto all = std::make_shared<open3d::geometry::PointCloud>();
  for (std::size_t i = 0; i < std::size_t(count); ++i) {
    const auto p = many[i];
    all->points_.emplace_back(p[0], p[1], p[2]);
    const auto color = [&](std::size_t k) { return own[(3 * i + k) % own.size()] / 255.0; };
    all->colors_.emplace_back(color(0), color(1), color(2));
  }
  return all;
}

void picture_of(benchmark::State& state, std::ptrdiff_t count) {
  open3d::visualization::Visualizer window;
  if (!window.CreateVisualizerWindow("", picture_width, picture_height, 0, 0, false)) {
    state.SkipWithError("no window");
    return;
  }
  window.GetRenderOption().point_size_ = 3;
  window.GetRenderOption().background_color_ =
      Eigen::Vector3d{background[0], background[1], background[2]} / 255;
  window.AddGeometry(drawn_points(count));
  const auto view = read_floats("view.f32");
  open3d::camera::PinholeCameraParameters camera;
  camera.intrinsic_.SetIntrinsics(picture_width, picture_height, view[12], view[13], view[14],
                                  view[15]);
  camera.extrinsic_.setIdentity();
  for (int i = 0; i < 12; ++i) camera.extrinsic_(i / 4, i % 4) = view[std::size_t(i)];
  window.GetViewControl().ConvertFromPinholeCameraParameters(camera, true);
  std::shared_ptr<open3d::geometry::Image> seen;
  const auto draw = [&] {
    seen = window.CaptureScreenFloatBuffer(true);
    benchmark::DoNotOptimize(seen->data_.data());
  };
  draw();  // The first makes shaders and buffers.
  for (auto _ : state) draw();
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < picture_height; ++y)
    for (int x = 0; x < picture_width; ++x)
      for (int k = 0; k < 3; ++k)
        pixels.push_back(std::uint8_t(*seen->PointerAt<float>(x, y, k) * 255 + 0.5f));
  report_picture(state, pixels, true);
}

void picture_squares(benchmark::State& state) {
  picture_of(state, std::ssize(large_points()) / 3);
}
void picture_squares_of_many(benchmark::State& state) {
  picture_of(state, picture_points);
}

/// Where there is no display, there are no such tasks.
[[maybe_unused]] const bool are_registered = [] {
  if (!std::getenv("DISPLAY")) return false;
  limit_drawing_threads();
  const auto add = [](const char* name, auto run) {
    benchmark::RegisterBenchmark(name, run)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime()
        ->MeasureProcessCPUTime();
  };
  add("picture_squares", picture_squares);
  add("picture_squares_of_many", picture_squares_of_many);
  return true;
}();

}  // namespace
