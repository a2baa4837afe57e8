// SPDX-License-Identifier: MIT
//
// What scenes hold, what can be drawn, and from where it is seen.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

import cilantro;
import cilantro.visualization;

using namespace cilantro;

namespace elsewhere {

/// A user's own things: one says itself by a member, the other by a function beside it.
struct cross {
  double size;
  void draw(canvas& on) const {
    line_batch lines;
    lines.points.resize(3, 4);
    const auto s = float(size);
    lines.points << -s, s, 0, 0, 0, 0, -s, s, 0, 0, 0, 0;
    on.add(lines);
    on.add(label{"cross", {0, 0, size}});
  }
};
struct dot {
  Eigen::Vector3d at;
};
void draw(const dot& one, canvas& on) {
  on.add(point_batch{.points = Eigen::Vector3f::Zero(), .origin = one.at});
}
struct dot_look {
  rgb color;
};
void draw(const dot& one, canvas& on, const dot_look& look) {
  on.add(point_batch{
      .points = Eigen::Vector3f::Zero(), .origin = one.at, .colors = one_color(look.color)});
}
struct nothing_to_draw {};
struct drawn_on_a_copy {
  void draw(canvas) const {}
};

}  // namespace elsewhere

static_assert(Renderable<elsewhere::cross> && Renderable<elsewhere::dot> &&
              !Renderable<elsewhere::nothing_to_draw>);
static_assert(!Renderable<elsewhere::drawn_on_a_copy>);
static_assert(RenderableWith<elsewhere::dot, elsewhere::dot_look> &&
              !RenderableWith<elsewhere::cross, elsewhere::dot_look>);
static_assert(Renderable<point_cloud<float, 3>> && Renderable<Eigen::Matrix2Xd> &&
              Renderable<std::vector<Eigen::Vector3f>> && Renderable<triangle_batch> &&
              RenderableWith<point_cloud<double, 2>, cloud_look>);

static_assert(IndexPairs<std::vector<std::pair<int, int>>> && IndexPairs<correspondences<float>> &&
              !IndexPairs<std::vector<std::pair<float, float>>>);

TEST_CASE("a scene has layers in their order, which are replaced, hidden and taken away by name") {
  scene all;
  all.set("cross", elsewhere::cross{2}).set("dot", elsewhere::dot{{5, 0, 0}});
  const scene before = all;
  REQUIRE(all.layers().size() == 2);
  CHECK(all.layers()[0].name == "cross");
  CHECK(all.layers()[0].content->lines().size() == 1);
  CHECK(all.layers()[0].content->labels().size() == 1);
  CHECK(all.bounds().max().x() == 5);
  CHECK(all.bounds().max().z() == 2);

  all.hide("dot");
  CHECK(all.bounds().max().x() == 2);
  CHECK(all.hide("dot", false).bounds().max().x() == 5);
  all.set("cross", elsewhere::dot{{0, 0, 9}}, elsewhere::dot_look{{1, 2, 3}});
  CHECK(all.layers().size() == 2);
  CHECK(all.layers()[0].content->points()[0].colors(2, 0) == 3);
  all.remove("dot");
  CHECK(all.layers().size() == 1);
  // A copy is as it was.
  CHECK(before.layers().size() == 2);
  CHECK(before.layers()[0].content->lines().size() == 1);

  CHECK_THROWS_WITH_AS(all.remove("crosses"), "scene: there is no layer \"crosses\", but cross",
                       invalid_input);
  CHECK_THROWS_AS(scene{}.hide("x"), invalid_input);
}

TEST_CASE("batches that do not fit together are refused") {
  canvas on;
  const Eigen::Matrix3Xf three = Eigen::Matrix3Xf::Random(3, 3);
  const auto refused = [&](auto batch) { CHECK_THROWS_AS(on.add(batch), invalid_input); };
  refused(point_batch{.points = three, .colors = color_matrix::Zero(3, 2)});
  refused(point_batch{.points = three, .normals = three.leftCols(2)});
  refused(point_batch{.points = three, .size = {.sizes = Eigen::VectorXf::Ones(2)}});
  refused(point_batch{.points = three, .opacity = 1.5});
  refused(point_batch{.points = three, .size = {.sizes = Eigen::VectorXf::Constant(1, -1)}});
  refused(point_batch{.points = three, .size = {.sizes = Eigen::VectorXf::Constant(1, NAN)}});
  refused(point_batch{.points = three, .origin = Eigen::Vector3d::Constant(std::nan(""))});
  refused(line_batch{.points = three});
  refused(line_batch{.points = three, .segments = Eigen::Matrix2Xi::Constant(2, 1, 3)});
  refused(line_batch{.points = three.leftCols(2), .width = 0});
  refused(triangle_batch{.points = three, .triangles = Eigen::Matrix3Xi::Constant(3, 1, -1)});
  refused(triangle_batch{.points = three, .normals = three.leftCols(1)});
  refused(label{.text = "x", .height = 0});
  refused(color_legend{"none", {}});
  CHECK(on.bounds().isEmpty());
}

