#!/usr/bin/env bash
# Times what a consumer pays: its first build of the interfaces, and then each unit, the median of seven.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/build.sh release cilantro
folder=build/compile_time
rm -rf $folder
cmake --install build/release --prefix $folder/prefix > /dev/null
cmake -S benchmarks/compile_time -B $folder/build -G Ninja -DCMAKE_CXX_COMPILER=clang++-22 \
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$PWD/$folder/prefix" > /dev/null
seconds() { local begin=$EPOCHREALTIME; "$@" > /dev/null 2>&1; bc <<< "$EPOCHREALTIME - $begin"; }
printf '%-18s %s s, %s\n' 'all, once' "$(seconds cmake --build $folder/build)" \
  "$(du -ch $folder/build/CMakeFiles/*synth*/*.bmi | tail -n 1 | cut -f 1) of compiled interfaces"
for unit in empty import pipeline own_step eigen eigen_and_import; do
  command=$(ninja -C $folder/build -t commands units | grep -- "-c .*/$unit\.cpp" | grep -v scan-deps)
  for i in 1 2 3 4 5 6 7; do (cd $folder/build && seconds bash -c "$command"); done |
    sort -n | sed -n 4p | xargs printf '%-18s %.2f s\n' $unit
done
