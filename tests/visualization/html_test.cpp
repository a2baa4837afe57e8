// SPDX-License-Identifier: MIT
//
// What is in a page, unpacked here as the page unpacks it, against what was set.
#include <doctest/doctest.h>
#include <zlib.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

import cilantro.visualization;
import test_support;

using namespace cilantro;
using nlohmann::json;

namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{file}, {}};
}

int count(std::string_view text, std::string_view part) {
  int n = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++n;
  return n;
}

std::vector<unsigned char> unpacked(std::string_view base64) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned char> packed;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : base64) {
    if (c == '=') break;
    bits = bits << 6 | std::uint32_t(digits.find(c));
    if ((count += 6) < 8) continue;
    count -= 8;
    packed.push_back(static_cast<unsigned char>(bits >> count));
  }
  std::vector<unsigned char> data(std::size_t(1) << 24);
  uLongf size = data.size();
  REQUIRE(uncompress(data.data(), &size, packed.data(), packed.size()) == Z_OK);
  data.resize(size);
  return data;
}

/// A page as a browser takes it apart: its description, and its streams.
struct page {
  json scene;
  std::vector<std::vector<unsigned char>> streams;

  explicit page(const std::filesystem::path& path) {
    const std::string text = text_of(path);
    const auto between = [&](std::string_view begin, std::size_t& from) {
      const auto at = text.find(begin, from);
      if (at == text.npos) return std::string_view{};
      const auto first = at + begin.size();
      from = text.find("</script>", first);
      return std::string_view{text}.substr(first, from - first);
    };
    std::size_t at = 0;
    scene = json::parse(between(R"(<script id="scene" type="application/json">)", at));
    for (;;) {
      const auto stream = between(R"(<script class="stream" type="text/plain">)", at);
      if (stream.empty()) break;
      streams.push_back(unpacked(stream));
    }
  }
};

/// Reads arrays off a stream.
struct reader {
  const std::vector<unsigned char>& data;
  std::size_t at = 0;

  std::vector<std::uint32_t> values(std::size_t n, int size) {
    std::vector<std::uint32_t> result(n);
    for (int plane = 0; plane < size; ++plane)
      for (auto& value : result) value |= std::uint32_t{data.at(at++)} << (8 * plane);
    return result;
  }
  std::vector<std::uint32_t> sums(std::size_t n, int size) {
    auto result = values(n, size);
    std::uint32_t sum = 0;
    for (auto& value : result) value = sum += (value >> 1) ^ (0 - (value & 1));
    return result;
  }
  std::vector<std::uint8_t> byte_sums(std::size_t n) {
    std::vector<std::uint8_t> result(data.begin() + std::ptrdiff_t(at),
                                     data.begin() + std::ptrdiff_t(at + n));
    at += n;
    for (std::size_t i = 1; i < n; ++i) result[i] = std::uint8_t(result[i] + result[i - 1]);
    return result;
  }
  std::vector<float> floats(std::size_t n) {
    std::vector<float> result;
    for (const auto bits : values(n, 4)) result.push_back(std::bit_cast<float>(bits));
    return result;
  }
  [[nodiscard]] bool is_at_end() const { return at == data.size(); }
};

Eigen::Vector3d direction_of(std::uint8_t u, std::uint8_t v) {
  Eigen::Vector3d n{(u - 127) / 127.0, (v - 127) / 127.0, 0};
  n.z() = 1 - std::abs(n.x()) - std::abs(n.y());
  if (n.z() < 0)
    n.head<2>() = Eigen::Vector2d{(1 - std::abs(n.y())) * (n.x() < 0 ? -1 : 1),
                                  (1 - std::abs(n.x())) * (n.y() < 0 ? -1 : 1)};
  return n.normalized();
}

