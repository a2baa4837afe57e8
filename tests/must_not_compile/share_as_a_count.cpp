// message: no matching function for call to 'random_sample'
import cilantro;

auto tenth(const cilantro::point_cloud<float, 3>& cloud) {
  return cilantro::random_sample(cloud, 0.1);
}
