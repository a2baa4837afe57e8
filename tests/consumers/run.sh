#!/usr/bin/env bash
# Configures, builds and runs the consumer project: run.sh BUILD_FOLDER COMPILER CMAKE_ARGUMENT...
set -euo pipefail
folder=$1 compiler=$2
shift 2
rm -rf "$folder"
cmake -S "$(dirname "${BASH_SOURCE[0]}")" -B "$folder" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" "$@"
cmake --build "$folder"
"$folder/import_only" "$folder/cloud.ply"
"$folder/eigen_first"
rm -rf "$folder"
