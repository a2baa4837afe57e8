// SPDX-License-Identifier: MIT
module cilantro.visualization;

namespace cilantro {
namespace {

constexpr double pi = std::numbers::pi;

/// Axes of a camera that looks ahead: to the right, down, ahead.
Eigen::Matrix3d axes_of(const Eigen::Vector3d& ahead, const Eigen::Vector3d& up) {
  const Eigen::Vector3d right = ahead.cross(up).normalized();
  Eigen::Matrix3d axes;
  axes << right, ahead.cross(right), ahead;
  return axes;
}

/// Pixels per unit of length at a distance of 1.
double focal_length(const view_options& options) {
  return 0.5 * std::min(options.width, options.height) / std::tan(options.field_of_view / 2);
}

void expect_valid(const view_options& options) {
  constexpr int most = 1 << 15;
  expects(
      options.width > 0 && options.height > 0 && options.width <= most && options.height <= most,
      "view_options: .width and .height must be from 1 to 32768 pixels");
  expects(options.field_of_view > 0 && options.field_of_view < pi,
          "view_options: .field_of_view is in radians, above 0 and below pi");
}

/// How far what is drawn reaches, in the axes of a camera and from the middle of all, along x and y
/// less `slope` times what it is ahead: to the right and down, and to the left and up.
struct scene_reach {
  Eigen::Array2d high, low;
  double nearest, farthest;
};
scene_reach reach_of(const scene& all, const view& from, const Eigen::Array2d& slope, double size) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const Eigen::Matrix3d to_camera = from.camera.to_world.linear().transpose();
  const Eigen::Vector3d middle = from.eye() + from.distance * from.ahead();
  scene_reach reach{{-infinity, -infinity}, {-infinity, -infinity}, infinity, -infinity};
  const auto add = [&](const Eigen::Vector3d& p, double radius = 0) {
    if (!is_finite(p)) return;
    const Eigen::Array2d beside = p.head<2>(), ahead = slope * p.z() - radius;
    reach.high = reach.high.max(beside - ahead);
    reach.low = reach.low.max(-beside - ahead);
    reach.nearest = std::min(reach.nearest, p.z());
    reach.farthest = std::max(reach.farthest, p.z());
  };
  const auto add_batches = [&](const auto& batches) {
    for (const auto& batch : batches) {
      const Eigen::Vector3d offset = to_camera * (batch.origin - middle);
      for (index_t i = 0; i < batch.points.cols(); ++i) {
        double radius = 0;
        if constexpr (requires { batch.size; })
          if (batch.size.in == point_size::unit::length)
            radius = double(batch.size.sizes[batch.size.sizes.size() == 1 ? 0 : i]) / 2;
        add(to_camera * batch.points.col(i).template cast<double>() + offset, radius);
      }
    }
  };
  for (const auto& layer : all.layers()) {
    if (layer.is_hidden) continue;
    add_batches(layer.content->points());
    add_batches(layer.content->lines());
    add_batches(layer.content->triangles());
    for (const auto& text : layer.content->labels()) add(to_camera * (text.place - middle));
  }
  // Of one point, or none, what is around it.
  if (!(reach.nearest <= reach.farthest)) add(Eigen::Vector3d::Zero());
  const Eigen::Array2d least = Eigen::Array2d::Constant(1e-3 * size);
  if (((reach.high + reach.low) < least).all() && reach.farthest - reach.nearest < 1e-3 * size)
    for (const double end : {-size, size}) add(Eigen::Vector3d{end, end, 0});
  return reach;
}

}  // namespace

void expect_camera(const pinhole_camera<double>& camera, const char* who) {
  const auto is_number = [](double x) { return std::isfinite(x); };
  expects(camera.width > 0 && camera.height > 0,
          std::string{who} + ": the camera's picture must have a width and a height");
  expects(camera.fx > 0 && camera.fy > 0 && is_number(camera.fx) && is_number(camera.fy) &&
              is_number(camera.cx) && is_number(camera.cy) && camera.to_world.matrix().allFinite(),
          std::string{who} + ": the camera must be finite, and its focal lengths positive");
  const Eigen::Matrix3d turn = camera.to_world.linear();
  expects((turn * turn.transpose()).isIdentity(1e-3) && turn.determinant() > 0,
          std::string{who} + ": the pose of the camera must be a rotation and a translation");
}

void expect_view(const view& from, const char* who) {
  expect_camera(from.camera, who);
  expects(from.distance > 0 && std::isfinite(from.distance),
          std::string{who} + ": the distance of the view must be positive and finite");
}

view look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& at, const Eigen::Vector3d& up,
             const view_options& options) {
  expect_valid(options);
  expects(is_finite(eye) && is_finite(at) && is_finite(up),
          "look_at: the eye, what it looks at and up must be finite");
  const Eigen::Vector3d across = at - eye;
  const double distance = across.stableNorm();
  expects(distance > 0 && std::isfinite(distance),
          "look_at: the eye must not be where it looks at");
  const Eigen::Vector3d ahead = across / distance, upright = up.stableNormalized();
  expects(ahead.cross(upright).norm() > 1e-9,
          "the direction of a view must not be along up: from straight above, another axis is up, "
          "such as {0, 1, 0}");

  view result;
  const double focal = focal_length(options) / (options.orthographic ? distance : 1);
  result.camera = {options.width, options.height,           focal,
                   focal,         (options.width - 1) / 2., (options.height - 1) / 2.};
  result.camera.to_world.linear() = axes_of(ahead, upright);
  result.camera.to_world.translation() = eye;
  result.orthographic = options.orthographic;
  result.distance = distance;
  result.up = upright;
  return result;
}

