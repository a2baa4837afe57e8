// SPDX-License-Identifier: MIT
//
// Small pictures of each kind of thing and each look, equal to those beside this file to the bit.
// With CILANTRO_DRAW_GOLDENS=1 in the environment they are drawn anew, to be looked at.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

import cilantro.visualization;

using namespace cilantro;

namespace {

/// A ball that stands on a floor, with all that clouds can have; the same numbers everywhere.
point_cloud<float, 3> ball_on_floor() {
  constexpr int on_ball = 700, side = 24, n = on_ball + side * side;
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf(3, n),
                              .normals = Eigen::Matrix3Xf(3, n),
                              .colors = Eigen::Matrix3Xf(3, n)};
  std::vector<std::int32_t> part(n);
  std::vector<float> heat(n);
  random_stream random{3};
  for (int i = 0; i < n; ++i) {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(), place;
    if (i < on_ball) {
      const double z = 1 - 2 * (i + 0.5) / on_ball, r = std::sqrt(1 - z * z), angle = 2.399963 * i;
      normal = {r * std::cos(angle), r * std::sin(angle), z};
      place = 0.5 * normal + Eigen::Vector3d{0, 0, 0.5};
    } else {
      const int k = i - on_ball;
      place = {(k % side - 11.5) / 10, (k / side - 11.5) / 10, 0};
    }
    cloud.points.col(i) = place.cast<float>();
    cloud.normals.col(i) = normal.cast<float>();
    cloud.colors.col(i) << float(random.uniform(0.3, 1)), float(0.5 + 0.2 * normal.x()), 0.4f;
    part[std::size_t(i)] = i < on_ball ? int(normal.z() > 0) : -1;
    heat[std::size_t(i)] =
        i % 50 == 0 ? std::numeric_limits<float>::quiet_NaN() : float(20 + 10 * place.z());
  }
  cloud.set_attribute("part", part);
  cloud.set_attribute("heat", heat);
  return cloud;
}

triangle_batch tent() {
  triangle_batch mesh{.colors = color_matrix(3, 5)};
  mesh.points.resize(3, 5);
  mesh.points << -1, 1, 1, -1, 0, -1, -1, 1, 1, 0, 0, 0, 0, 0, 1;
  mesh.triangles.resize(3, 4);
  mesh.triangles << 0, 1, 2, 3, 1, 2, 3, 0, 4, 4, 4, 4;
  mesh.colors << 255, 0, 0, 255, 255, 0, 255, 0, 255, 255, 0, 0, 255, 0, 255;
  return mesh;
}

image<rgb> checks() {
  image<rgb> picture(16, 12);
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 16; ++x)
      picture(x, y) =
          (x / 2 + y / 2) % 2 == 0 ? rgb{240, 240, 240} : rgb{30, std::uint8_t(15 * x), 120};
  return picture;
}

view from_the_side(bool orthographic = false) {
  view v = look_at({1.4, -2.6, 1.5}, {0, 0, 0.35}, {0, 0, 1},
                   {.width = 160, .height = 120, .orthographic = orthographic});
  return v;
}

struct golden {
  std::string name;
  scene all;
  render_options options = {};
  view from = from_the_side();
};

