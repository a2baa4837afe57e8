// SPDX-License-Identifier: MIT
//
// What OpenGL draws, against what `render` draws. It is drawn by the shaders of web pages, too.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

import window_support;
import cilantro.window;

using namespace cilantro;

namespace {

/// How alike two pictures are, in decibels.
double likeness(const image<rgb>& a, const image<rgb>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels().size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const double difference = double(a.pixels()[i][k]) - double(b.pixels()[i][k]);
      sum += difference * difference;
    }
  const double mean = sum / (3 * double(a.pixels().size()));
  return mean > 0 ? 10 * std::log10(255 * 255 / mean) : 1000;
}

/// A bumpy sphere of points with colours and normals.
point_cloud<float, 3> planet(int points = 20'000) {
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf(3, points),
                              .normals = Eigen::Matrix3Xf(3, points),
                              .colors = Eigen::Matrix3Xf(3, points)};
  for (int i = 0; i < points; ++i) {
    const double z = 1 - 2 * (i + 0.5) / points, angle = 2.399963 * i;
    const Eigen::Vector3d normal{std::sqrt(1 - z * z) * std::cos(angle),
                                 std::sqrt(1 - z * z) * std::sin(angle), z};
    cloud.normals.col(i) = normal.cast<float>();
    cloud.points.col(i) = ((1 + 0.05 * std::sin(9 * z)) * normal).cast<float>();
    cloud.colors.col(i) << float(0.5 + 0.5 * z), float(0.5 + 0.5 * normal.x()), 0.4f;
  }
  return cloud;
}
triangle_batch sheet(const rgb& color, double opacity) {
  triangle_batch mesh{.colors = one_color(color), .opacity = opacity};
  mesh.points.resize(3, 4);
  mesh.points << -2, 2, 2, -2, -2, -2, 2, 2, -0.5f, 0, 0.5f, 0;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  return mesh;
}

/// How alike what a window draws by OpenGL becomes to what `render` draws; 35 dB are enough.
double likeness_on_screen(const scene& all, const view& from, const render_options& drawing) {
  window w{all,
           {.title = "card",
            .width = from.camera.width,
            .height = from.camera.height,
            .drawing = drawing,
            .drawn_by = renderer::opengl}};
  CHECK(w.drawn_by() == renderer::opengl);
  w.look(from);
  const auto expected = render(w.current(), w.seen(), drawing);
  double best = 0;
  eventually(
      [&] {
        return (best = std::max(best, likeness(on_screen(0, 0, expected.width(), expected.height()),
                                               expected))) >= 35;
      },
      w);
  return best;
}

}  // namespace

