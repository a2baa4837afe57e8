// SPDX-License-Identifier: MIT
//
// What is drawn, and where, held against geometry.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <numbers>
#include <stop_token>
#include <string>
#include <vector>

import cilantro.visualization;
import test_support;

using namespace cilantro;

namespace {

constexpr rgb black{0, 0, 0}, red{255, 0, 0}, green{0, 255, 0}, blue{0, 0, 255};
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// Without anything that changes colours.
render_options plain() {
  return {.background = black, .blend = false, .edges = 0, .threads = 1};
}
/// From 10 above the origin, straight down, y upwards; 100 pixels are 1 at the height of 0.
view from_above(int width = 201, int height = 151) {
  view v{pinhole_camera<double>{width, height, 1000, 1000, (width - 1) / 2.0, (height - 1) / 2.0}};
  v.camera.to_world.linear() = Eigen::Vector3d{1, -1, -1}.asDiagonal();
  v.camera.to_world.translation() = Eigen::Vector3d{0, 0, 10};
  v.distance = 10;
  return v;
}
point_batch one_point(double x, double y, double z, const rgb& color, float pixels = 9) {
  point_batch batch{.points = Eigen::Vector3d{x, y, z}.cast<float>(), .colors = one_color(color)};
  batch.size.sizes.setConstant(pixels);
  return batch;
}
/// Two triangles that make up a square of constant z.
triangle_batch square(double half, double z, const rgb& color) {
  triangle_batch mesh{.colors = one_color(color)};
  mesh.points.resize(3, 4);
  mesh.points << -half, half, half, -half, -half, -half, half, half, z, z, z, z;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  return mesh;
}
int count(const image<rgb>& picture, const rgb& color) {
  int n = 0;
  for (const auto& pixel : picture.pixels()) n += pixel == color;
  return n;
}
int differing(const image<rgb>& a, const image<rgb>& b) {
  REQUIRE(a.pixels().size() == b.pixels().size());
  int n = 0;
  for (std::size_t i = 0; i < a.pixels().size(); ++i) n += a.pixels()[i] != b.pixels()[i];
  return n;
}
/// A bit of everything.
scene mixed_scene() {
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf(3, 2000)};
  random_stream random{7};
  std::vector<float> values;
  for (auto p : cloud.points.colwise()) {
    p << float(random.uniform(-0.8, 0.8)), float(random.uniform(-0.6, 0.6)), 0;
    p.z() = 0.2f * std::sin(4 * p.x()) * std::cos(5 * p.y());
    values.push_back(p.z());
  }
  cloud.set_attribute("height", values);
  auto veil = square(0.3, 0.5, green);
  veil.opacity = 0.4;
  auto mist = one_point(0.3, 0.3, 0.8, red, 40);
  mist.opacity = 0.7;
  scene all;
  all.set("cloud", cloud, cloud_look{.color = by_attribute{"height"}})
      .set("veil", veil)
      .set("mist", mist)
      .set("axes", frame_lines(Eigen::Isometry3d::Identity(), 0.5))
      .set("mesh", square(0.2, -0.1, blue))
      .set("text", label{"here", {-0.5, -0.4, 0.3}});
  return all;
}

}  // namespace

TEST_CASE("a splat is a disc of its size, and smaller where it is farther away") {
  for (const double z : {0.0, 5.0, -10.0}) {
    auto point = one_point(0.1, -0.05, z, red, 0.5f);
    point.size.in = point_size::unit::length;
    const auto picture = render(scene{}.set("p", point), from_above(), plain());
    const double radius = 0.25 * 1000 / (10 - z);
    CHECK(count(picture, red) == doctest::Approx(std::numbers::pi * radius * radius).epsilon(0.03));
  }
}

TEST_CASE("a point is seen at the pixel that the camera's numbers say") {
  view v = from_above(320, 240);
  v.camera.cx = 40.25;
  v.camera.cy = 200;
  v.camera.fy = 900;
  const Eigen::Vector3d p{0.5, 1, 2};
  const auto picture = render(scene{}.set("p", one_point(p.x(), p.y(), p.z(), red, 1)), v, plain());
  CHECK(count(picture, red) == 1);
  const Eigen::Vector3d seen = v.camera.to_world.inverse() * p;
  const auto x = int(std::lround(1000 * seen.x() / seen.z() + 40.25)),
             y = int(std::lround(900 * seen.y() / seen.z() + 200));
  CHECK(picture(x, y) == red);
  CHECK(y < 120);  // Up in space is up in the picture.
}

