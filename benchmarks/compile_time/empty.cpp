// SPDX-License-Identifier: MIT
int unit() {
  return 0;
}
