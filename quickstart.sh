#!/usr/bin/env bash
# Builds cilantro, processes scans and aligns the second to the first: ./quickstart.sh [SCAN [SCAN]]
# A scan is a cloud or a 16-bit PNG depth image. One alone is aligned with itself, moved; without any,
# both are simulated. The result is in out/.
set -euo pipefail

fail() { printf 'cilantro: %s\n' "$*" >&2; exit 1; }

[ $# -le 2 ] || fail 'usage: ./quickstart.sh [SCAN [SCAN]], each a cloud or a 16-bit PNG depth image'
scans=()
for scan in "$@"; do
  [ -f "$scan" ] && [ -r "$scan" ] || fail "$scan is not a file that can be read: name a cloud, such as a PLY file, or a 16-bit PNG depth image, or none."
  scans+=("$(realpath "$scan")")
done
cd "$(dirname "${BASH_SOURCE[0]}")"

scripts/setup.sh run
scripts/build.sh release quickstart
build/release/examples/quickstart "${scans[@]}"