/// Points that say by their colour which they are.
point_batch numbered_points(int n) {
  std::srand(7);
  point_batch batch{.points = Eigen::Matrix3Xf::Random(3, n),
                    .colors = color_matrix(3, n),
                    .normals = Eigen::Matrix3Xf::Random(3, n),
                    .size = {point_size::unit::length, Eigen::VectorXf(n)}};
  for (int i = 0; i < n; ++i) {
    batch.colors.col(i) << std::uint8_t(i), std::uint8_t(i >> 8), std::uint8_t(i >> 16);
    batch.size.sizes[i] = 0.001f * float(1 + i % 50);
  }
  return batch;
}

}  // namespace

TEST_CASE("a page holds each point, with its colour, its size and its normal") {
  const test::temporary_folder folder;
  constexpr int n = 70'000;  // Of two chunks.
  point_batch batch = numbered_points(n);
  batch.points.col(5).setConstant(std::numeric_limits<float>::quiet_NaN());
  batch.points(1, 6) = std::numeric_limits<float>::infinity();
  batch.points.col(7) = batch.points.col(8);
  batch.normals.col(9).setZero();
  batch.normals.col(10) << 0, 0, 1;
  batch.normals.col(11) << 0, 0, -1;
  batch.origin = {5e6, -1e6, 100};
  const auto all = scene{}.set("numbered", batch);
  write_html(all, folder / "page.html", {.threads = 1});

  const page made{folder / "page.html"};
  const auto& layer = made.scene["layers"][0];
  const auto& points = layer["points"][0];
  CHECK(layer["name"] == "numbered");
  CHECK(points["count"] == n - 2);
  CHECK(points["origin"] == json{5e6, -1e6, 100});
  CHECK(points["isLength"] == true);
  REQUIRE(made.streams.size() == 2);
  const double step = points["step"];
  // Of half of all, the splats are as large as 25 or 26 thousandths.
  CHECK(step == doctest::Approx(0.0255 / 32).epsilon(0.03));

  std::vector<int> seen(n);
  double worst = 0, worst_size = 0, worst_angle = 0;
  for (std::size_t chunk = 0; chunk < 2; ++chunk) {
    reader from{made.streams[chunk]};
    const std::size_t count = chunk == 0 ? 65'536 : n - 2 - 65'536;
    std::array<std::vector<std::uint32_t>, 3> q;
    for (auto& axis : q) axis = from.sums(count, 3);
    const auto green = from.byte_sums(count), red = from.byte_sums(count),
               blue = from.byte_sums(count), size = from.byte_sums(count),
               u = from.byte_sums(count), v = from.byte_sums(count);
    CHECK(from.is_at_end());
    const double low = points["sizes"][0], high = points["sizes"][1];
    for (std::size_t i = 0; i < count; ++i) {
      const int number =
          std::uint8_t(red[i] + green[i]) | green[i] << 8 | std::uint8_t(blue[i] + green[i]) << 16;
      REQUIRE(number < n);
      ++seen[std::size_t(number)];
      for (int k = 0; k < 3; ++k) {
        const double at = double(points["low"][std::size_t(k)]) + step * q[std::size_t(k)][i];
        worst = std::max(worst, std::abs(at - double(batch.points(k, number))));
      }
      const double own = batch.size.sizes[number];
      worst_size =
          std::max(worst_size, std::abs(low * std::pow(high / low, size[i] / 255.) / own - 1));
      if (number == 9) {
        CHECK(u[i] == 0);
        CHECK(v[i] == 0);
        continue;
      }
      CHECK((u[i] != 0 || v[i] != 0));
      const Eigen::Vector3d normal = batch.normals.col(number).cast<double>().normalized();
      worst_angle = std::max(worst_angle, direction_of(u[i], v[i]).cross(normal).norm() +
                                              (direction_of(u[i], v[i]).dot(normal) > 0 ? 0 : 1));
    }
  }
  CHECK(worst <= step / 2 + 1e-6);
  CHECK(worst_size < 0.02);
  CHECK(worst_angle < 0.0175);  // A degree.
  seen[5] += 1;
  seen[6] += 1;
  for (const int times : seen) REQUIRE(times == 1);

  write_html(all, folder / "again.html", {.threads = 3});
  CHECK(text_of(folder / "again.html") == text_of(folder / "page.html"));
}