view fit(const scene& all, const view_options& options) {
  const auto box = all.bounds();
  const bool is_flat = !box.isEmpty() && box.sizes().z() == 0 && box.sizes().squaredNorm() > 0;
  if (is_flat) return fit(all, -Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), options);
  return fit(all, {0.5, 1, -0.6}, Eigen::Vector3d::UnitZ(), options);
}

view fit(const scene& all, const Eigen::Vector3d& direction, const Eigen::Vector3d& up,
         const view_options& options) {
  expect_valid(options);
  expects(is_finite(direction) && direction.stableNorm() > 0,
          "fit: the direction must be finite and not zero");
  const auto box = all.bounds();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double size = 0;
  if (!box.isEmpty()) {
    middle = box.min() / 2 + box.max() / 2;
    size = (box.max() / 2 - box.min() / 2).stableNorm();
  }
  if (!(size > 0 && std::isfinite(size))) size = 1;
  // Of coordinates so large that the eye would be where they are.
  size = std::max(size, 64 * std::numeric_limits<double>::epsilon() * middle.stableNorm());
  const Eigen::Vector3d ahead = direction.stableNormalized();
  view result = look_at(middle - size * ahead, middle, up, options);

  // The border of the picture, as far from its middle as it is at a distance of 1, less some room.
  constexpr double room = 1.04;
  const Eigen::Array2d slope =
      Eigen::Array2d{options.width, options.height} / (2 * room * focal_length(options));
  const auto reach =
      reach_of(all, result, options.orthographic ? Eigen::Array2d{0, 0} : slope, size);
  const Eigen::Array2d aside = (reach.high - reach.low) / 2;
  const Eigen::Array2d half = (reach.high + reach.low) / 2;
  const double depth = (reach.nearest + reach.farthest) / 2;
  double back = reach.nearest - size;
  if (options.orthographic) {
    const double factor = std::max((half / slope).maxCoeff(), 1e-6 * size);
    result.camera.fx = result.camera.fy = focal_length(options) / factor;
  } else {
    back = std::min((-half / slope).minCoeff(), reach.nearest - 2 * nearest_share * size);
  }
  result.distance = depth - back;
  result.camera.to_world.translation() =
      middle + result.camera.to_world.linear() * Eigen::Vector3d{aside.x(), aside.y(), back};
  return result;
}

view orbit(view from, const orbit_angles& angles) {
  expect_camera(from.camera, "orbit");
  expects(std::isfinite(angles.right) && std::isfinite(angles.up) && std::isfinite(from.distance),
          "orbit: the angles and the distance of the view must be finite");
  from.up = from.up.stableNormalized();
  expects(is_finite(from.up) && from.up.cross(from.ahead()).norm() > 1e-9,
          "orbit: the view must have an up that is not ahead");
  const Eigen::Vector3d at = from.eye() + from.distance * from.ahead();
  const Eigen::Vector3d ahead = Eigen::AngleAxisd{angles.right, from.up} * from.ahead();
  const double height = std::asin(std::clamp(-ahead.dot(from.up), -1.0, 1.0));
  constexpr double most = pi / 2 - 1e-3;
  const double risen =
      std::clamp(height + angles.up, std::min(-most, height), std::max(most, height));
  const Eigen::Vector3d level = (ahead - ahead.dot(from.up) * from.up).normalized();
  const Eigen::Vector3d turned = std::cos(risen) * level - std::sin(risen) * from.up;
  from.camera.to_world.linear() = axes_of(turned, from.up);
  from.camera.to_world.translation() = at - from.distance * turned;
  return from;
}

view pan(view from, const pan_pixels& by) {
  expect_camera(from.camera, "pan");
  expects(std::isfinite(by.right) && std::isfinite(by.down) && std::isfinite(from.distance),
          "pan: the pixels and the distance of the view must be finite");
  const double depth = from.orthographic ? 1 : from.distance;
  const Eigen::Vector3d step{-by.right * depth / from.camera.fx, -by.down * depth / from.camera.fy,
                             0};
  from.camera.to_world.translation() += from.camera.to_world.linear() * step;
  return from;
}

view zoom(view from, positive factor) {
  if (from.orthographic) {
    from.camera.fx *= factor;
    from.camera.fy *= factor;
    return from;
  }
  const double nearer = from.distance / factor;
  from.camera.to_world.translation() += (from.distance - nearer) * from.ahead();
  from.distance = nearer;
  return from;
}

std::vector<view> turntable(const view& from, int count) {
  expects(1 <= count && count <= 100'000, "turntable: there are 1 to 100,000 views");
  std::vector<view> all;
  for (int i = 0; i < count; ++i) all.push_back(orbit(from, {.right = 2 * pi * i / count}));
  return all;
}

}  // namespace cilantro
