// SPDX-License-Identifier: MIT
// message: SimilarityFunction
import cilantro;

struct no_answer {
  void operator()(cilantro::index_t, cilantro::index_t, float) const {}
};

int main() {
  const cilantro::all_similar both{no_answer{}};
  return both(0, 1, 0.5f);
}
