#!/usr/bin/env bash
# Fuzzes the PLY reader under the sanitizers: scripts/fuzz.sh SECONDS
# What it finds stays in build/fuzz; an input that fails is named on the last lines.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-60}
scripts/build.sh asan-ubsan fuzz_read_ply
mkdir -p build/fuzz
build/asan-ubsan/tests/fuzz/fuzz_read_ply -max_total_time="$seconds" -max_len=4096 -rss_limit_mb=1024 \
  -timeout=5 -print_final_stats=1 -artifact_prefix=build/fuzz/ build/fuzz tests/fuzz/corpus 2>&1 |
  tee build/fuzz.log | grep -E 'DONE|stat::|ERROR|SUMMARY|Test unit' || { tail -n 40 build/fuzz.log; exit 1; }
