#!/usr/bin/env bash
# Looks at a cloud by the program, as a user would, on the display of on_display.sh: view_command.sh CILANTRO
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

for x in 0 1 2; do for y in 0 1 2; do echo "$x $y 0"; done; done > grid.xyz
"$1" view grid.xyz --size 400,300 --point-size 40 --quiet > printed &
program=$!
# The middle is the middle of the grid.
timeout 60 xdotool search --sync --onlyvisible --name '^grid.xyz$' mousemove --window %1 200 150 \
  sleep 1 click --window 0 1 sleep 1 key --window 0 q
wait $program
grep -qx 'grid.xyz: point 4 at .*' printed || { echo "FAILED: the program printed: $(cat printed)"; exit 1; }
