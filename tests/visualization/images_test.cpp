// SPDX-License-Identifier: MIT
//
// Images in scenes, pixel by pixel, and textures held against geometry.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <utility>
#include <vector>

import cilantro.visualization;
import test_support;

using namespace cilantro;

namespace {

constexpr rgb background{24, 26, 32};

/// Every pixel another colour.
image<rgb> colorful(int width, int height) {
  image<rgb> colors(width, height);
  int number = 1;
  for (auto& pixel : colors.pixels()) {
    pixel = {std::uint8_t(number), std::uint8_t(number >> 8), std::uint8_t(7 * number)};
    ++number;
  }
  return colors;
}
Eigen::Isometry3d some_pose() {
  Eigen::Isometry3d pose{Eigen::AngleAxisd{0.7, Eigen::Vector3d{1, 2, -1}.normalized()}};
  pose.translation() << 400'000, -30, 12.5;
  return pose;
}
pinhole_camera<double> some_camera() {
  pinhole_camera<double> camera{48, 36, 50.5, 47.25, 20.25, 19.5};
  camera.to_world = some_pose();
  return camera;
}
/// The part of a picture at its top left.
image<rgb> part_of(const image<rgb>& picture, int width, int height) {
  image<rgb> part(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) part(x, y) = picture(x, y);
  return part;
}
/// A rectangle of constant z whose corners are in the corners of a texture.
triangle_batch textured(const image<rgb>& texture, double width, double height) {
  triangle_batch mesh{.texture = std::make_shared<const image<rgb>>(texture)};
  const auto w = float(width / 2), h = float(height / 2);
  mesh.points.resize(3, 4);
  mesh.points << -w, w, w, -w, h, h, -h, -h, 0, 0, 0, 0;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  const float right = float(texture.width()) - 0.5f, bottom = float(texture.height()) - 0.5f;
  mesh.texture_places.resize(2, 4);
  mesh.texture_places << -0.5f, right, right, -0.5f, -0.5f, -0.5f, bottom, bottom;
  return mesh;
}

}  // namespace

TEST_CASE("an image seen one to one is the image, wherever it lies and however it is drawn") {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {7, 5}, {1, 40}, {40, 1}, {320, 240}, {257, 129}, {64, 64}}) {
    const auto picture = colorful(width, height);
    for (const image_look& look : {image_look{}, image_look{.pixel_size = {0.01, 0.013}},
                                   image_look{.pose = some_pose(), .pixel_size = {0.5, 0.5}}}) {
      const scene all = std::move(scene{}.set("image", picture, look));
      for (const render_options& options :
           {render_options{}, render_options{.supersampling = 3}, render_options{.threads = 1}})
        CHECK(render(all, one_to_one(picture, look), options) == picture);
    }
    CHECK(render(picture) == picture);
    const image_view seen{picture};
    CHECK(render(seen) == picture);
  }
}

TEST_CASE("an enlarged image has equal squares, and a wider picture shows all of it") {
  const auto small = colorful(6, 4);
  const auto picture = render(small, {}, {.width = 62, .height = 40});
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 62; ++x)
      CHECK(picture(x, y) == (x < 1 || x > 60 ? background : small((x - 1) / 10, y / 10)));
}

TEST_CASE("the middle of pixel (x, y) is at (x, -y, 0), rows going down") {
  const auto picture = colorful(9, 6);
  const scene all = std::move(scene{}.set("image", picture));
  const auto bounds = all.bounds();
  CHECK(bounds.min().isApprox(Eigen::Vector3d{-0.5, -5.5, 0}));
  CHECK(bounds.max().isApprox(Eigen::Vector3d{8.5, 0.5, 0}));
  const auto found = pick(all, one_to_one(picture), 7, 2);
  REQUIRE(found);
  CHECK((found->place - Eigen::Vector3d{7, -2, 0}).norm() < 1e-5);
  // What fits the scene looks straight down, y upwards: the first pixel is at the top left.
  const auto seen = render(all, fit(all, {.width = 90, .height = 60, .orthographic = true}));
  CHECK(seen(5, 5) == picture(0, 0));
  CHECK(seen(84, 54) == picture(8, 5));
}

