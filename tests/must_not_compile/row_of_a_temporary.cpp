// message: will be destroyed at the end of the full-expression
import cilantro;

cilantro::neighborhoods<double> find();

auto nearest_of_first() {
  const auto first = find()[0];
  return first[0].index;
}