TEST_CASE("triangles cover their area, and a pixel on a common edge once") {
  for (const double half : {0.3, 0.305, 0.5}) {
    const auto picture = render(scene{}.set("s", square(half, 0, blue)), from_above(), plain());
    const double edge = 200 * half;
    CHECK(std::abs(count(picture, blue) - edge * edge) <= 2 * edge + 1);
    // A picture of two transparent halves has one colour where both are.
    auto veil = square(half, 0, red);
    veil.opacity = 0.5;
    const auto faint = render(scene{}.set("s", veil), from_above(), plain());
    CHECK(count(faint, {128, 0, 0}) + count(faint, {127, 0, 0}) == count(picture, blue));
  }
}

TEST_CASE("what is nearer hides what is farther, in whatever order") {
  const auto near = one_point(0, 0, 1, red), far = one_point(0, 0, 0, green, 30);
  for (const bool first : {false, true}) {
    scene all;
    all.set("a", first ? near : far).set("b", first ? far : near).set("c", square(0.5, -1, blue));
    const auto picture = render(all, from_above(), plain());
    CHECK(picture(100, 75) == red);
    CHECK(picture(112, 75) == green);
    CHECK(picture(130, 75) == blue);
  }
}

TEST_CASE(
    "a disc across its normal is round from the front, thin from the side, and at its depth") {
  point_batch disc{.points = Eigen::Vector3f::Zero(), .colors = one_color(red)};
  disc.size = {point_size::unit::length, Eigen::VectorXf::Constant(1, 0.8f)};
  disc.along_normals = true;
  const auto area = [&](const Eigen::Vector3f& normal) {
    disc.normals = normal;
    disc.lit = false;
    return count(render(scene{}.set("disc", disc), from_above(), plain()), red);
  };
  // 80 pixels across, from the front and at a slant.
  CHECK(area({0, 0, 1}) == doctest::Approx(std::numbers::pi * 1600).epsilon(0.01));
  CHECK(area({0, 0, -7}) == area({0, 0, 1}));
  CHECK(area({0.8f, 0, 0.6f}) == doctest::Approx(0.6 * std::numbers::pi * 1600).epsilon(0.02));
  // From the side, what is left is the pixel in its middle; without a normal it is round.
  CHECK(area({1, 0, 0}) == 1);
  CHECK(area({0, 0, 0}) == doctest::Approx(std::numbers::pi * 1600).epsilon(0.01));
  CHECK(area(Eigen::Vector3f::Constant(float(not_a_number))) == area({0, 0, 0}));

  disc.normals = Eigen::Vector3f{-1, 0, 1};
  for (const bool parallel : {false, true}) {
    view v = from_above();
    v.orthographic = parallel;
    if (parallel) v.camera.fx = v.camera.fy = 100;
    const auto found = pick(scene{}.set("disc", disc), v, 115, 80);
    REQUIRE(found);
    CHECK(found->place.z() == doctest::Approx(found->place.x()).epsilon(1e-4));
    CHECK(found->place.x() > 0.13);
  }

  // What it hides begins where it is nearer.
  point_batch behind = one_point(0.2, 0, 0.1, green, 1);
  CHECK(count(render(scene{}.set("disc", disc).set("behind", behind), from_above(), plain()),
              green) == 0);
  behind = one_point(-0.2, 0, 0.1, green, 1);
  CHECK(count(render(scene{}.set("disc", disc).set("behind", behind), from_above(), plain()),
              green) == 1);

  disc.normals.resize(3, 0);
  CHECK_THROWS_AS(scene{}.set("disc", disc), invalid_input);
}

TEST_CASE("a cloud with normals is drawn by discs unless it is not wanted") {
  point_cloud<float, 3> cloud{.points = Eigen::Vector3f::Zero(),
                              .normals = Eigen::Vector3f::UnitX()};
  cloud_look look{.color = red, .size = splat_length{0.8}, .lit = false};
  CHECK(count(render(scene{}.set("cloud", cloud, look), from_above(), plain()), red) == 1);
  look.along_normals = false;
  CHECK(count(render(scene{}.set("cloud", cloud, look), from_above(), plain()), red) > 4900);
  cloud.normals.resize(3, 0);
  look.along_normals = true;
  CHECK(count(render(scene{}.set("cloud", cloud, look), from_above(), plain()), red) > 4900);
}