TEST_CASE("an image where its camera took it covers exactly what the camera sees") {
  const auto camera = some_camera();
  const auto photo = colorful(camera.width, camera.height);
  for (const double depth : {0.1, 1.0, 50.0}) {
    scene all;
    all.set("photo", photo, image_at(camera, depth));
    CHECK(render(all, view{camera, depth}, {.supersampling = 2}) == photo);
    const auto corners = frustum_lines(camera, depth);
    const Eigen::AlignedBox3d box = all.bounds();
    for (int corner = 1; corner < 5; ++corner)
      CHECK(box.exteriorDistance(corners.points.col(corner).cast<double>() + corners.origin) <
            1e-4 * depth);
  }
  pinhole_camera<double> none{0, 0, 1, 1, 0, 0};
  CHECK_THROWS_AS((void)image_at(none), invalid_input);
}

TEST_CASE("numbers have the colours of a map, between the ends that are given or are there") {
  image<float> values(5, 2);
  values.pixels() = {0, 1, 2, 3, 4, -1, test::nan<float>, test::infinity<float>, 2.5f, -9};
  color_map map{viridis};
  map.unknown = {1, 2, 3};
  const auto colors_between = [&](double low, double high, const auto& known) {
    image<rgb> colors(5, 2);
    for (std::size_t i = 0; i < 10; ++i)
      colors.pixels()[i] = map((double(known.pixels()[i]) - low) / (high - low));
    return colors;
  };
  const render_options no_legend{.legends = false};
  CHECK(render(values, {.map = map}, no_legend) == colors_between(-9, 4, values));
  CHECK(render(values, {.map = map, .low = 0, .high = 3}, no_legend) ==
        colors_between(0, 3, values));
  auto without_ones = values;
  without_ones(1, 0) = test::nan<float>;
  CHECK(render(values, {.map = map, .unknown = 1}, no_legend) ==
        colors_between(-9, 4, without_ones));

  canvas on;
  draw(values, on, {.map = map, .high = 3, .title = "m"});
  REQUIRE(on.legends().size() == 1);
  CHECK(on.legends()[0].title == "m");
  CHECK(on.legends()[0].low == -9);
  CHECK(on.legends()[0].high == 3);
  CHECK(on.legends()[0].colors.back() == map(1 - 0.5 / 256));

  // Any kind of numbers, and matrices whose rows are rows.
  const Eigen::Matrix<double, 2, 5, Eigen::RowMajor> matrix =
      Eigen::Map<const Eigen::Matrix<float, 2, 5, Eigen::RowMajor>>{values.pixels().data()}
          .cast<double>();
  CHECK(render(matrix, {.map = map}, no_legend) == colors_between(-9, 4, values));
  image<std::uint8_t> bytes(2, 1);
  bytes(1, 0) = 255;
  const auto gray = render(bytes, {.map = gray_scale}, no_legend);
  CHECK(gray(0, 0) == rgb{0, 0, 0});
  CHECK(gray(1, 0) == rgb{255, 255, 255});
}

TEST_CASE("a depth of zero is not known, unless told otherwise") {
  image<std::uint16_t> depth(3, 1);
  depth.pixels() = {0, 1000, 3000};
  const render_options no_legend{.legends = false};
  const auto usual = render(depth, {}, no_legend);
  CHECK(usual(0, 0) == color_map{}.unknown);
  CHECK(usual(1, 0) == turbo(0));
  CHECK(usual(2, 0) == turbo(1));
  CHECK(render(depth, {.unknown = test::nan<double>}, no_legend)(0, 0) == turbo(0));
  CHECK(render(depth, {.unknown = 3000}, no_legend)(2, 0) == color_map{}.unknown);
  // All the same, or nothing known.
  CHECK(render(image<float>(2, 2, 7.0f), {}, no_legend)(1, 1) == color_map{}(0.5));
  CHECK(render(image<std::uint16_t>(2, 2), {}, no_legend)(1, 1) == color_map{}.unknown);
}

