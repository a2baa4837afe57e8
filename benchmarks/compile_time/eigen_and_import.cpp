// SPDX-License-Identifier: MIT
#include <Eigen/Dense>

import cilantro;

int unit() {
  return 0;
}
