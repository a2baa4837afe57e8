// message: contains
import cilantro;

struct shape {
  bool has(const Eigen::Vector3d&) const;
};

auto inside(const cilantro::point_cloud<float, 3>& cloud) {
  return cilantro::crop(cloud, shape{});
}
