#!/usr/bin/env bash
# Looks for data races with the thread sanitizer, and for results that depend on the number of threads or on how the
# library is optimised: the main functions on made-up points, with four threads under the sanitizer, with one as users
# run them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

for preset in release tsan; do scripts/build.sh $preset fingerprint; done
OMP_NUM_THREADS=1 build/release/tests/fingerprint > build/one-thread.txt
# OpenMP's runtime has to tell who waits for whom.
OMP_TOOL_LIBRARIES=/usr/lib/llvm-22/lib/libarcher.so TSAN_OPTIONS='ignore_noninstrumented_modules=1 halt_on_error=1' \
  OMP_NUM_THREADS=4 build/tsan/tests/fingerprint > build/four-threads.txt
diff build/one-thread.txt build/four-threads.txt ||
  { echo 'cilantro: these have other bits with four threads than with one.' >&2; exit 1; }
echo "$(wc -l < build/one-thread.txt) results have the same bits with one thread and with four, and no race was seen"
