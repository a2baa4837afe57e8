// SPDX-License-Identifier: MIT
module cilantro.visualization;

namespace cilantro {

void draw(const point_batch& batch, canvas& on) {
  on.add(batch);
}
void draw(const line_batch& batch, canvas& on) {
  on.add(batch);
}
void draw(const triangle_batch& batch, canvas& on) {
  on.add(batch);
}
void draw(const label& text, canvas& on) {
  on.add(text);
}

line_batch lines_between(const std::vector<Eigen::Vector3f>& ends, const Eigen::Vector3d& origin,
                         const rgb& color) {
  line_batch lines{.origin = origin, .colors = one_color(color)};
  lines.points.resize(3, std::ssize(ends));
  for (index_t i = 0; i < lines.points.cols(); ++i) lines.points.col(i) = ends[i];
  return lines;
}

line_batch frame_lines(const Eigen::Isometry3d& pose, positive length) {
  line_batch lines{.origin = pose.translation(), .width = 2.5};
  lines.points = Eigen::Matrix3Xf::Zero(3, 6);
  for (int axis = 0; axis < 3; ++axis)
    lines.points.col(2 * axis + 1) = (double(length) * pose.linear().col(axis)).cast<float>();
  lines.colors.resize(3, 3);
  lines.colors << 230, 80, 70, 60, 190, 110, 60, 90, 255;
  return lines;
}

line_batch frustum_lines(const pinhole_camera<double>& camera, positive depth, const rgb& color) {
  expect_camera(camera, "frustum_lines");
  line_batch lines{.origin = camera.to_world.translation(), .colors = one_color(color)};
  lines.points = Eigen::Matrix3Xf::Zero(3, 5);
  for (int corner = 0; corner < 4; ++corner) {
    // From the middle of the first pixel by half a pixel: the border.
    const double u = corner == 1 || corner == 2 ? camera.width - 0.5 : -0.5;
    const double v = corner >= 2 ? camera.height - 0.5 : -0.5;
    const Eigen::Vector3d ray{(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1};
    lines.points.col(corner + 1) = (double(depth) * (camera.to_world.linear() * ray)).cast<float>();
  }
  lines.segments.resize(2, 8);
  lines.segments << 0, 0, 0, 0, 1, 2, 3, 4,  //
      1, 2, 3, 4, 2, 3, 4, 1;
  return lines;
}

line_batch box_lines(const Eigen::AlignedBox3d& edges, const rgb& color) {
  expects(!edges.isEmpty() && is_finite(edges.min()) && is_finite(edges.max()),
          "box_lines: the box must be finite and not empty");
  line_batch lines{.origin = edges.center(), .colors = one_color(color)};
  lines.points.resize(3, 8);
  for (int corner = 0; corner < 8; ++corner)
    for (int d = 0; d < 3; ++d)
      lines.points(d, corner) = float((corner >> d & 1 ? 0.5 : -0.5) * edges.sizes()[d]);
  lines.segments.resize(2, 12);
  int next = 0;
  for (int a = 0; a < 8; ++a)
    for (int d = 0; d < 3; ++d)
      if ((a >> d & 1) == 0) lines.segments.col(next++) << a, a | 1 << d;
  return lines;
}

line_batch grid_lines(const grid_lines_options& o) {
  expects(1 <= o.cells && o.cells <= 1000, "grid_lines: .cells must be from 1 to 1000");
  expects(std::isfinite(o.height), "grid_lines: .height must be finite");
  line_batch lines{.origin = {0, 0, o.height}, .colors = one_color(o.color), .width = 1};
  lines.points = Eigen::Matrix3Xf::Zero(3, 4 * (o.cells + 1));
  const double half = o.cells / 2.0 * o.step;
  for (int i = 0; i <= o.cells; ++i) {
    const float at = float(i * double(o.step) - half), end = float(half);
    lines.points.block<3, 4>(0, 4 * i) << at, at, -end, end,  //
        -end, end, at, at,                                    //
        0, 0, 0, 0;
  }
  return lines;
}

line_batch wireframe(const triangle_batch& mesh, const rgb& color) {
  std::vector<std::pair<int, int>> edges;
  for (const auto corners : mesh.triangles.colwise())
    for (int k = 0; k < 3; ++k) edges.push_back(std::minmax({corners[k], corners[(k + 1) % 3]}));
  std::ranges::sort(edges);
  const auto rest = std::ranges::unique(edges);
  edges.erase(rest.begin(), rest.end());
  line_batch lines{.origin = mesh.origin, .colors = one_color(color)};
  if (!edges.empty()) lines.points = mesh.points;
  lines.width = 1;
  lines.segments.resize(2, std::ssize(edges));
  for (index_t i = 0; i < lines.segments.cols(); ++i)
    lines.segments.col(i) << edges[i].first, edges[i].second;
  return lines;
}

}  // namespace cilantro
