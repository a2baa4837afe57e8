#!/usr/bin/env bash
# Fuzzes the readers of files and what is made of any numbers, under the sanitizers: scripts/fuzz.sh SECONDS [TARGET...]
# What it finds stays in build/fuzz; an input that fails is named on the last lines.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-60}
targets=${*:2}
for target in ${targets:-ply pcd las e57 ptx text matrix polytope triangulation warp}; do
  scripts/build.sh asan-ubsan fuzz_"$target"
  found=build/fuzz/$target
  mkdir -p "$found"
  echo "$target:"
  build/asan-ubsan/tests/fuzz/fuzz_"$target" -max_total_time="$seconds" -max_len=4096 -rss_limit_mb=1024 \
    -timeout=5 -print_final_stats=1 -artifact_prefix="$found/" "$found" "tests/fuzz/corpus/$target" 2>&1 |
    tee "build/fuzz-$target.log" | grep -E 'DONE|stat::|ERROR|SUMMARY|Test unit' ||
    { tail -n 40 "build/fuzz-$target.log"; exit 1; }
done