TEST_CASE("the legend stands beside the image, and covers nothing of it") {
  image<float> values(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) values(x, y) = float(x * y);
  const auto plain = render(values, {}, {.legends = false});
  CHECK(plain.width() == 160);
  const auto with_legend = render(values, {.title = "metres"});
  CHECK(with_legend.width() > 180);
  CHECK(with_legend.width() < 250);
  CHECK(with_legend.height() == 120);
  CHECK(part_of(with_legend, 160, 120) == plain);
  std::set<rgb> beside;
  for (int y = 0; y < 120; ++y)
    for (int x = 160; x < with_legend.width(); ++x) beside.insert(with_legend(x, y));
  CHECK(beside.size() > 30);

  // In a picture of a given size, whichever side is short of room.
  for (const auto& [width, height] : {std::pair{400, 240}, {400, 600}, {800, 240}}) {
    const auto whole = render(values, {.title = "metres"}, {.width = width, .height = height});
    const auto bare =
        render(values, {.title = "metres"}, {.width = width, .height = height, .legends = false});
    CHECK(whole.width() == width);
    CHECK(whole.height() == height);
    std::set<rgb> colors;
    for (const auto& pixel : whole.pixels()) colors.insert(pixel);
    for (const float value : {values(159, 119), values(0, 0), values(80, 60)})
      CHECK(colors.count(turbo(double(value) / (159 * 119))) == 1);
    CHECK(whole != bare);
  }
  // Too low for a legend.
  CHECK(render(image<float>(30, 20)).width() == 30);
}

TEST_CASE("an image is written as a picture") {
  const test::temporary_folder folder;
  image<std::uint16_t> depth(40, 30, 1200);
  depth(3, 4) = 0;
  write_picture(depth, folder / "depth.png", {.map = viridis, .title = "mm"});
  CHECK(read_color_image(folder / "depth.png") == render(depth, {.map = viridis, .title = "mm"}));
  CHECK_THROWS_AS(write_picture(depth, folder / "depth.tif"), invalid_input);
  CHECK(folder.count() == 1);
}

TEST_CASE("images and looks that make no sense are refused") {
  const auto picture = colorful(3, 2);
  const auto refused = [](const auto& image, const image_look& look) {
    scene all;
    CHECK_THROWS_AS(all.set("image", image, look), invalid_input);
  };
  const image<float> values(3, 2);
  refused(picture, {.map = turbo});
  refused(picture, {.low = 0});
  refused(picture, {.high = 0});
  refused(picture, {.unknown = 0});
  refused(picture, {.title = "title"});
  refused(picture, {.pixel_size = {1, 0}});
  refused(picture, {.opacity = 1.5});
  refused(values, {.low = 2, .high = 1});
  refused(values, {.high = test::nan<double>});
  image_look nowhere;
  nowhere.pose.translation().x() = test::nan<double>;
  refused(values, nowhere);
  CHECK_THROWS_AS((void)one_to_one(values, nowhere), invalid_input);
  // Without pixels there is nothing to see.
  canvas on;
  draw(image<rgb>{}, on);
  draw(image<float>{}, on, {.title = "title"});
  CHECK(on.triangles().empty());
  CHECK(on.legends().empty());
  CHECK_THROWS_AS((void)one_to_one(image<rgb>{}), invalid_input);
  CHECK_THROWS_AS((void)render(image<float>{}), invalid_input);
}

TEST_CASE("edges darken no image that is alone, from whatever side") {
  const image<rgb> plain(40, 30, {200, 100, 50});
  scene all;
  all.set("image", plain);
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d{0.5, 1, -0.6}, Eigen::Vector3d{-1, 0.2, -0.2},
        Eigen::Vector3d{0.1, 0, 1}}) {
    std::set<rgb> colors;
    const auto picture =
        render(all, fit(all, direction, Eigen::Vector3d::UnitY(), {.width = 200, .height = 150}),
               {.edges = 5});
    for (const auto& pixel : picture.pixels()) colors.insert(pixel);
    CHECK(colors == std::set<rgb>{background, {200, 100, 50}});
  }
  // Triangles that are lit get darker, with a texture, too.
  auto mesh = textured(plain, 4, 3);
  const auto centre_of = [](const triangle_batch& one) {
    const scene tilted = std::move(scene{}.set("mesh", one));
    return render(tilted, fit(tilted, {1, 0, -1}, {0, 1, 0}, {.width = 80, .height = 60}))(40, 30);
  };
  CHECK(centre_of(mesh)[0] < 190);
  mesh.lit = false;
  CHECK(centre_of(mesh) == rgb{200, 100, 50});
}