TEST_CASE("clouds have the colours that are asked for") {
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Random(3, 4)};
  cloud.colors = Eigen::Matrix3Xf::Constant(3, 4, 0.5f);
  cloud.normals = Eigen::Vector3f::UnitZ().replicate(1, 4);
  cloud.set_attribute("value", {0.0, 1.0, 2.0, std::nan("")});
  cloud.set_attribute("cluster", {0, 1, 1, -1});
  const auto colors = [&](const point_coloring& coloring) -> Eigen::Matrix3Xi {
    canvas on;
    draw(cloud, on, {.color = coloring});
    return on.points()[0].colors.cast<int>();
  };
  const auto is = [](const auto& column, const rgb& color) {
    return column[0] == color[0] && column[1] == color[1] && column[2] == color[2];
  };
  CHECK(is(colors(own_colors{}).col(3), {128, 128, 128}));
  CHECK(is(colors(rgb{1, 2, 3}).col(0), {1, 2, 3}));
  const color_map map{viridis};
  const auto by_value = colors(by_attribute{"value", map});
  for (int i = 0; i < 3; ++i) CHECK(is(by_value.col(i), map(i / 2.0)));
  CHECK(is(by_value.col(3), map.unknown));
  CHECK(is(colors(by_attribute{"value", map, 0.0, 4.0}).col(2), map(0.5)));
  const Eigen::Matrix3Xf labels = 255 * label_colors(std::array{0, 1, 1, -1});
  CHECK((colors(by_label{"cluster"}).cast<float>() - labels).cwiseAbs().maxCoeff() <= 0.5f);
  CHECK(is(colors(by_normal{}).col(2), {128, 128, 255}));
  const auto by_height = colors(by_coordinate{1, map});
  index_t highest = 0;
  cloud.points.row(1).maxCoeff(&highest);
  CHECK(is(by_height.col(highest), map(1)));

  canvas on;
  draw(cloud, on, {.color = by_attribute{"value"}});
  REQUIRE(on.legends().size() == 1);
  CHECK(on.legends()[0].title == "value");
  CHECK(on.legends()[0].high == 2);
  CHECK_THROWS_WITH_AS((void)colors(by_attribute{"valeu"}),
                       "draw: the cloud has no attribute \"valeu\", but value, cluster",
                       invalid_input);
  CHECK_THROWS_AS((void)colors(by_label{"value"}), invalid_input);
  CHECK_THROWS_AS((void)colors(by_attribute{"value", {}, 2.0, 1.0}), invalid_input);
  CHECK_THROWS_AS((void)colors(by_coordinate{3}), invalid_input);
  CHECK_THROWS_AS(draw(Eigen::Matrix2Xd::Random(2, 5).eval(), on, {.color = by_coordinate{2}}),
                  invalid_input);
  // An end above all values leaves them at the low one.
  CHECK(is(colors(by_attribute{"value", map, 7.0}).col(0), map(0.5)));
  cloud.normals.resize(3, 0);
  CHECK_THROWS_AS((void)colors(by_normal{}), invalid_input);
}

TEST_CASE("splats are as large as the points are apart, or as they are told") {
  Eigen::Matrix3Xd grid(3, 400);
  for (int i = 0; i < 400; ++i) grid.col(i) << 0.1 * (i % 20), 0.1 * (i / 20), 3;
  const auto size = [&](const splat_size& how) {
    canvas on;
    draw(grid, on, {.size = how});
    return on.points()[0].size;
  };
  const auto spacing = size(local_spacing{1.5});
  REQUIRE(spacing.sizes.size() == 400);
  CHECK(spacing.in == point_size::unit::length);
  CHECK(spacing.sizes[210] == doctest::Approx(1.5 * std::sqrt(0.02)).epsilon(1e-4));
  // At the border, too.
  CHECK(spacing.sizes.maxCoeff() < 1.5f * spacing.sizes[210]);
  // Nine points at each place are as large as what is usual.
  Eigen::Matrix3Xd nine(3, 41);
  nine << Eigen::Vector3d{9, 9, 9}.replicate(1, 9), grid.leftCols(32);
  canvas on;
  draw(nine, on);
  CHECK(on.points()[0].size.sizes[0] > 0.1);
  CHECK(size(splat_length{0.2}).sizes[0] == 0.2f);
  CHECK(size(splat_pixels{4}).in == point_size::unit::pixels);
  CHECK_THROWS_AS((void)splat_length{-1}, invalid_input);
}

