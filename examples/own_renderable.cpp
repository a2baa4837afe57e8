// SPDX-License-Identifier: MIT
//
// A thing of your own in a scene: the path of a robot, with an ellipse where it is not sure. A
// plain struct that says itself as lines and texts; pictures, pages and windows draw it.
#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

import cilantro;
import cilantro.visualization;
using namespace cilantro;

struct estimated_path {
  struct pose {
    Eigen::Vector2d place;
    Eigen::Matrix2d covariance;
  };
  std::vector<pose> poses;

  void draw(canvas& on) const {
    const auto n = std::ssize(poses);
    line_batch way{.points = Eigen::Matrix3Xf::Zero(3, n),
                   .segments = Eigen::Matrix2Xi(2, n > 1 ? n - 1 : 0),
                   .colors = one_color({255, 220, 90}),
                   .width = 3};
    for (index_t i = 0; i < n; ++i) way.points.col(i).head<2>() = poses[i].place.cast<float>();
    for (index_t i = 1; i < n; ++i) way.segments.col(i - 1) << int(i - 1), int(i);
    on.add(std::move(way));
    for (index_t i = 0; i < n; i += 4) on.add(ellipse_of(poses[i]));
    if (n > 0) on.add(label{"start", {poses[0].place.x(), poses[0].place.y(), 0.1}});
  }

 private:
  /// Where it is with 95 % probability.
  static line_batch ellipse_of(const pose& p) {
    constexpr int corners = 48;
    const Eigen::Matrix2d root = p.covariance.llt().matrixL();
    line_batch ring{.points = Eigen::Matrix3Xf::Zero(3, corners),
                    .segments = Eigen::Matrix2Xi(2, corners),
                    .colors = one_color({120, 200, 255})};
    for (int k = 0; k < corners; ++k) {
      const double angle = 2 * std::numbers::pi * k / corners;
      const Eigen::Vector2d on_circle{std::cos(angle), std::sin(angle)};
      ring.points.col(k).head<2>() = (p.place + 2.4477 * root * on_circle).cast<float>();
      ring.segments.col(k) << k, (k + 1) % corners;
    }
    return ring;
  }
};
static_assert(Renderable<estimated_path>);

int main() {
  estimated_path path;
  Eigen::Matrix2d covariance = 1e-4 * Eigen::Matrix2d::Identity();
  for (int i = 0; i <= 40; ++i) {
    const double t = 0.1 * i;
    path.poses.push_back({{t, std::sin(t)}, covariance});
    // Each step adds more along the way than across.
    const Eigen::Vector2d along = Eigen::Vector2d{1, std::cos(t)}.normalized();
    covariance += 3e-4 * along * along.transpose() + 1e-4 * Eigen::Matrix2d::Identity();
  }

  scene all;
  all.set("floor", grid_lines({.step = 0.5, .cells = 16})).set("path", path);
  const view from = fit(scene{}.set("path", path), {0.2, 1, -1}, {0, 0, 1});
  write_picture(all, from, "path.png", {.supersampling = 2});
  write_html(all, from, "path.html", {.title = "An estimated path"});

  const auto drawn = all.layers()[1].content;
  std::cout << drawn->lines().size() << " batches of lines and " << drawn->labels().size()
            << " text are in path.png and path.html\n";
  return drawn->lines().size() == 12 && std::filesystem::file_size("path.png") > 0 ? 0 : 1;
}