TEST_CASE("a texture lies on its triangles in perspective") {
  const auto texture = colorful(23, 17);
  auto mesh = textured(texture, 2.3, 1.7);
  mesh.lit = false;
  const scene all = std::move(scene{}.set("mesh", mesh));
  for (const bool orthographic : {false, true}) {
    auto from = look_at({1.5, -2, 0.9}, {0.1, 0.05, 0}, Eigen::Vector3d::UnitZ(),
                        {.width = 161, .height = 121, .orthographic = orthographic});
    from.camera.cx += 12.5;
    const auto picture = render(all, from, {.edges = 0});
    const Eigen::Matrix3d& axes = from.camera.to_world.linear();
    int compared = 0;
    for (int y = 0; y < 121; ++y)
      for (int x = 0; x < 161; ++x) {
        const Eigen::Vector3d beside{(x - from.camera.cx) / from.camera.fx,
                                     (y - from.camera.cy) / from.camera.fy, 0};
        const Eigen::Vector3d begin =
            from.eye() + (orthographic ? Eigen::Vector3d{axes * beside} : Eigen::Vector3d::Zero());
        const Eigen::Vector3d ray =
            orthographic ? from.ahead()
                         : Eigen::Vector3d{axes * (beside + Eigen::Vector3d::UnitZ())};
        const Eigen::Vector3d at = begin - begin.z() / ray.z() * ray;
        const double u = 10 * at.x() + 11, v = -10 * at.y() + 8;
        // Where two pixels of the texture meet, either may be seen.
        if (std::abs(u - std::floor(u) - 0.5) < 1e-4 || std::abs(v - std::floor(v) - 0.5) < 1e-4)
          continue;
        const bool is_seen = u > -0.5 && u < 22.5 && v > -0.5 && v < 16.5;
        CHECK(picture(x, y) ==
              (is_seen ? texture(int(std::floor(u + 0.5)), int(std::floor(v + 0.5))) : background));
        compared += is_seen;
      }
    CHECK(compared > 2000);
  }
}

TEST_CASE("beyond a texture are the pixels at its borders, and veils have textures, too") {
  const auto texture = colorful(4, 3);
  auto mesh = textured(texture, 40, 30);
  mesh.lit = false;
  mesh.texture_places.array() *= 100;
  const scene all = std::move(scene{}.set("mesh", mesh));
  const auto seen = render(all, fit(all, {.width = 40, .height = 30}));
  CHECK(seen(37, 27) == texture(3, 2));

  const auto photo = colorful(8, 6);
  const auto veil = render(photo, {.opacity = 0.5}, {.background = {0, 0, 0}});
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 8; ++x)
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(std::abs(veil(x, y)[k] - photo(x, y)[k] / 2.0) <= 1);
}

TEST_CASE("textures that do not fit their triangles are refused") {
  const auto texture = colorful(4, 3);
  const auto refused = [](const triangle_batch& mesh) {
    canvas on;
    CHECK_THROWS_AS(on.add(mesh), invalid_input);
  };
  auto mesh = textured(texture, 4, 3);
  mesh.texture_places.conservativeResize(2, 3);
  refused(mesh);
  mesh = textured(texture, 4, 3);
  mesh.texture_places(0, 1) = test::nan<float>;
  refused(mesh);
  mesh = textured(texture, 4, 3);
  mesh.colors = color_matrix::Zero(3, 4);
  refused(mesh);
  mesh = textured(texture, 4, 3);
  mesh.texture = nullptr;
  refused(mesh);
  mesh = textured(texture, 4, 3);
  mesh.texture = std::make_shared<const image<rgb>>();
  refused(mesh);
}
