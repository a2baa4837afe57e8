#!/usr/bin/env bash
# Configures a preset where that has not been done, and builds targets: scripts/build.sh PRESET TARGET...
# Says little unless something fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() { printf 'cilantro: %s\n' "$*" >&2; exit 1; }

[ $# -ge 2 ] || fail 'usage: scripts/build.sh PRESET TARGET..., such as scripts/build.sh release all'
preset=$1
targets=("${@:2}")
log=$(mktemp)
trap 'rm -f "$log"' EXIT

# The quickstart can do without what only the tests need; a folder that has the tests keeps them.
tests=OFF
[[ ${targets[0]} =~ ^(all|cilantro_tests|fingerprint|differential_answers)$ ]] && [ "$preset" != benchmark ] && tests=ON
if [ $tests = ON ] || [ ! -e "build/$preset/build.ninja" ]; then
  cmake --preset "$preset" -DCILANTRO_BUILD_TESTS=$tests > "$log" 2>&1 ||
    { cat "$log" >&2; fail "configuring failed (see above): put right what CMake names, or remove build/$preset to start afresh."; }
fi
[ -e "build/$preset/libcilantro.a" ] || echo "building ${targets[*]} in build/$preset, which takes some minutes the first time ..."
cmake --build "build/$preset" --target "${targets[@]}" > "$log" 2>&1 ||
  { tail -n 40 "$log" >&2; fail "building failed (see above): if you changed no source, remove build/$preset and run this again."; }