TEST_CASE(
    "within a budget fewer points are drawn, which are larger, so that a surface stays closed") {
  constexpr int side = 240;
  point_batch grid{.colors = one_color(red)};
  grid.points.resize(3, side * side);
  for (int i = 0; i < side * side; ++i)
    grid.points.col(i) << float(i % side - side / 2) / 200, float(i / side - side / 2) / 200, 0;
  grid.size = {point_size::unit::length, Eigen::VectorXf::Constant(1, 0.02f)};
  const auto all = scene{}.set("grid", grid);
  render_options options = plain();
  const auto full = render(all, from_above(), options);
  const int covered = count(full, red);
  CHECK(covered > 14'000);

  options.point_budget = side * side;
  CHECK(differing(render(all, from_above(), options), full) == 0);
  options.point_budget = side * side / 9;
  const auto fewer = render(all, from_above(), options);
  // Only at the border of the grid, where one point may stand for those beyond it.
  CHECK(count(fewer, red) > 0.93 * covered);
  options.threads = 3;
  CHECK(differing(render(all, from_above(), options), fewer) == 0);
  CHECK(pick(all, from_above(), 100, 75, options));

  // What is sized in pixels stays as large, so that each is a dot.
  grid.size = {point_size::unit::pixels, Eigen::VectorXf::Constant(1, 1)};
  options.point_budget = side * side / 100;
  const int dots = count(render(scene{}.set("grid", grid), from_above(), options), red);
  CHECK(dots > 0.9 * side * side / 100);
  CHECK(dots <= side * side / 100);

  options.point_budget = -1;
  CHECK_THROWS_AS((void)render(all, from_above(), options), invalid_input);
}

TEST_CASE("parallel rays show everything at one scale") {
  view v = from_above();
  v.orthographic = true;
  v.camera.fx = v.camera.fy = 100;
  for (const double z : {5.0, -50.0}) {
    const auto picture = render(scene{}.set("s", square(0.3, z, blue)), v, plain());
    CHECK(std::abs(count(picture, blue) - 3600) <= 121);
  }
}

TEST_CASE("lines have their width, and reach from end to end") {
  line_batch line{.colors = one_color(green)};
  line.points.resize(3, 2);
  line.points << -0.5f, 0.5f, 0.2f, 0.2f, 0, 0;
  line.width = 3;
  const auto picture = render(scene{}.set("l", line), from_above(), plain());
  CHECK(count(picture, green) == 3 * 101);
  CHECK(picture(50, 55) == green);
  CHECK(picture(150, 55) == green);
  CHECK(picture(152, 55) == black);
}

TEST_CASE("what is partly behind the eye is cut, and what is behind it not seen") {
  triangle_batch floor{.colors = one_color(blue)};
  floor.points.resize(3, 3);
  floor.points << 0, -4, 4, -1, 1, 1, 30, -10, -10;
  line_batch line{.colors = one_color(red)};
  line.points.resize(3, 2);
  line.points << 0, 0, 0, 0.5f, 30, 0;
  scene all;
  all.set("floor", floor).set("line", line).set("behind", one_point(0, 0, 11, green, 500));
  const auto picture = render(all, from_above(), plain());
  CHECK(count(picture, green) == 0);
  CHECK(count(picture, red) > 10);
  CHECK(count(picture, black) < 201 * 151);
}

TEST_CASE("a picture has the same bits for any number of threads") {
  const scene all = mixed_scene();
  for (const bool blend : {false, true}) {
    render_options options{.width = 320, .height = 240, .blend = blend, .supersampling = 2};
    options.threads = 1;
    const auto one = render(all, fit(all), options);
    for (const int threads : {2, 3, 8}) {
      options.threads = threads;
      CHECK(render(all, fit(all), options) == one);
    }
  }
}

TEST_CASE("splats of any size have the same bits for any vector target and number of threads") {
  // From less than a pixel to a quarter of the picture, also where they leave it.
  point_batch batch{.points = Eigen::Matrix3Xf(3, 400), .normals = Eigen::Matrix3Xf(3, 400)};
  batch.colors.resize(3, 400);
  batch.size.in = point_size::unit::length;
  batch.size.sizes.resize(400);
  random_stream random{3};
  for (index_t i = 0; i < 400; ++i) {
    for (int k = 0; k < 3; ++k) {
      batch.points(k, i) = float(random.uniform(-1.2, 1.2));
      batch.normals(k, i) = float(random.normal());
      batch.colors(k, i) = std::uint8_t(255 * random.uniform());
    }
    batch.size.sizes[i] = float(std::pow(10.0, random.uniform(-2.5, 0)));
  }
  batch.normals.col(7).setZero();
  for (const bool along_normals : {false, true})
    for (const bool blend : {false, true})
      for (const bool orthographic : {false, true}) {
        batch.along_normals = batch.lit = along_normals;
        const scene all = scene{}.set("splats", batch);
        view from = from_above(203, 151);
        from.orthographic = orthographic;
        if (orthographic) from.camera.fx = from.camera.fy = 100;
        render_options options{.blend = blend, .threads = 1};
        const auto one = render(all, from, options);
        for (const vector_target target : test::available_targets()) {
          const test::using_target narrower{target};
          for (const int threads : {1, 2, 8}) {
            options.threads = threads;
            CHECK(render(all, from, options) == one);
          }
        }
      }
}

TEST_CASE("transparent things look the same in any order, and nothing hides behind them") {
  auto a = square(0.5, 1, red), b = square(0.4, 0.5, green);
  a.opacity = 0.5;
  b.opacity = 0.3;
  const auto behind = square(0.6, 0, blue);
  scene one, other;
  one.set("a", a).set("b", b).set("c", behind);
  other.set("c", behind).set("b", b).set("a", a);
  const auto picture = render(one, from_above(), plain());
  CHECK(picture == render(other, from_above(), plain()));
  // Half of the red square over blue, at a place where the green one is not.
  const auto pixel = picture(100, 75 - 52);
  CHECK(std::abs(pixel[0] - 127) <= 1);
  CHECK(std::abs(pixel[2] - 128) <= 1);

  b.opacity = 0;
  CHECK(render(scene{}.set("b", b), from_above(), plain()) ==
        render(scene{}, from_above(), plain()));
  // Opaque things hide what is transparent.
  const auto front = square(0.9, 2, green);
  CHECK(render(scene{}.set("a", a).set("s", front), from_above(), plain()) ==
        render(scene{}.set("s", front), from_above(), plain()));
}

TEST_CASE("large coordinates keep their digits") {
  const Eigen::Vector3d away{1e7, -3e6, 2e6};
  point_cloud<double, 3> near{.points = Eigen::Matrix3Xd(3, 500)};
  random_stream random{3};
  for (auto p : near.points.colwise())
    p << random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1);
  auto far = near, with_origin = near;
  far.points.colwise() += away;
  with_origin.origin = away;
  const cloud_look look{.color = red, .size = splat_length{0.05}};
  view there = from_above();
  const auto expected = render(scene{}.set("p", near, look), there, plain());
  there.camera.to_world.translation() += away;
  CHECK(differing(render(scene{}.set("p", far, look), there, plain()), expected) < 30);
  CHECK(differing(render(scene{}.set("p", with_origin, look), there, plain()), expected) < 30);
  CHECK(count(expected, red) > 1000);
}

