#!/usr/bin/env bash
# Looks for data races with the thread sanitizer, and for results that depend on the number of threads: the main
# functions on made-up points, with one thread and with four.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/build.sh tsan fingerprint
# OpenMP's runtime has to tell who waits for whom.
export OMP_TOOL_LIBRARIES=/usr/lib/llvm-22/lib/libarcher.so
export TSAN_OPTIONS='ignore_noninstrumented_modules=1 halt_on_error=1'
for threads in 1 4; do
  OMP_NUM_THREADS=$threads build/tsan/tests/fingerprint > build/threads-$threads.txt
done
diff build/threads-1.txt build/threads-4.txt ||
  { echo 'cilantro: these have other bits with four threads than with one.' >&2; exit 1; }
echo "$(wc -l < build/threads-1.txt) results have the same bits with one thread and with four, and no race was seen"
