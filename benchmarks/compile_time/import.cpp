// SPDX-License-Identifier: MIT
import cilantro;

int unit() {
  return 0;
}