TEST_CASE("a page takes less than seven bytes for a coloured point of a surface") {
  const test::temporary_folder folder;
  constexpr int side = 300;
  point_cloud<float, 3> surface{.points = Eigen::Matrix3Xf(3, side * side),
                                .colors = Eigen::Matrix3Xf(3, side * side)};
  std::srand(1);
  for (int i = 0; i < side * side; ++i) {
    const float x = float(i % side) / side, y = float(i / side) / side;
    const Eigen::Vector3f noise = Eigen::Vector3f::Random();
    surface.points.col(i) << x, y, 0.1f * std::sin(9 * x) * std::cos(7 * y) + 0.001f * noise.x();
    surface.colors.col(i) = (Eigen::Vector3f{x, y, 0.5f} + 0.02f * noise).cwiseMax(0).cwiseMin(1);
  }
  write_html(scene{}.set("surface", surface), folder / "page.html");
  const double without = [&] {
    write_html(scene{}, folder / "empty.html");
    return double(std::filesystem::file_size(folder / "empty.html"));
  }();
  CHECK((double(std::filesystem::file_size(folder / "page.html")) - without) / (side * side) < 7);
}

TEST_CASE("lines and triangles are in a page to the bit") {
  const test::temporary_folder folder;
  triangle_batch mesh{.points = Eigen::Matrix3Xf::Random(3, 5),
                      .triangles = Eigen::Matrix3Xi(3, 2)};
  mesh.triangles << 0, 4, 1, 3, 2, 0;
  mesh.colors = color_matrix::Random(3, 5);
  mesh.normals = Eigen::Matrix3Xf::Random(3, 5);
  mesh.opacity = 0.5;
  line_batch lines{.points = Eigen::Matrix3Xf::Random(3, 4), .width = 3};
  write_html(scene{}.set("mesh", mesh).set("lines", lines), folder / "page.html");

  const page made{folder / "page.html"};
  const auto& triangles = made.scene["layers"][0]["triangles"][0];
  CHECK(triangles["opacity"] == 0.5);
  CHECK(triangles["points"] == 5);
  CHECK(triangles["count"] == 2);
  REQUIRE(made.streams.size() == 2);
  reader from{made.streams[0]};
  CHECK(from.floats(15) == std::vector<float>(mesh.points.data(), mesh.points.data() + 15));
  CHECK(from.sums(6, 4) == std::vector<std::uint32_t>{0, 1, 2, 4, 3, 0});
  CHECK(from.values(15, 1) ==
        std::vector<std::uint32_t>(mesh.colors.data(), mesh.colors.data() + 15));
  CHECK(from.floats(15) == std::vector<float>(mesh.normals.data(), mesh.normals.data() + 15));
  CHECK(from.is_at_end());

  const auto& segments = made.scene["layers"][1]["lines"][0];
  CHECK(segments["width"] == 3);
  CHECK(segments["color"] == json{220, 220, 220});
  reader ends{made.streams[1]};
  CHECK(ends.floats(12) == std::vector<float>(lines.points.data(), lines.points.data() + 12));
  CHECK(ends.sums(4, 4) == std::vector<std::uint32_t>{0, 1, 2, 3});
}

