#!/usr/bin/env bash
# Builds the benchmarks and runs all libraries on the same data, in turn and round after round, so that a
# change of the machine's speed meets all of them. PCL, Open3D, VTK and OpenGL take part where they are
# installed (libpcl-dev, libopen3d-dev, libvtk9-dev, libegl-dev and libgl-dev). Prints tables.
#
#   benchmarks/run.sh [WHAT] [OPTIONS]
#
#   tasks (if not given)   everything, on one scan and one large cloud
#   sizes                  trees, searches, normals and voxels of 10^4 to 10^7 points, and of uneven ones
#   sequence               normals of each of a sequence of frames, and each frame aligned to the one before
#   global                 all pairs of these frames aligned from anywhere, and pairs that are generated; once, with
#                          --threads only, and --filter is for names as of cilantro_plain and open3d_fgr
#
#   --threads "1 2"  numbers of threads, one run each; 1 and as many as there are cores if not given
#   --rounds N       5 if not given
#   --filter REGEX   only some tasks
#   --json FILE      writes a row a task, data, library and number of threads
#   --svg FILE       draws them (needs python3-matplotlib)
#   --fresh-pages    leaves the allocator as it is: short runs then measure how fast the kernel hands out pages
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() { printf 'cilantro: %s\n' "$*" >&2; exit 1; }

what=tasks rounds='' filter='' threads="1 $(nproc)" json='' svg='' fresh=''
while [ $# -gt 0 ]; do
  case $1 in
    tasks | sizes | sequence | global) what=$1 ;;
    --threads) threads=$2; shift ;;
    --rounds) rounds=$2; shift ;;
    --filter) filter=$2; shift ;;
    --json) json=$2; shift ;;
    --svg) svg=$2; shift ;;
    --fresh-pages) fresh=1 ;;
    *) fail "unknown: $1 (the head of benchmarks/run.sh lists what there is)" ;;
  esac
  shift
done

scripts/setup.sh benchmark
scripts/build.sh benchmark all
peers=build/benchmark/peers
cmake -S benchmarks/peers -B $peers -G Ninja -DCMAKE_BUILD_TYPE=Release > build/peers.log 2>&1 &&
  cmake --build $peers >> build/peers.log 2>&1 ||
  { tail -n 20 build/peers.log; echo 'the other libraries do not build here (see above): going on without them'; }

data=build/benchmark/data/$what results=build/benchmark/results/$what
mkdir -p $data
build/benchmark/benchmarks/benchmark_data $what $data
rm -rf $results
[ "$fresh" ] || export GLIBC_TUNABLES=glibc.malloc.mmap_threshold=1073741824:glibc.malloc.trim_threshold=4294967296

if [ $what = global ]; then
  ours=build/benchmark/benchmarks/global_cilantro other=$peers/global_open3d found=()
  mkdir -p $results
  run() { [[ $1 =~ ${filter:-.} ]] && "${@:2}" && found+=("$results/$count/$1.txt"); }
  for count in $threads; do
    export OMP_NUM_THREADS=$count
    mkdir -p "$results/$count"
    for how in viewpoints plain; do run cilantro_$how $ours pairs $data "$results/$count/cilantro_$how.txt" "$count" $how || true; done
    for how in samples graduated; do
      run cilantro_$how $ours pairs $data "$results/$count/cilantro_$how.txt" "$count" viewpoints $how || true
    done
    [ ! -x $other ] || for how in ransac fgr; do run open3d_$how $other pairs $data "$results/$count/open3d_$how.txt" $how || true; done
  done
  python3 -B benchmarks/global.py $data "${found[@]}"
  export OMP_NUM_THREADS=1
  $ours figures $data
  [ ! -x $other ] || $other figures $data
  exit
fi

# VTK and Open3D draw with a display only.
if [ -z "${DISPLAY:-}" ] && command -v Xvfb > /dev/null; then
  exec {display}< <(exec Xvfb -displayfd 1 -screen 0 1280x1024x24 2> build/xvfb.log)
  trap 'kill $xvfb' EXIT
  xvfb=$!
  read -r DISPLAY <&$display
  export DISPLAY=:$DISPLAY
fi

# All programs once: on what data, with how many threads, which round, what tasks.
one_round() {
  local folder=$results/$1.$2
  mkdir -p "$folder"
  for program in build/benchmark/benchmarks/*_benchmarks $peers/*_benchmarks; do
    [ -x "$program" ] || continue
    OMP_NUM_THREADS=$2 CILANTRO_BENCHMARK_DATA=$data CILANTRO_BENCHMARK_FRAME=$1 \
      "$program" --benchmark_filter="$4" --benchmark_min_warmup_time=0.001 --benchmark_min_time=0.1 \
      --benchmark_out_format=json --benchmark_out="$folder/$(basename "$program" _benchmarks).$3.json" \
      > $results/log.txt 2>&1 || { tail -n 5 $results/log.txt >&2; fail "$program failed"; }
  done
}

sets=frame rounds=${rounds:-5}
case $what in
  tasks) filter=${filter:-.} ;;
  sizes) filter=${filter:-^(tree_build|knn_of_all|normals|voxels)/} ;;
  sequence) filter=${filter:-^normals} ;;
esac
[ $what = tasks ] || sets=$(cat $data/sets.txt)
for count in $threads; do
  for set in $sets; do
    for round in $(seq "$rounds"); do one_round "$set" "$count" "$round" "$filter"; done
  done
  if [ $what = sequence ]; then
    for round in $(seq "$rounds"); do one_round pairs "$count" "$round" '^icp_'; done
  fi
done
python3 -B benchmarks/compare.py $results $data ${json:+--json "$json"}
[ -z "$svg" ] || python3 -B benchmarks/plot.py $results $data $what "$svg"
