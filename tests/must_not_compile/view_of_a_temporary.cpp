// message: will be destroyed at the end of the full-expression
import cilantro;

Eigen::Matrix3Xd make_points();

double first_x() {
  const auto view = cilantro::points_in(make_points());
  return view[0].x();
}