TEST_CASE("points of one, two and three dimensions are drawn, of more not") {
  canvas on;
  draw(Eigen::Matrix2Xd::Random(2, 5).eval(), on);
  CHECK(on.points()[0].points.row(2).isZero(0));
  draw(Eigen::MatrixXf::Random(1, 5).eval(), on);
  CHECK_THROWS_AS(draw(Eigen::MatrixXf::Random(4, 5).eval(), on), invalid_input);
}

TEST_CASE("lines and meshes have the corners that they should") {
  CHECK(box_lines(Eigen::AlignedBox3d{Eigen::Vector3d{0, 0, 0}, Eigen::Vector3d{1, 2, 3}})
            .segments.cols() == 12);
  CHECK_THROWS_AS((void)box_lines(Eigen::AlignedBox3d{}), invalid_input);
  CHECK(grid_lines({.cells = 4}).points.cols() == 20);
  CHECK_THROWS_AS((void)grid_lines({.cells = 0}), invalid_input);
  const auto axes = frame_lines(Eigen::Isometry3d{Eigen::Translation3d{1, 2, 3}}, 2);
  CHECK(axes.origin.y() == 2);
  CHECK(axes.points.col(5).z() == 2);

  const pinhole_camera<double> camera{640, 480, 500, 500, 319.5, 239.5};
  const auto frustum = frustum_lines(camera, 2);
  CHECK(frustum.points.col(1).isApprox(Eigen::Vector3f{-1.28f, -0.96f, 2}));
  CHECK(frustum.segments.cols() == 8);

  point_cloud<double, 3> cloud{.points = Eigen::Matrix3Xd::Random(3, 4)};
  CHECK_THROWS_AS((void)normal_lines(cloud, {}), invalid_input);
  cloud.normals = Eigen::Vector3d::UnitX().replicate(1, 4);
  cloud.normals.col(1).setZero();
  const auto normals = normal_lines(cloud, {.length = 0.5});
  REQUIRE(normals.points.cols() == 6);
  CHECK((normals.points.col(1) - normals.points.col(0)).isApprox(Eigen::Vector3f{0.5f, 0, 0}));
  CHECK(normal_lines(cloud, {.every = 3}).points.cols() == 4);

  const std::vector<std::pair<int, int>> pairs{{0, 3}, {2, 1}};
  const auto lines = pair_lines(cloud, cloud, pairs);
  REQUIRE(lines.points.cols() == 4);
  CHECK((lines.points.col(3).cast<double>() + lines.origin).isApprox(cloud.points.col(1), 1e-6));
  CHECK_THROWS_AS((void)pair_lines(cloud, cloud, std::vector<std::pair<int, int>>{{0, 4}}),
                  invalid_input);

  Eigen::Matrix3Xi triangles(3, 2);
  triangles << 0, 1, 1, 2, 2, 3;
  const auto mesh = triangle_mesh(cloud, triangles);
  CHECK(mesh.normals.cols() == 4);
  CHECK(wireframe(mesh).segments.cols() == 5);
  canvas on;
  on.add(wireframe(triangle_mesh(cloud, Eigen::Matrix3Xi(3, 0))));
  CHECK(on.lines()[0].segments.cols() == 0);
  CHECK_THROWS_AS((void)triangle_mesh(cloud, Eigen::MatrixXi::Zero(4, 3)), invalid_input);
  const auto hull = convex_hull(cloud);
  CHECK(triangle_mesh(hull.vertices(), hull.simplices()).triangles.cols() == 4);
}

