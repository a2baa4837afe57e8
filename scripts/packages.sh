#!/usr/bin/env bash
# Makes the Debian packages of the library (libcilantro-dev, and its components) and of the program (cilantro) for the Debian that it runs on,
# in build/packages.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

[ $# = 0 ] || { echo 'usage: scripts/packages.sh' >&2; exit 2; }
scripts/setup.sh package
mkdir -p build
parts=(-DCILANTRO_BUILD_VISUALIZATION=ON -DCILANTRO_BUILD_WINDOW=ON -DCILANTRO_BUILD_MPI=ON)
# In no package; a folder that has them keeps them.
[ -e build/release/build.ninja ] || parts+=(-DCILANTRO_BUILD_TESTS=OFF -DCILANTRO_BUILD_EXAMPLES=OFF)
cmake --preset release "${parts[@]}" > build/packages.log 2>&1 || { cat build/packages.log >&2; exit 1; }
scripts/build.sh release cilantro_visualization cilantro_window cilantro_mpi cilantro_tool cilantro_mpi_tool
rm -rf build/packages
(cd build/release && cpack -B ../packages > ../packages.log 2>&1) || { cat build/packages.log >&2; exit 1; }
rm -rf build/packages/_CPack_Packages
ls build/packages/*.deb
