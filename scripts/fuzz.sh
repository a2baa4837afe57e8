#!/usr/bin/env bash
# Fuzzes the readers of files under the sanitizers: scripts/fuzz.sh SECONDS [READER...]
# What it finds stays in build/fuzz; an input that fails is named on the last lines.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-60}
readers=${*:2}
for reader in ${readers:-ply pcd text matrix}; do
  scripts/build.sh asan-ubsan fuzz_read_"$reader"
  found=build/fuzz/$reader
  mkdir -p "$found"
  echo "$reader:"
  build/asan-ubsan/tests/fuzz/fuzz_read_"$reader" -max_total_time="$seconds" -max_len=4096 -rss_limit_mb=1024 \
    -timeout=5 -print_final_stats=1 -artifact_prefix="$found/" "$found" "tests/fuzz/corpus/$reader" 2>&1 |
    tee "build/fuzz-$reader.log" | grep -E 'DONE|stat::|ERROR|SUMMARY|Test unit' ||
    { tail -n 40 "build/fuzz-$reader.log"; exit 1; }
done
