#!/usr/bin/env bash
# Builds the benchmarks and runs all libraries on the same data:
#
#   scripts/benchmark.sh [THREADS [FILTER [--json FILE] [--svg FILE]]]
#
# PCL and Open3D take part where they are installed (libpcl-dev, libopen3d-dev).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

threads=${1:-1}
filter=${2:-.}
scripts/setup.sh benchmark
scripts/build.sh benchmark all
peers=build/benchmark/peers
cmake -S benchmarks/peers -B $peers -G Ninja -DCMAKE_BUILD_TYPE=Release > build/peers.log 2>&1 &&
  cmake --build $peers >> build/peers.log 2>&1 ||
  { tail -n 20 build/peers.log; echo 'the other libraries do not build here (see above): going on without them'; }

export OMP_NUM_THREADS=$threads CILANTRO_BENCHMARK_DATA=build/benchmark/data
# Without these, short runs measure how fast the kernel hands out fresh pages.
export GLIBC_TUNABLES=glibc.malloc.mmap_threshold=1073741824:glibc.malloc.trim_threshold=4294967296
mkdir -p $CILANTRO_BENCHMARK_DATA
build/benchmark/benchmarks/benchmark_data $CILANTRO_BENCHMARK_DATA
# In turn, several times, so that a change of the machine's speed meets all of them.
for round in 1 2 3; do
  for program in build/benchmark/benchmarks/*_benchmarks $peers/*_benchmarks; do
    [ -x "$program" ] || continue
    name=$(basename "$program" _benchmarks)
    "$program" --benchmark_filter="$filter" --benchmark_repetitions=3 --benchmark_min_time=0.2 \
      --benchmark_out_format=json --benchmark_out="$CILANTRO_BENCHMARK_DATA/$name.$round.json" > /dev/null
  done
done
python3 -B benchmarks/compare.py $CILANTRO_BENCHMARK_DATA "$threads" "${@:3}"