TEST_CASE("a fitted view shows everything, and fills the picture") {
  random_stream random{5};
  Eigen::Matrix3Xd points(3, 300);
  for (auto p : points.colwise())
    p << random.uniform(90, 110), random.uniform(-2, 2), random.uniform(0, 5);
  const auto all = scene{}.set("p", points, cloud_look{.size = splat_pixels{1}});
  for (const bool orthographic : {false, true})
    for (const Eigen::Vector3d& direction :
         {Eigen::Vector3d{1, 1, -1}, Eigen::Vector3d{-1, 0, 0}, Eigen::Vector3d{0.1, 1, 0.3}}) {
      const view v = fit(all, direction, Eigen::Vector3d::UnitZ(),
                         {.width = 400, .height = 300, .orthographic = orthographic});
      double farthest = 0;
      for (const auto p : points.colwise()) {
        const Eigen::Vector3d q = v.camera.to_world.inverse() * Eigen::Vector3d{p};
        REQUIRE(q.z() > 0);
        const double scale = v.orthographic ? 1 : 1 / q.z();
        const double x = v.camera.fx * q.x() * scale / 200, y = v.camera.fy * q.y() * scale / 150;
        farthest = std::max({farthest, std::abs(x), std::abs(y)});
      }
      CHECK(farthest < 1);
      CHECK(farthest > 0.9);
    }
  // What is flat is seen from above.
  const auto flat = scene{}.set("p", Eigen::Matrix2Xd::Random(2, 50).eval());
  CHECK(fit(flat).ahead().isApprox(-Eigen::Vector3d::UnitZ()));
  CHECK_THROWS_AS((void)fit(flat, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()),
                  invalid_input);
  CHECK_THROWS_AS((void)fit(flat, {.width = 0}), invalid_input);
  CHECK_THROWS_AS((void)fit(flat, {.field_of_view = 4}), invalid_input);
}

TEST_CASE("views turn around what they look at, move with the picture, and come nearer") {
  const Eigen::Vector3d at{1, 2, 3};
  const view v = look_at({1, -8, 3}, at);
  CHECK(v.distance == doctest::Approx(10));
  CHECK(v.ahead().isApprox(Eigen::Vector3d::UnitY()));
  // Upwards in space is upwards in the picture, whose y goes down.
  CHECK(v.camera.to_world.linear().col(1).isApprox(-Eigen::Vector3d::UnitZ()));

  const auto looks_at = [](const view& w) -> Eigen::Vector3d {
    return w.eye() + w.distance * w.ahead();
  };
  const view right = orbit(v, {.right = std::numbers::pi / 2});
  CHECK(right.eye().isApprox(Eigen::Vector3d{11, 2, 3}));
  CHECK(looks_at(right).isApprox(at));
  const view above = orbit(v, {.up = 1});
  CHECK(above.eye().z() == doctest::Approx(3 + 10 * std::sin(1)));
  CHECK(orbit(v, {.up = 9}).eye().z() < 13);
  const auto around = turntable(v, 8);
  REQUIRE(around.size() == 8);
  CHECK(around[4].eye().isApprox(Eigen::Vector3d{1, 12, 3}));
  CHECK_THROWS_AS((void)turntable(v, 0), invalid_input);

  const auto seen = [](const view& w, const Eigen::Vector3d& p) -> Eigen::Vector2d {
    const Eigen::Vector3d q = w.camera.to_world.inverse() * p;
    return {w.camera.fx * q.x() / q.z(), w.camera.fy * q.y() / q.z()};
  };
  const Eigen::Vector2d moved = seen(pan(v, {.right = 30, .down = -7}), at) - seen(v, at);
  CHECK(moved.isApprox(Eigen::Vector2d{30, -7}));
  const view near = zoom(v, 4);
  CHECK(near.distance == doctest::Approx(2.5));
  CHECK(looks_at(near).isApprox(at));

  CHECK_THROWS_AS((void)look_at(at, at), invalid_input);
  CHECK_THROWS_AS((void)look_at({1, 2, 9}, at), invalid_input);
  CHECK_THROWS_AS((void)zoom(v, 0), invalid_input);
  CHECK_THROWS_AS((void)orbit(v, {.right = std::nan("")}), invalid_input);
  CHECK_THROWS_AS((void)pan(v, {.down = std::nan("")}), invalid_input);
  CHECK(turntable(view{}, 3).size() == 3);
  view no_up;
  no_up.up.setZero();
  CHECK_THROWS_AS((void)orbit(no_up, {}), invalid_input);
  CHECK_THROWS_AS(write_picture(scene{}, "picture.jpg"), invalid_input);
}

