// SPDX-License-Identifier: MIT
// message: 'DepthConverter<
import cilantro;

struct for_text {
  double operator()(const char*) const { return 0; }
};

int main() {
  const cilantro::image<float> depth(4, 4);
  return cilantro::to_depth<float>(depth, for_text{}).width();
}
