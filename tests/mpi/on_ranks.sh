#!/usr/bin/env bash
# on_ranks.sh COUNT PROGRAM [ARGUMENT...]: runs the program as that many ranks, on this machine.
set -euo pipefail
count=$1
shift
command -v mpirun > /dev/null || { echo 'skipped: mpirun is not installed'; exit 0; }
# It looks for graphics cards through any display that it finds, and dies with it: that of a test of windows, for example.
export HWLOC_COMPONENTS=-gl
options=()
# It refuses more ranks than processors, and root, as which containers run.
if mpirun --version | grep -q 'Open MPI\|OpenRTE'; then options=(--oversubscribe --allow-run-as-root --bind-to none); fi
exec mpirun "${options[@]}" -n "$count" "$@"
