#!/usr/bin/env bash
# Fuzzes the readers of files and what is made of any numbers, under the sanitizers: scripts/fuzz.sh SECONDS [TARGET...]
# What it finds stays in build/fuzz; an input that fails is named on the last lines.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-60}
read -ra targets <<< "${*:2}"
[ ${#targets[@]} != 0 ] || targets=(ply pcd las e57 ptx text matrix polytope triangulation warp)

fuzz() {
  local target=$1 found=build/fuzz/$1
  mkdir -p "$found"
  if build/asan-ubsan/tests/fuzz/fuzz_"$target" -max_total_time="$seconds" -max_len=4096 -rss_limit_mb=1024 \
    -timeout=5 -print_final_stats=1 -artifact_prefix="$found/" "$found" "tests/fuzz/corpus/$target" \
    > "build/fuzz-$target.log" 2>&1; then
    printf '%s: %s inputs\n' "$target" "$(sed -n 's/^stat::number_of_executed_units: *//p' "build/fuzz-$target.log")"
  else
    tail -n 40 "build/fuzz-$target.log"
    return 1
  fi
}
export -f fuzz
export seconds

scripts/build.sh asan-ubsan "${targets[@]/#/fuzz_}"
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -c 'fuzz {}'
