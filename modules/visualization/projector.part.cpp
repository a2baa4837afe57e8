// SPDX-License-Identifier: MIT
//
// From the coordinates of batches to pixels. Internal.
module cilantro.visualization:projector;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import cilantro.geometry;
import :view;

namespace cilantro {

/// A view of a picture of a given size, and what is nearer than `nearest` not seen.
struct projector {
  Eigen::Matrix3d to_camera;
  Eigen::Vector3d eye;
  double fx, fy, cx, cy;
  int width, height, fineness;
  bool orthographic;
  double nearest;

  /// In a picture of another size than that of the camera, what the smaller factor leaves room for
  /// is seen, too. `fineness` pixels of the result along each axis are one of the picture.
  projector(const view& from, int picture_width, int picture_height, int fineness)
      : to_camera{from.camera.to_world.linear().transpose()},
        eye{from.eye()},
        width{picture_width * fineness},
        height{picture_height * fineness},
        fineness{fineness},
        orthographic{from.orthographic},
        nearest{from.orthographic ? 0 : nearest_share * from.distance} {
    const auto& camera = from.camera;
    const double factor =
        std::min(double(picture_width) / camera.width, double(picture_height) / camera.height);
    fx = camera.fx * factor * fineness;
    fy = camera.fy * factor * fineness;
    // Integers are the middles of pixels, the borders half a pixel away.
    const auto moved = [&](double c, int from_size, int to_size) {
      return ((c + 0.5 - from_size / 2.0) * factor + to_size / 2.0) * fineness - 0.5;
    };
    cx = moved(camera.cx, camera.width, picture_width);
    cy = moved(camera.cy, camera.height, picture_height);
  }

  /// In pixels, and ahead of the eye.
  struct place {
    double x, y, z;
  };
  /// Where a point of the camera's coordinates is seen. Precondition: z > 0.
  [[nodiscard]] inline place seen(const Eigen::Vector3d& p) const {
    const double scale = orthographic ? 1 : 1 / p.z();
    return {fx * p.x() * scale + cx, fy * p.y() * scale + cy, p.z()};
  }
  /// The camera's coordinates of a place in the world.
  [[nodiscard]] inline Eigen::Vector3d operator()(const Eigen::Vector3d& p) const {
    return to_camera * (p - eye);
  }
  /// The ray through a pixel, in the camera's coordinates, with 1 along z; and where it begins.
  struct ray {
    Eigen::Vector3d origin, direction;
  };
  [[nodiscard]] inline ray through(double x, double y) const {
    const Eigen::Vector3d beside{(x - cx) / fx, (y - cy) / fy, 0};
    if (orthographic) return {beside, Eigen::Vector3d::UnitZ()};
    return {Eigen::Vector3d::Zero(), beside + Eigen::Vector3d::UnitZ()};
  }
};

/// The points of a batch in the camera's coordinates. The offset is found in double, so that large
/// coordinates keep their digits.
struct batch_placement {
  Eigen::Matrix3f linear;
  Eigen::Vector3f offset;

  inline batch_placement(const projector& by, const Eigen::Vector3d& origin)
      : linear{by.to_camera.cast<float>()}, offset{by(origin).cast<float>()} {}
  [[nodiscard]] inline Eigen::Vector3f operator()(const auto& p) const {
    return linear * p + offset;
  }
};

}  // namespace cilantro
