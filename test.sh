#!/usr/bin/env bash
# Builds cilantro in release mode and runs all tests.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

scripts/setup.sh test
scripts/build.sh release all
ctest --preset release -j "$(nproc)"