TEST_CASE("what is not finite is left out, and of nothing the background is left") {
  point_batch points = one_point(0, 0, 0, red);
  points.points.resize(3, 4);
  points.points << 0, float(not_a_number), 0, 0, 0, 0, std::numeric_limits<float>::infinity(), 0, 0,
      0, 0, float(not_a_number);
  const auto one = render(scene{}.set("p", one_point(0, 0, 0, red)), from_above(), plain());
  CHECK(render(scene{}.set("p", points), from_above(), plain()) == one);

  auto mesh = square(0.5, 0, blue);
  mesh.points(2, 3) = float(not_a_number);
  CHECK(count(render(scene{}.set("m", mesh), from_above(), plain()), blue) > 4000);

  for (const scene& empty : {scene{}, scene{}.set("p", Eigen::Matrix3Xf(3, 0))}) {
    const auto picture = render(empty, fit(empty), plain());
    CHECK(count(picture, black) == 1280 * 720);
  }
  // One point, or the same one many times.
  for (const Eigen::Matrix3Xd& same :
       {Eigen::Matrix3Xd::Constant(3, 1, 7.0), Eigen::Matrix3Xd::Constant(3, 9, -1e6)}) {
    const auto all = scene{}.set("p", same, cloud_look{.color = red, .size = splat_pixels{9}});
    CHECK(render(all, fit(all), plain())(640, 360) == red);
  }
}