TEST_CASE("what is not finite is not in a page, and no view that a hand could not turn") {
  const test::temporary_folder folder;
  line_batch lines{.points = Eigen::Matrix3Xf::Zero(3, 6), .colors = color_matrix(3, 3)};
  lines.points(1, 2) = std::numeric_limits<float>::infinity();
  lines.colors << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  triangle_batch mesh{.points = Eigen::Matrix3Xf::Zero(3, 4), .triangles = Eigen::Matrix3Xi(3, 2)};
  mesh.points(0, 3) = -std::numeric_limits<float>::infinity();
  mesh.triangles << 0, 0, 1, 2, 3, 1;
  const auto all = scene{}.set("lines", lines).set("mesh", mesh);
  write_html(all, folder / "page.html");
  const page made{folder / "page.html"};
  CHECK(made.scene["layers"][0]["lines"][0]["count"] == 2);
  CHECK(made.scene["layers"][1]["triangles"][0]["count"] == 1);
  reader from{made.streams.at(0)};
  (void)from.floats(18);
  CHECK(from.sums(4, 4) == std::vector<std::uint32_t>{0, 1, 4, 5});
  CHECK(from.values(6, 1) == std::vector<std::uint32_t>{1, 4, 7, 3, 6, 9});

  view wrong = fit(all);
  wrong.up.setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK_THROWS_AS(write_html(all, wrong, folder / "page.html"), invalid_input);
  wrong.up = wrong.ahead();
  CHECK_THROWS_AS(write_html(all, wrong, folder / "page.html"), invalid_input);
}

TEST_CASE("an image is in a page pixel by pixel") {
  const test::temporary_folder folder;
  image<rgb> picture(5, 4);
  for (int i = 0; i < 20; ++i)
    picture(i % 5, i / 5) = {std::uint8_t(13 * i), std::uint8_t(255 - i), std::uint8_t(7 * i * i)};
  write_html(scene{}.set("image", picture), folder / "page.html");
  const page made{folder / "page.html"};
  const auto& triangles = made.scene["layers"][0]["triangles"][0];
  CHECK(triangles["isLit"] == false);
  CHECK(triangles["texture"]["width"] == 5);
  CHECK(triangles["texture"]["height"] == 4);
  REQUIRE(made.streams.size() == 2);
  reader mesh{made.streams[0]};
  const auto points = mesh.floats(12);
  CHECK(mesh.sums(6, 4).size() == 6);
  const auto places = mesh.floats(8);
  CHECK(mesh.is_at_end());
  // The middle of pixel (x, y) is at (x, -y).
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(places[2 * i] == doctest::Approx(points[3 * i] + double(triangles["origin"][0])));
    CHECK(places[2 * i + 1] ==
          doctest::Approx(-points[3 * i + 1] - double(triangles["origin"][1])));
  }
  reader pixels{made.streams[1]};
  const auto green = pixels.byte_sums(20), red = pixels.byte_sums(20), blue = pixels.byte_sums(20);
  for (std::size_t i = 0; i < 20; ++i)
    CHECK(rgb{std::uint8_t(red[i] + green[i]), green[i], std::uint8_t(blue[i] + green[i])} ==
          picture(int(i % 5), int(i / 5)));
}

TEST_CASE("names and texts stay texts, whatever they are") {
  const test::temporary_folder folder;
  const std::string hostile = "</script><script>alert('\\\"')</script>\n\x01<!-- &amp; µ";
  const auto all = scene{}.set(hostile, label{hostile, {1, 2, 3}});
  write_html(all, folder / "page.html", {.title = hostile});
  const page made{folder / "page.html"};
  CHECK(made.scene["title"] == hostile);
  CHECK(made.scene["layers"][0]["name"] == hostile);
  CHECK(made.scene["layers"][0]["labels"][0]["text"] == hostile);
  CHECK(made.scene["layers"][0]["labels"][0]["place"] == json{1, 2, 3});
  const std::string text = text_of(folder / "page.html");
  CHECK(count(text, "alert") == 4);
  CHECK(count(text, "<script>alert") == 0);
  CHECK(count(text, "</script>") == 3);  // Of the scene, of the shaders, and of the page.
}