TEST_CASE("what a graphics card draws is alike to what render draws") {
  const auto round = planet();
  auto colored = sheet({200, 60, 60}, 1);
  colored.colors = color_matrix(3, 4);
  colored.colors << 255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255;
  auto photo = sheet({}, 1);
  image<rgb> checks(64, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      checks(x, y) = (x / 8 + y / 8) % 2 == 0 ? rgb{230, 230, 230} : rgb{40, 80, 160};
  photo.texture = std::make_shared<const image<rgb>>(checks);
  photo.texture_places.resize(2, 4);
  photo.texture_places << 0, 63, 63, 0, 63, 63, 0, 0;
  photo.lit = false;
  const auto cloud = [&](const cloud_look& look) { return scene{}.set("planet", round, look); };
  const render_options plain{.blend = false, .edges = 0, .labels = false, .legends = false};

  struct shown {
    std::string what;
    scene all;
    render_options drawing;
    bool parallel = false;
  };
  const std::vector<shown> all{
      {"discs", cloud({}), {}},
      {"round", cloud({.along_normals = false}), {}},
      {"round alone", cloud({.lit = false, .along_normals = false}), plain},
      {"discs alone", cloud({.size = splat_length{0.1}}), {.blend = false, .supersampling = 2}},
      {"pixels",
       cloud({.size = splat_pixels{5}, .along_normals = false}),
       {.background = {255, 255, 255}}},
      {"numbers", cloud({.color = by_coordinate{2}}), {}},
      {"parallel rays", cloud({}), {}, true},
      {"mesh", scene{}.set("mesh", colored).set("edges", wireframe(colored)), {}},
      {"photo",
       scene{}
           .set("photo", photo)
           .set("box", box_lines({Eigen::Vector3d{-2, -2, -1}, Eigen::Vector3d{2, 2, 1}})),
       {}},
      {"veils",
       cloud({.opacity = 0.02})
           .set("one", sheet({200, 60, 60}, 0.5))
           .set("other", sheet({60, 200, 60}, 0.3)),
       {}},
      {"text",
       cloud({})
           .set("text", label{"planet", {1, 0, 1}})
           .set("frame", frame_lines(Eigen::Isometry3d::Identity(), 2)),
       {}},
  };
  for (const auto& [what, scene, drawing, parallel] : all) {
    CAPTURE(what);
    const view from = fit(scene, {0.5, 1, -0.6}, {0, 0, 1},
                          {.width = 480, .height = 360, .orthographic = parallel});
    const double best = likeness_on_screen(scene, from, drawing);
    CHECK(best >= 35);
    MESSAGE(what << ": " << best << " dB");
  }
}

TEST_CASE("a graphics card draws without a display, scenes that change and several sizes") {
  std::optional<card_renderer> card;
  try {
    card.emplace();
  } catch (const window_error& error) {
    MESSAGE("skipped: " << std::string{error.what()});
    return;
  }
  CHECK_FALSE(card->name().empty());
  auto all = scene{}.set("planet", planet()).set("sheet", sheet({60, 200, 60}, 0.4));
  const view from = fit(all);
  for (const render_options& options :
       {render_options{.width = 320, .height = 240},
        render_options{.width = 500, .height = 200, .supersampling = 2},
        render_options{.blend = false, .edges = 0}}) {
    CHECK(likeness(card->render(all, from, options), render(all, from, options)) >= 35);
    card_renderer moved = std::move(*card);
    *card = std::move(moved);
  }
  all.set("planet", planet(500)).hide("sheet");
  CHECK(likeness(card->render(all, from), render(all, from)) >= 35);
  card_renderer other;
  CHECK(likeness(other.render(scene{}, from), render(scene{}, from)) >= 35);
  CHECK(likeness(card->render(all, from), render(all, from)) >= 35);

  // Fewer points, which are larger.
  const auto fewer = card->render(all, from, {.point_budget = 100});
  CHECK(likeness(fewer, render(all, from)) > 15);
  CHECK_FALSE(fewer == card->render(all, from));

  CHECK_THROWS_AS((void)card->render(all, from, {.threads = 2}), invalid_input);
  CHECK_THROWS_AS((void)card->render(all, from, {.edges = -1}), invalid_input);
  view wrong = from;
  wrong.distance = -1;
  CHECK_THROWS_AS((void)card->render(all, wrong), invalid_input);
}

TEST_CASE("a graphics card draws what is empty, endless, dense, large or behind as render does") {
  const view from = look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, {.width = 320, .height = 240});
  const render_options plain{.edges = 0};
  // Nothing, and no colours for it.
  scene empty;
  empty.set("points", point_batch{.colors = color_matrix(3, 0)})
      .set("lines", line_batch{.colors = color_matrix(3, 0)})
      .set("triangles", triangle_batch{.colors = color_matrix(3, 0)});
  CHECK(likeness_on_screen(empty, from, plain) >= 35);

  // Thousands of points in each pixel, whose colours have one mean.
  point_batch dense{.points = Eigen::Matrix3Xf(3, 400'000), .colors = color_matrix(3, 400'000)};
  for (int i = 0; i < 400'000; ++i) {
    dense.points.col(i) << 0.1f * float(i % 20) / 20, 0.1f * float(i / 20 % 20) / 20, 0;
    dense.colors.col(i) << std::uint8_t(i % 70), std::uint8_t(i * 7 % 229),
        std::uint8_t(i * 13 % 124);
  }
  dense.size.sizes.setConstant(9);
  CHECK(likeness_on_screen(scene{}.set("dense", dense), from, plain) >= 35);

  // A disc that reaches behind its middle, one beside the picture, and one larger than drivers'
  // points.
  point_batch disc{.points = Eigen::Vector3f::Zero(), .normals = Eigen::Vector3f{0, 0.9f, 0.3f}};
  disc.size = {point_size::unit::length, Eigen::VectorXf::Constant(1, 2)};
  disc.along_normals = true;
  CHECK(likeness_on_screen(scene{}.set("disc", disc), from, plain) >= 35);
  point_batch beside = disc;
  beside.along_normals = false;
  beside.points.col(0) << 3, 0, 0;
  CHECK(likeness_on_screen(scene{}.set("beside", beside), from, plain) >= 35);
  beside.points.setZero();
  beside.size.sizes.setConstant(4.5f);
  CHECK(likeness_on_screen(scene{}.set("large", beside), from, plain) >= 35);
}

TEST_CASE("what is too much for a graphics card is refused, or drawn by the processor") {
  auto wide = sheet({}, 1);
  wide.texture = std::make_shared<const image<rgb>>(40'000, 2);
  wide.texture_places.setZero(2, 4);
  const auto all = scene{}.set("wide", wide);
  window w{all, {.title = "wide", .width = 100, .height = 80, .drawn_by = renderer::opengl}};
  CHECK_THROWS_WITH_AS(w.update(), doctest::Contains("the graphics card cannot draw this"),
                       window_error);
  window careful{all, {.title = "careful", .width = 100, .height = 80}};
  CHECK(eventually([&] { return is_on_screen(careful); }, careful));
}

TEST_CASE("without a graphics card the processor draws") {
  window w{some_scene(), {.title = "automatic", .width = 200, .height = 100}};
  CHECK(w.drawn_by() == renderer::software);
}

TEST_CASE("a layer that has changed, a hidden one and another size are drawn by a card, too") {
  window w{scene{}.set("planet", planet()).set("sheet", sheet({200, 60, 60}, 1)),
           {.title = "changes", .width = 320, .height = 200, .drawn_by = renderer::opengl}};
  const auto is_alike = [&] {
    const auto expected = render(w.current(), w.seen());
    return likeness(on_screen(0, 0, expected.width(), expected.height()), expected) >= 35;
  };
  CHECK(eventually(is_alike, w));
  auto next = w.current();
  w.show(next.set("planet", planet(3000)));
  CHECK(eventually(is_alike, w));
  w.show(next.hide("sheet"));
  CHECK(eventually(is_alike, w));
  REQUIRE(while_person_does(w, at_window("changes") + "windowsize %1 400 300"));
  CHECK(eventually([&] { return w.seen().camera.width == 400 && is_alike(); }, w));
  w.show(scene{});
  CHECK(eventually(is_alike, w));
}