TEST_CASE(
    "mixed splats have the colours of those that lie on each other, but not of those behind") {
  auto left = one_point(-0.02, 0, 0, red, 0.5f), right = one_point(0.02, 0, 0.001, green, 0.5f);
  left.size.in = right.size.in = point_size::unit::length;
  auto behind = one_point(0, 0, -3, blue, 3.0f);
  behind.size.in = point_size::unit::length;
  scene all;
  all.set("l", left).set("r", right).set("b", behind);
  auto options = plain();
  options.blend = true;
  const auto middle = render(all, from_above(), options)(100, 75);
  CHECK(middle[0] > 100);
  CHECK(middle[1] > 100);
  CHECK(middle[2] == 0);
  CHECK(render(all, from_above(), plain())(100, 75) == green);
}

TEST_CASE("edges darken what lies behind, and nothing else") {
  scene all;
  all.set("front", square(0.3, 1, red)).set("back", square(0.9, 0, red));
  auto options = plain();
  options.edges = 1;
  const auto picture = render(all, from_above(), options);
  CHECK(picture(100, 75) == red);       // The front.
  CHECK(picture(100, 75 - 60) == red);  // Far from its border.
  const int border = int(300 / 9.0);
  CHECK(picture(100, 75 - border - 2)[0] < 250);
}

TEST_CASE("surfaces that face the eye are brighter than those that do not") {
  point_batch points = one_point(0, 0, 0, {200, 200, 200}, 5);
  points.points.resize(3, 3);
  points.points << -0.5f, 0, 0.5f, 0, 0, 0, 0, 0, 0;
  points.normals.resize(3, 3);
  points.normals << 0, 1, 0, 0, 0, 0, 1, 0, -1;
  const auto picture = render(scene{}.set("p", points), from_above(), plain());
  CHECK(picture(50, 75)[0] > 195);
  CHECK(picture(100, 75)[0] < 85);
  CHECK(picture(150, 75)[0] > 195);  // The other side is the same.
}

TEST_CASE("supersampling makes borders of what they share") {
  auto options = plain();
  options.supersampling = 4;
  const auto picture = render(scene{}.set("s", square(0.303, 0, blue)), from_above(), options);
  CHECK(picture.width() == 201);
  double sum = 0;
  int between = 0;
  for (const auto& pixel : picture.pixels()) {
    sum += pixel[2] / 255.0;
    between += pixel[2] > 0 && pixel[2] < 255;
  }
  CHECK(sum == doctest::Approx(60.6 * 60.6).epsilon(0.01));
  CHECK(between > 100);
}

TEST_CASE("sizes in pixels are those of the picture, however it is sampled") {
  line_batch line{.colors = one_color(green)};
  line.points.resize(3, 2);
  line.points << -0.5f, 0.5f, 0.4f, 0.4f, 0, 0;
  line.width = 3;
  const auto all = scene{}.set("p", one_point(0, 0, 0, red, 20)).set("l", line);
  const auto brightness = [&](int fine, int channel) {
    auto options = plain();
    options.supersampling = fine;
    const auto picture = render(all, from_above(), options);
    double sum = 0;
    for (const auto& pixel : picture.pixels()) sum += pixel[channel];
    return sum / 255;
  };
  for (const int fine : {2, 4}) {
    CHECK(brightness(fine, 0) == doctest::Approx(brightness(1, 0)).epsilon(0.05));
    CHECK(brightness(fine, 1) == doctest::Approx(brightness(1, 1)).epsilon(0.05));
  }
}