TEST_CASE("points in a plane are dots, and so is what has no neighbours") {
  const auto drawn = [](const auto& points, const cloud_look& look = {}) {
    canvas on;
    draw(points, on, look);
    return on.points()[0].size;
  };
  CHECK(drawn(Eigen::Matrix2Xf{Eigen::Matrix2Xf::Random(2, 20)}).in == point_size::unit::pixels);
  CHECK(drawn(Eigen::Matrix2Xf{Eigen::Matrix2Xf::Random(2, 20)}, {.size = local_spacing{}}).in ==
        point_size::unit::length);
  CHECK(drawn(Eigen::Matrix3Xf{Eigen::Matrix3Xf::Random(3, 20)}).in == point_size::unit::length);
  for (const int n : {1, 2, 12}) {
    const auto size = drawn(Eigen::Matrix3Xf{Eigen::Matrix3Xf::Constant(3, n, 2)});
    CHECK(size.in == point_size::unit::pixels);
    CHECK(size.sizes[0] == 5);
  }
}

TEST_CASE("clouds with colours of their own are not lit unless it is wanted") {
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Random(3, 9),
                              .normals = Eigen::Matrix3Xf::Random(3, 9)};
  const auto is_lit = [&](const cloud_look& look) {
    canvas on;
    draw(cloud, on, look);
    CHECK(on.points()[0].along_normals);
    return on.points()[0].lit;
  };
  CHECK(is_lit({}));
  CHECK_FALSE(is_lit({.lit = false}));
  cloud.colors = Eigen::Matrix3Xf::Random(3, 9).cwiseAbs();
  CHECK_FALSE(is_lit({}));
  CHECK(is_lit({.lit = true}));
  CHECK(is_lit({.color = rgb{1, 2, 3}}));
  CHECK(is_lit({.color = by_coordinate{0}}));
}

namespace {

/// A hull of a user's own.
struct tetrahedron {
  std::vector<Eigen::Vector3d> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  int dimensions = 3;
  bool is_bounded() const { return true; }
  int affine_dimension() const { return dimensions; }
  const std::vector<Eigen::Vector3d>& vertices() const { return corners; }
  Eigen::MatrixXi simplices() const {
    return Eigen::Matrix<int, 3, 4>{{0, 0, 0, 1}, {2, 1, 3, 2}, {1, 3, 2, 3}};
  }
};

}  // namespace

TEST_CASE("a hull of one's own is drawn like a polytope, and one of the plane is none") {
  const tetrahedron hull;
  const scene all = scene{}.set("own", hull);
  CHECK(all.layers()[0].content->triangles()[0].triangles.cols() == 4);
  CHECK(all.bounds().max() == Eigen::Vector3d{1, 1, 1});
  CHECK_THROWS_AS((void)triangle_mesh(tetrahedron{.dimensions = 2}), invalid_input);
  static_assert(TriangulatedHull<convex_polytope<3>>);
  static_assert(!TriangulatedHull<convex_polytope<2>> && !TriangulatedHull<std::vector<double>>);
}

TEST_CASE("hulls and boxes are drawn as they are") {
  const convex_polytope<3> hull{box{{0, 0, 0}, {1, 2, 3}}};
  const scene all = scene{}.set("hull", hull).set("box", box_lines(box{{0, 0, 0}, {1, 2, 3}}));
  CHECK(all.layers()[0].content->triangles()[0].triangles.cols() == 12);
  CHECK(all.bounds().max() == Eigen::Vector3d{1, 2, 3});
  CHECK(all.layers()[1].content->lines()[0].segments.cols() == 12);
  const auto half =
      intersect_half_spaces(Eigen::Matrix3Xd{Eigen::Vector3d{0, 0, 1}}, std::vector{0.0});
  CHECK_THROWS_AS(scene{}.set("half", half), invalid_input);
  CHECK_THROWS_AS(scene{}.set("none", convex_polytope<3>{}), invalid_input);
  CHECK_THROWS_AS((void)box_lines(box{{0, 0}, {1, 1}}), invalid_input);
}

TEST_CASE("colours and sizes that are not as many are counted") {
  canvas on;
  CHECK_THROWS_WITH_AS(on.add(point_batch{.points = Eigen::Matrix3Xf::Zero(3, 10),
                                          .colors = color_matrix::Zero(3, 7)}),
                       doctest::Contains("7 colours for 10 points"), invalid_input);
}
