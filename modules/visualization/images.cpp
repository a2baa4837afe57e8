// SPDX-License-Identifier: MIT
module cilantro.visualization;

import :overlay;
import :value_colors;

namespace cilantro {
namespace {

void expect_look(const image_look& look) {
  expects(look.pose.matrix().allFinite(), "image_look: the pose must be finite");
  expects(look.pixel_size.allFinite() && look.pixel_size.minCoeff() > 0,
          "image_look: the width and height of a pixel must be positive and finite");
}

/// Where the middle of an image is, in the world.
Eigen::Vector3d middle_of(int width, int height, const image_look& look) {
  return look.pose * Eigen::Vector3d{look.pixel_size.x() * (width - 1) / 2,
                                     -look.pixel_size.y() * (height - 1) / 2, 0};
}

/// From the coordinates of an image, with y up, to those of a camera in front of it, with y down.
Eigen::Matrix3d turned(const Eigen::Matrix3d& axes) {
  return axes * Eigen::Vector3d{1, -1, -1}.asDiagonal();
}

void draw_texture(image<rgb> colors, canvas& on, const image_look& look) {
  expect_look(look);
  if (colors.pixels().empty()) return;
  triangle_batch plane{.origin = middle_of(colors.width(), colors.height(), look),
                       .opacity = look.opacity};
  plane.lit = false;
  plane.points.resize(3, 4);
  plane.texture_places.resize(2, 4);
  for (int corner = 0; corner < 4; ++corner) {
    // The borders are half a pixel from the middles of the pixels there.
    const double right = corner == 1 || corner == 2 ? 0.5 : -0.5, down = corner >= 2 ? 0.5 : -0.5;
    const double x = right * colors.width(), y = down * colors.height();
    plane.points.col(corner) =
        (look.pose.linear() * Eigen::Vector3d{look.pixel_size.x() * x, -look.pixel_size.y() * y, 0})
            .cast<float>();
    plane.texture_places.col(corner) << float(x + (colors.width() - 1) / 2.0),
        float(y + (colors.height() - 1) / 2.0);
  }
  plane.triangles.resize(3, 2);
  plane.triangles << 0, 0, 1, 2, 2, 3;
  plane.texture = std::make_shared<const image<rgb>>(std::move(colors));
  on.add(std::move(plane));
}

}  // namespace

void draw_colors(image<rgb> colors, canvas& on, const image_look& look) {
  expects(!look.map && !look.low && !look.high && !look.unknown && look.title.empty(),
          "draw: an image of colours has no .map, .low, .high, .unknown and .title; these are for "
          "images of numbers");
  draw_texture(std::move(colors), on, look);
}

void draw_values(std::vector<double> values, int width, int height, canvas& on,
                 const image_look& look) {
  if (look.unknown)
    std::ranges::replace(values, *look.unknown, std::numeric_limits<double>::quiet_NaN());
  const color_map map = look.map.value_or(color_map{});
  const value_colors color_of{values, map, look.low, look.high};
  image<rgb> colors(width, height);
  std::ranges::transform(values, colors.pixels().begin(), color_of);
  if (!values.empty()) on.add(color_of.legend(look.title));
  draw_texture(std::move(colors), on, look);
}

image_look image_at(const pinhole_camera<double>& camera, positive depth) {
  expect_camera(camera, "image_at");
  image_look look{.pixel_size = {depth / camera.fx, depth / camera.fy}};
  look.pose.linear() = turned(camera.to_world.linear());
  look.pose.translation() =
      camera.to_world * Eigen::Vector3d{-camera.cx * look.pixel_size.x(),
                                        -camera.cy * look.pixel_size.y(), double(depth)};
  return look;
}

view view_of_pixels(int width, int height, const image_look& look) {
  expect_look(look);
  expects(width > 0 && height > 0, "one_to_one: the image must have pixels");
  view from;
  from.camera = {width,
                 height,
                 1 / look.pixel_size.x(),
                 1 / look.pixel_size.y(),
                 (width - 1) / 2.0,
                 (height - 1) / 2.0};
  from.orthographic = true;
  from.distance = std::max(width * look.pixel_size.x(), height * look.pixel_size.y());
  from.camera.to_world.linear() = turned(look.pose.linear());
  from.camera.to_world.translation() =
      middle_of(width, height, look) - from.distance * from.ahead();
  from.up = -from.camera.to_world.linear().col(1);
  return from;
}

image<rgb> render_pixels(const scene& all, int width, int height, const image_look& look,
                         const render_options& options) {
  view from = view_of_pixels(width, height, look);
  const auto& legends = all.layers().front().content->legends();
  if (options.legends && !legends.empty()) {
    const bool is_given = options.width > 0 && options.height > 0;
    const int room = legend_room(legends.front(), is_given ? options.height : height);
    const double factor =
        is_given ? std::min(double(options.width - room) / width, double(options.height) / height)
                 : 1;
    if (factor > 0) from.camera.width += static_cast<int>(std::ceil(room / factor));
  }
  return render(all, from, options);
}

}  // namespace cilantro
