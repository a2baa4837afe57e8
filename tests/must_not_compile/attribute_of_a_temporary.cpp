// message: will be destroyed at the end of the full-expression
import cilantro;

cilantro::point_cloud<float, 3> read();

float first_intensity() {
  const auto values = read().attribute_as<float>("intensity");
  return values[0];
}
