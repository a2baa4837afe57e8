#!/usr/bin/env bash
# Makes the Debian packages of the library (libcilantro-dev, and its components) and of the program (cilantro) for the Debian that it runs on,
# in build/packages.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

[ $# = 0 ] || { echo 'usage: scripts/packages.sh' >&2; exit 2; }
scripts/setup.sh test
scripts/build.sh release cilantro_tool
rm -rf build/packages
(cd build/release && cpack -B ../packages > ../packages.log 2>&1) || { cat build/packages.log >&2; exit 1; }
rm -rf build/packages/_CPack_Packages
ls build/packages/*.deb
