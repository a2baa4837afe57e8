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

# The quickstart can do without the tests, and without areas that it does not import; a folder that has them keeps them.
is_new=true
[ ! -e "build/$preset/build.ninja" ] || is_new=false
settings=()
case $preset/${targets[0]} in
  */quickstart) settings=(-DCILANTRO_BUILD_TESTS=OFF '-DCILANTRO_AREAS=registration;clustering;io') ;;
  benchmark/*) ;;
  */all | */cilantro_tests | */fingerprint | */differential_answers) settings=(-DCILANTRO_BUILD_TESTS=ON) ;;
  *) if $is_new; then settings=(-DCILANTRO_BUILD_TESTS=OFF); fi ;;
esac
if $is_new || [ "${targets[0]}" != quickstart ]; then
  cmake --preset "$preset" "${settings[@]}" > "$log" 2>&1 ||
    { cat "$log" >&2; fail "configuring failed (see above): put right what CMake names, or remove build/$preset to start afresh."; }
fi
[ -e "build/$preset/libcilantro.a" ] || echo "building ${targets[*]} in build/$preset, which takes some minutes the first time ..."
cmake --build "build/$preset" --target "${targets[@]}" > "$log" 2>&1 ||
  { tail -n 40 "$log" >&2; fail "building failed (see above): if you changed no source, remove build/$preset and run this again."; }
