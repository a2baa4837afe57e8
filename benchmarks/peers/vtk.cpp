// SPDX-License-Identifier: MIT
//
// Pictures by VTK, which needs a display even where nothing is shown: run.sh starts Xvfb.
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkEDLShading.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPointGaussianMapper.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "common.hpp"
#include "drawn.hpp"

namespace {

vtkNew<vtkPolyData> drawn_points(std::ptrdiff_t count) {
  const many_points many{large_points()};
  const auto& own = large_colors();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(count);
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetNumberOfComponents(3);
  colors->SetNumberOfTuples(count);
  vtkNew<vtkCellArray> cells;
  cells->AllocateExact(count, count);
  for (vtkIdType i = 0; i < count; ++i) {
    const auto p = many[std::size_t(i)];
    points->SetPoint(i, p[0], p[1], p[2]);
    for (int k = 0; k < 3; ++k)
      colors->SetComponent(i, k, own[(3 * std::size_t(i) + std::size_t(k)) % own.size()]);
    cells->InsertNextCell(1, &i);
  }
  vtkNew<vtkPolyData> all;
  all->SetPoints(points);
  all->GetPointData()->SetScalars(colors);
  all->SetVerts(cells);
  return all;
}

/// The view of all pictures.
void look(vtkCamera& camera) {
  const auto view = read_floats("view.f32");
  const auto at = [&](int row, int column) { return double(view[std::size_t(4 * row + column)]); };
  double eye[3] = {};
  for (int k = 0; k < 3; ++k)
    for (int row = 0; row < 3; ++row) eye[k] -= at(row, k) * at(row, 3);
  camera.SetPosition(eye);
  camera.SetFocalPoint(eye[0] + at(2, 0), eye[1] + at(2, 1), eye[2] + at(2, 2));
  camera.SetViewUp(-at(1, 0), -at(1, 1), -at(1, 2));
  camera.SetViewAngle(2 * std::atan(picture_height / 2.0 / at(3, 1)) * 180 / 3.14159265358979);
}

/// The mapper, which draws the points; and whether there are edges.
void picture_by(benchmark::State& state, vtkPolyDataMapper& mapper, vtkPolyData& points,
                bool has_edges) {
  mapper.SetInputData(&points);
  vtkNew<vtkActor> actor;
  actor->SetMapper(&mapper);
  actor->GetProperty()->SetPointSize(3);
  actor->GetProperty()->LightingOff();
  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(background[0] / 255.0, background[1] / 255.0, background[2] / 255.0);
  renderer->AddActor(actor);
  look(*renderer->GetActiveCamera());
  vtkNew<vtkRenderStepsPass> steps;
  vtkNew<vtkEDLShading> edges;
  edges->SetDelegatePass(steps);
  if (has_edges) renderer->SetPass(edges);
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(0);
  window->SetSize(picture_width, picture_height);
  window->AddRenderer(renderer);
  renderer->ResetCameraClippingRange();
  vtkNew<vtkUnsignedCharArray> seen;
  const auto draw = [&] {
    window->Render();
    window->GetPixelData(0, 0, picture_width - 1, picture_height - 1, 0, seen, 0);
    benchmark::DoNotOptimize(seen->GetPointer(0));
  };
  draw();  // The first makes shaders and buffers.
  for (auto _ : state) draw();
  std::vector<std::uint8_t> pixels;
  for (int y = picture_height - 1; y >= 0; --y) {
    const auto* row = seen->GetPointer(vtkIdType{3} * picture_width * y);
    pixels.insert(pixels.end(), row, row + std::size_t{3} * picture_width);
  }
  report_picture(state, pixels, true);
}

/// The default: square points, no edges.
void squares(benchmark::State& state, std::ptrdiff_t count) {
  vtkNew<vtkPolyDataMapper> mapper;
  const auto points = drawn_points(count);
  picture_by(state, *mapper, *points, false);
}
void picture_squares(benchmark::State& state) {
  squares(state, std::ssize(large_points()) / 3);
}
CILANTRO_BENCHMARK(picture_squares);
void picture_squares_of_many(benchmark::State& state) {
  squares(state, picture_points);
}
CILANTRO_BENCHMARK(picture_squares_of_many);

/// Round splats and edges, as near to cilantro's as VTK allows.
void picture_nearest(benchmark::State& state) {
  vtkNew<vtkPointGaussianMapper> mapper;
  mapper->EmissiveOff();
  mapper->SetScaleFactor(splat_diameter / 2.0);
  mapper->SetTriangleScale(1);
  mapper->SetSplatShaderCode(
      "//VTK::Color::Impl\n"
      "if (dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy) > 1.0) discard;\n");
  const auto points = drawn_points(std::ssize(large_points()) / 3);
  picture_by(state, *mapper, *points, true);
}
CILANTRO_BENCHMARK(picture_nearest);

}  // namespace

int main(int argc, char** argv) {
  if (!std::getenv("DISPLAY")) {
    std::fprintf(stderr, "no picture by VTK: there is no display\n");
    return 0;
  }
  limit_drawing_threads();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
