// SPDX-License-Identifier: MIT
// message: does not satisfy 'PointsSource'
import cilantro;

struct my_scan {};

int main() {
  return static_cast<int>(cilantro::count_non_finite(my_scan{}));
}