TEST_CASE("slopes are not edges") {
  auto slope = square(0.5, 0, red);
  slope.points.row(2) << -0.4f, 0.4f, 0.4f, -0.4f;
  auto options = plain();
  const auto without = render(scene{}.set("s", slope), from_above(), options);
  options.edges = 1;
  const auto with = render(scene{}.set("s", slope), from_above(), options);
  for (int y = 50; y < 100; ++y)
    for (int x = 75; x < 125; ++x) CHECK(std::abs(with(x, y)[0] - without(x, y)[0]) <= 1);
}

TEST_CASE("numbers beyond all measure draw something or nothing, and never fail") {
  constexpr float most = std::numeric_limits<float>::max();
  point_batch points = one_point(0, 0, 0, red, 9);
  points.points.resize(3, 3);
  points.points << 0, most, 0, 0, most, 0, most, most, -most;
  points.normals = Eigen::Matrix3Xf::Constant(3, 3, most);
  line_batch line{.colors = one_color(green)};
  line.points.resize(3, 4);
  line.points << 0, 0, -most, most, 0, 0, 0, 0, -most, 9, 1, 1;
  auto mesh = square(0.5, 0, blue);
  mesh.points(2, 0) = -most;
  mesh.points(0, 1) = most;
  scene all;
  all.set("points", points).set("line", line).set("mesh", mesh);
  all.set("text", label{std::string(3000, 'm'), {0, 0, 0}, red, 1000});
  for (const bool orthographic : {false, true}) {
    view v = from_above();
    v.orthographic = orthographic;
    auto options = plain();
    options.edges = 1;
    options.blend = true;
    CHECK(render(all, v, options).width() == 201);
    (void)fit(all);
    CHECK(render(all, fit(all, {.width = 64, .height = 48}), options).width() == 64);
  }
}

TEST_CASE("a picture of another size shows what the camera sees, and no view is stretched") {
  auto options = plain();
  options.width = 402;
  options.height = 602;  // Higher than the camera's picture.
  const auto picture = render(scene{}.set("s", square(0.3, 0, blue)), from_above(), options);
  CHECK(std::abs(count(picture, blue) - 4 * 3600) < 300);
  CHECK(picture(200, 300) == blue);
  CHECK(picture(200, 300 - 58) == blue);
  CHECK(picture(200, 300 - 63) == black);
}

TEST_CASE("texts and bars of colours are drawn over the picture, unless they are not wanted") {
  const scene all = mixed_scene();
  render_options with{.threads = 1}, without{.labels = false, .legends = false, .threads = 1};
  const view v = fit(all);
  const auto a = render(all, v, with), b = render(all, v, without);
  int at_the_right = 0, elsewhere = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x)
      if (a(x, y) != b(x, y)) ++(x > 1100 ? at_the_right : elsewhere);
  CHECK(at_the_right > 3000);
  CHECK(elsewhere > 50);
  without.labels = true;
  CHECK(differing(render(all, v, without), b) == elsewhere);
}

TEST_CASE("what is picked is what is seen") {
  scene all;
  point_batch points = one_point(0, 0, 0, red, 9);
  points.points.resize(3, 2);
  points.points << 0.5f, -0.5f, 0, 0.25f, 1, 1;
  all.set("mesh", square(0.3, 2, blue)).set("points", points);
  const view v = from_above();
  const Eigen::Vector3d seen = v.camera.to_world.inverse() * Eigen::Vector3d{-0.5, 0.25, 1};
  const auto found =
      pick(all, v, 1000 * seen.x() / seen.z() + 100, 1000 * seen.y() / seen.z() + 75);
  REQUIRE(found);
  CHECK(found->layer == "points");
  CHECK(found->kind == picked_kind::point);
  CHECK(found->index == 1);
  CHECK((found->place - Eigen::Vector3d{-0.5, 0.25, 1}).norm() < 0.01);
  const auto mesh = pick(all, v, 110, 70);
  REQUIRE(mesh);
  CHECK(mesh->layer == "mesh");
  CHECK(mesh->kind == picked_kind::triangle);
  CHECK(mesh->place.z() == doctest::Approx(2));
  CHECK_FALSE(pick(all, v, 3, 3));
  CHECK_FALSE(pick(all, v, -1, 3));
  CHECK_FALSE(pick(all.hide("mesh"), v, 110, 70));
  CHECK_THROWS_AS((void)pick(all, v, not_a_number, 3), invalid_input);
}