std::vector<golden> goldens() {
  const auto cloud = ball_on_floor();
  const auto drawn = [&](const cloud_look& look) { return scene{}.set("cloud", cloud, look); };
  const render_options alone{.blend = false, .edges = 0};

  auto smooth = tent();
  smooth.normals = smooth.points;
  smooth.normals.row(2).array() += 0.5f;
  auto photo = tent();
  photo.colors = one_color({200, 200, 200});
  photo.texture = std::make_shared<const image<rgb>>(checks());
  photo.texture_places.resize(2, 5);
  photo.texture_places << 0, 15, 15, 0, 7.5f, 11, 11, 0, 0, 5.5f;
  auto glass = tent();
  glass.colors = one_color({90, 160, 255});
  glass.opacity = 0.5;

  // Off centre, with the near plane through the floor and another focal length for each axis.
  view off_centre = from_the_side();
  off_centre.camera.cx = 30;
  off_centre.camera.cy = 80;
  off_centre.camera.fy *= 1.4;
  view inside =
      look_at({0.3, 0.2, 0.1}, {-1, -0.6, 0.05}, {0, 0, 1}, {.width = 160, .height = 120});

  point_cloud<double, 3> far{.points = cloud.points.cast<double>(),
                             .normals = cloud.normals.cast<double>()};
  far.points.colwise() += Eigen::Vector3d{4e7, -3e7, 2e3};
  scene at_far;
  at_far.set("cloud", far);

  return {
      {"own_colors", drawn({})},
      {"round", drawn({.along_normals = false})},
      {"round_alone", drawn({.lit = false, .along_normals = false}), alone},
      {"one_color_by_length", drawn({.color = rgb{120, 220, 160}, .size = splat_length{0.08}})},
      {"pixels", drawn({.size = splat_pixels{3}, .along_normals = false})},
      {"attribute", drawn({.color = by_attribute{"heat", viridis}})},
      {"labels", drawn({.color = by_label{"part"}}), {.background = {255, 255, 255}}},
      {"coordinate",
       drawn({.color = by_coordinate{2, blue_to_red, -1.0, 1.0}}),
       {.legends = false}},
      {"normals", drawn({.color = by_normal{}})},
      {"transparent", drawn({.opacity = 0.2})},
      {"parallel_rays", drawn({}), {}, from_the_side(true)},
      {"off_centre", drawn({}), {}, off_centre},
      {"supersampled", drawn({}), {.supersampling = 3}},
      {"no_edges", drawn({}), {.edges = 0}},
      {"budget", drawn({}), {.point_budget = 300}},
      {"far_away",
       at_far,
       {},
       fit(at_far, {-1.4, 2.6, -1.2}, {0, 0, 1}, {.width = 160, .height = 120})},
      {"flat_mesh", scene{}.set("tent", tent())},
      {"smooth_mesh", scene{}.set("tent", smooth)},
      {"texture", scene{}.set("tent", photo)},
      {"wireframe", scene{}.set("tent", wireframe(tent(), {255, 255, 255}))},
      {"glass", drawn({}).set("tent", glass).set("other", triangle_batch{glass})},
      {"inside_a_mesh",
       scene{}
           .set("tent", tent())
           .set("box", box_lines({Eigen::Vector3d{-1, -1, 0}, Eigen::Vector3d{1, 1, 1}})),
       {},
       inside},
      {"lines", scene{}
                    .set("grid", grid_lines({.step = 0.25}))
                    .set("frame", frame_lines(Eigen::Isometry3d::Identity()))
                    .set("camera", frustum_lines({64, 48, 60, 60, 31.5, 23.5}, 0.8))
                    .set("normals", normal_lines(cloud, {.length = 0.2, .every = 9}))},
      {"texts", scene{}
                    .set("frame", frame_lines(Eigen::Isometry3d::Identity()))
                    .set("one", label{"Ag 12,5 ±µ°", {-0.9, 0, 0.2}})
                    .set("two", label{"two\nlines", {0.3, 0, 0.6}, rgb{255, 200, 80}, 9})},
      {"image",
       scene{}.set("image", checks(), image_look{.pixel_size = {0.1, 0.1}}),
       {},
       look_at({0.8, -1.6, 1.4}, {0.75, -0.55, 0}, {0, 0, 1}, {.width = 160, .height = 120})},
      {"two_dimensions",
       scene{}.set("plane", Eigen::Matrix2Xf{cloud.points.topRows(2)}),
       {},
       fit(scene{}.set("plane", Eigen::Matrix2Xf{cloud.points.topRows(2)}),
           {.width = 160, .height = 120})},
      {"one_point", scene{}.set("point", Eigen::Matrix3Xf{Eigen::Vector3f{0, 0, 0.35f}})},
      {"nothing", scene{}},
  };
}

}  // namespace

TEST_CASE("each kind of thing is drawn in each look as it was, to the bit") {
  const std::filesystem::path folder = CILANTRO_GOLDENS;
  const bool draws = std::getenv("CILANTRO_DRAW_GOLDENS") != nullptr;
  for (const auto& [name, all, options, from] : goldens()) {
    CAPTURE(name);
    auto sized = options;
    sized.width = 160;
    sized.height = 120;
    const auto picture = render(all, from, sized);
    if (draws) write_png(picture, folder / (name + ".png"));
    const auto golden = read_color_image(folder / (name + ".png"));
    CHECK(picture == golden);
    sized.threads = 3;
    CHECK(render(all, from, sized) == golden);
  }
}
