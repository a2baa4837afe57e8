#!/usr/bin/env bash
# Runs clang-tidy over the files that changed since a commit, the last one otherwise: scripts/tidy.sh [COMMIT]
# Needs the release build, whose compiled interfaces it reads.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

since=${1:-HEAD~1}
git rev-parse -q --verify "$since" > /dev/null || { echo "there is no $since to compare with"; exit 0; }
mapfile -t files < <(git diff --name-only --diff-filter=d "$since" -- 'modules/*.cpp')
[ ${#files[@]} -gt 0 ] || { echo "no unit changed since $since"; exit 0; }
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" clang-tidy-22 --quiet -p build/release --warnings-as-errors='*'
