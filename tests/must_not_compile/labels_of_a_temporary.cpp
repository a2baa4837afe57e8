// message: will be destroyed at the end of the full-expression
import cilantro;

cilantro::clusters segment();

int first_label() {
  const auto labels = segment().labels();
  return labels[0];
}
