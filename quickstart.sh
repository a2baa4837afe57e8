#!/usr/bin/env bash
# Builds cilantro and processes a scan: ./quickstart.sh [scan.ply | depth.png]
# Without a scan it simulates one. The result is in out/.
set -euo pipefail

fail() { printf 'cilantro: %s\n' "$*" >&2; exit 1; }

[ $# -le 1 ] || fail 'usage: ./quickstart.sh [scan.ply | depth.png]'
scan=()
if [ $# -eq 1 ]; then
  [ -f "$1" ] && [ -r "$1" ] || fail "$1 is not a file that can be read: name a PLY file or a 16-bit PNG depth image, or none."
  scan=("$(realpath "$1")")
fi
cd "$(dirname "${BASH_SOURCE[0]}")"

scripts/setup.sh run
scripts/build.sh release quickstart
build/release/examples/quickstart "${scan[@]}"