TEST_CASE("a page begins with the view, the layers and the legends that it is given") {
  const test::temporary_folder folder;
  auto all = scene{}.set("a", frame_lines(Eigen::Isometry3d::Identity())).set("b", label{"b"});
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Random(3, 9)};
  all.set("c", cloud, cloud_look{.color = by_coordinate{2, viridis, -2.0, 2.0}});
  all.hide("b");
  const view from =
      look_at({1, 2, 3}, {0, 0, 0}, {0, 0, 1}, {.width = 200, .height = 100, .orthographic = true});
  write_html(all, from, folder / "page.HTML",
             {.background = {255, 254, 253}, .blend = false, .edges = 0.5, .labels = false});
  const page made{folder / "page.HTML"};
  CHECK(made.scene["background"] == json{255, 254, 253});
  CHECK(made.scene["blend"] == false);
  CHECK(made.scene["edges"] == 0.5);
  CHECK(made.scene["labels"] == false);
  CHECK(made.scene["legends"] == true);
  const auto& seen = made.scene["view"];
  CHECK(seen["eye"] == json{1, 2, 3});
  CHECK(seen["width"] == 200);
  CHECK(double(seen["fx"]) == from.camera.fx);
  CHECK(seen["orthographic"] == true);
  CHECK(double(seen["turn"][5]) == from.camera.to_world.linear()(1, 2));
  CHECK(made.scene["layers"][1]["isHidden"] == true);
  CHECK(made.scene["layers"][2]["isHidden"] == false);
  const auto& legend = made.scene["layers"][2]["legends"][0];
  CHECK(legend["title"] == "z");
  CHECK(legend["numbers"] == json{"-2", "0", "2"});
}

TEST_CASE("pages of nothing, of one point and of equal points are pages") {
  const test::temporary_folder folder;
  write_html(scene{}, folder / "page.html");
  CHECK(page{folder / "page.html"}.scene["layers"].empty());
  point_batch nowhere{
      .points = Eigen::Matrix3Xf::Constant(3, 4, std::numeric_limits<float>::quiet_NaN())};
  point_batch equal{.points = Eigen::Matrix3Xf::Constant(3, 4, 1e30f)};
  equal.size.in = point_size::unit::length;
  equal.size.sizes.setZero(1);
  write_html(scene{}.set("none", point_batch{}).set("nowhere", nowhere).set("equal", equal),
             folder / "page.html");
  const page made{folder / "page.html"};
  CHECK(made.scene["layers"][0]["points"][0]["count"] == 0);
  CHECK(made.scene["layers"][1]["points"][0]["count"] == 0);
  CHECK(made.scene["layers"][2]["points"][0]["count"] == 4);
  REQUIRE(made.streams.size() == 1);
  CHECK(double(made.scene["layers"][2]["points"][0]["low"][0]) == double(1e30f));
}

TEST_CASE("a page that cannot be made is refused, and leaves what was there") {
  const test::temporary_folder folder;
  std::ofstream{folder / "page.html"} << "before";
  const auto all = scene{}.set("point", point_batch{.points = Eigen::Vector3f::Zero()});
  CHECK_THROWS_WITH_AS(write_html(all, folder / "page.png"), doctest::Contains("must end in .html"),
                       invalid_input);
  CHECK_THROWS_AS(write_html(all, folder / "page.html", {.edges = -1}), invalid_input);
  CHECK_THROWS_AS(write_html(all, folder / "page.html", {.threads = -1}), invalid_input);
  view wrong;
  wrong.distance = 0;
  CHECK_THROWS_AS(write_html(all, wrong, folder / "page.html"), invalid_input);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS(write_html(all, folder / "page.html", {.monitor = {.stop = stop.get_token()}}),
                  cancelled);
  {
    const auto many =
        scene{}.set("many", point_batch{.points = Eigen::Matrix3Xf::Zero(3, 10'000'001)});
    CHECK_THROWS_WITH_AS(write_html(many, folder / "page.html"), doctest::Contains("10000001"),
                         invalid_input);
  }
  CHECK(text_of(folder / "page.html") == "before");
  CHECK_THROWS_AS(write_html(all, folder / "no such folder" / "page.html"), io_error);
}
