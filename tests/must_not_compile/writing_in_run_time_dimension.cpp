// message: invalid operands to binary expression
import cilantro;

auto save(const cilantro::point_cloud<double, cilantro::dynamic>& cloud) {
  return cloud | cilantro::write_ply("out.ply");
}
