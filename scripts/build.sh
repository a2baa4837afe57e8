#!/usr/bin/env bash
# Configures a preset where that has not been done, and builds a target: scripts/build.sh PRESET TARGET
# Says little unless something fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() { printf 'cilantro: %s\n' "$*" >&2; exit 1; }

preset=$1 target=$2
log=$(mktemp)
trap 'rm -f "$log"' EXIT

# The quickstart can do without what only the tests need; a folder that has the tests keeps them.
tests=()
[ "$target" = all ] && tests=(-DCILANTRO_BUILD_TESTS=ON)
if [ "$target" != all ] && [ ! -e "build/$preset/build.ninja" ]; then tests=(-DCILANTRO_BUILD_TESTS=OFF); fi
if [ ! -e "build/$preset/build.ninja" ] || [ ${#tests[@]} -gt 0 ]; then
  cmake --preset "$preset" "${tests[@]}" > "$log" 2>&1 ||
    { cat "$log" >&2; fail "configuring failed (see above): put right what CMake names, or remove build/$preset to start afresh."; }
fi
# Only a build that has something to do is worth a line, and only its progress is.
if ! ninja -C "build/$preset" -n "$target" 2> /dev/null | grep -q 'no work to do'; then
  echo "building $target in build/$preset; the first time takes some minutes ..."
  cmake --build "build/$preset" --target "$target" > "$log" 2>&1 ||
    { tail -n 40 "$log" >&2; fail "building failed (see above): if you changed no source, remove build/$preset and run this again."; }
fi
