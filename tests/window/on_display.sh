#!/usr/bin/env bash
# Runs a program with a display of its own, which nobody sees: on_display.sh PROGRAM ARGUMENT...
# What is on it is in the file CILANTRO_SCREEN, in the format of xwd.
set -euo pipefail

for needed in Xvfb xdotool; do
  command -v $needed > /dev/null || { echo "skipped: $needed is not installed"; exit 0; }
done
folder=$(mktemp -d)
server=
trap '[ -z "$server" ] || kill "$server"; wait; rm -rf "$folder"' EXIT
mkfifo "$folder/number"
# Otherwise it begins anew, and refuses who comes meanwhile, whenever the last window is gone.
Xvfb -noreset -displayfd 3 -screen 0 1800x1000x24 -fbdir "$folder" -nolisten tcp 3> "$folder/number" 2> "$folder/log" &
server=$!
read -r number < "$folder/number" || { cat "$folder/log"; exit 1; }
DISPLAY=:$number CILANTRO_SCREEN=$folder/Xvfb_screen0 LIBGL_ALWAYS_SOFTWARE=1 "$@"
