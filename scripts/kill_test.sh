#!/usr/bin/env bash
# Kills runs over tiles at random moments, and compares what they end with to a run that was left alone:
# scripts/kill_test.sh [KILLS] [SEED]
# Needs a release build with the program and the benchmarks. A run is resumed after each kill; once it is complete, it is
# begun anew. The last lines say how often it was killed, in which pass, and whether all results had the same hash.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

kills=${1:-100}
RANDOM=${2:-7}
survey=$PWD/build/release/benchmarks/survey_cilantro
program=$PWD/build/release/apps/cilantro/bin/cilantro
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

"$survey" make strips 600000 1 >/dev/null
"$program" tile 'strips/*.las' -o tiles --edge 40 >/dev/null
run=("$program" run tiles voxel=0.4 outliers=10:3 normals=knn:10 --resume -o)
# All that is in the folder, names and bytes.
hash_of() { (cd "$1" && find . -type f | LC_ALL=C sort | xargs sha256sum | sha256sum | cut -c1-16); }

begin=$(date +%s%N)
"${run[@]}" alone >/dev/null
# Half as long again as a run takes, in microseconds, so that some get to the end.
longest=$((3 * ($(date +%s%N) - begin) / 2000))
expected=$(hash_of alone)

killed=0 complete=0 wrong=0 first=0 last=0 elsewhere=0
check() {
  complete=$((complete + 1))
  [ "$(hash_of out)" = "$expected" ] || { wrong=$((wrong + 1)); ls out | head; }
  rm -rf out
}
while [ "$killed" -lt "$kills" ]; do
  "${run[@]}" out >/dev/null 2>errors &
  child=$!
  moment=$(((RANDOM * 32768 + RANDOM) % longest))
  sleep "$(printf '%d.%06d' $((moment / 1000000)) $((moment % 1000000)))"
  if kill -KILL $child 2>/dev/null; then
    status=0
    wait $child 2>/dev/null || status=$?
    if [ $status = 137 ]; then
      killed=$((killed + 1))
      if [ -e out/pass-1/tiles.index ]; then
        last=$((last + 1))
      elif [ -e out/pass-1 ]; then
        first=$((first + 1))
      else
        elsewhere=$((elsewhere + 1))
      fi
      continue
    fi
  else
    status=0
    wait $child || status=$?
  fi
  [ $status = 0 ] || { echo "a run that was resumed failed:"; cat errors; exit 1; }
  check
done
"${run[@]}" out >/dev/null
check
echo "$killed kills: $first in the first pass, $last after it, $elsewhere elsewhere"
echo "$complete results, $wrong of them not those of the run that was left alone ($expected)"
[ "$wrong" = 0 ]