TEST_CASE("options of pictures that make no sense are refused") {
  const scene all = mixed_scene();
  const view v = from_above();
  const auto refused = [&](const render_options& options) {
    CHECK_THROWS_AS((void)render(all, v, options), invalid_input);
  };
  refused({.width = 100});
  refused({.width = -1, .height = -1});
  refused({.width = 40'000, .height = 1});
  refused({.width = 30'000, .height = 30'000});
  refused({.width = 8000, .height = 8000, .supersampling = 2});
  refused({.edges = -1});
  refused({.edges = not_a_number});
  refused({.supersampling = 0});
  refused({.supersampling = 9});
  refused({.threads = -1});
  const auto refused_view = [&](auto&& spoil) {
    view bad = v;
    spoil(bad);
    CHECK_THROWS_AS((void)render(all, bad), invalid_input);
  };
  refused_view([](view& b) { b.camera.fx = 0; });
  refused_view([](view& b) { b.camera.cx = not_a_number; });
  refused_view([](view& b) { b.camera.width = 0; });
  refused_view([](view& b) { b.distance = 0; });
  refused_view([](view& b) { b.camera.to_world.linear() *= 2; });
  refused_view([](view& b) { b.camera.to_world.linear().col(0) *= -1; });
  refused_view([](view& b) { b.camera.to_world.translation().x() = not_a_number; });

  double done = 0;
  (void)render(all, v, {.monitor = {[&](double share) { done = share; }, {}}});
  CHECK(done == 1);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)render(all, v, {.monitor = {{}, stop.get_token()}}), cancelled);
}

TEST_CASE("of all of a scene there is a picture in one call, and a step of a pipeline") {
  const test::temporary_folder folder;
  const point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Random(3, 50)};
  const auto all = scene{}.set("points", cloud);
  const auto expected =
      render(all, fit(all, {.width = 200, .height = 100}), {.width = 200, .height = 100});
  CHECK(render(all, {.width = 200, .height = 100}) == expected);
  CHECK(render(all) == render(all, fit(all)));
  write_picture(cloud, folder / "function.png", {}, {.width = 200, .height = 100});
  CHECK(read_color_image(folder / "function.png") == expected);
  const auto same = cloud | write_picture(folder / "step.png", {}, {.width = 200, .height = 100}) |
                    write_html(folder / "step.html");
  CHECK(same.points == cloud.points);
  CHECK(read_color_image(folder / "step.png") == expected);
  CHECK(std::filesystem::exists(folder / "step.html"));
  CHECK_THROWS_AS((void)write_picture("step.jpg"), invalid_input);
}

TEST_CASE("bars that say the same are drawn once, and texts can be read on any background") {
  const point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Random(3, 50)};
  const cloud_look look{.color = by_coordinate{2, turbo, -1.0, 1.0}, .size = splat_pixels{1}};
  const auto one = scene{}.set("a", cloud, look);
  auto two = one;
  two.set("b", cloud, look);
  CHECK(render(two, fit(one)) == render(one, fit(one)));

  const auto text = scene{}.set("text", label{"here", {0, 0, 0}});
  const auto darkest = [&](const rgb& background) {
    int least = 255, most = 0;
    const auto picture = render(text, {.width = 200, .height = 100, .background = background});
    for (const auto& pixel : picture.pixels()) {
      least = std::min<int>(least, pixel[1]);
      most = std::max<int>(most, pixel[1]);
    }
    return most - least;
  };
  CHECK(darkest({255, 255, 255}) > 180);
  CHECK(darkest({0, 0, 0}) > 180);
}

TEST_CASE("of many bars as many are drawn as can be read") {
  const auto with = [](int legends) {
    canvas on;
    scene all;
    for (int i = 0; i < legends; ++i) {
      struct bar {
        int number;
        void draw(canvas& to) const {
          to.add(color_legend{"bar " + std::to_string(number), {red, blue}, 0, 1});
        }
      };
      all.set(std::to_string(i), bar{i});
    }
    return count(render(all, {.width = 320, .height = 240}), red);
  };
  CHECK(with(1) > 0);
  CHECK(with(30) > 0);
  canvas on;
  CHECK_THROWS_AS(
      on.add(color_legend{"endless", {red}, 0, std::numeric_limits<double>::infinity()}),
      invalid_input);
}
