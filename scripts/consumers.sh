#!/usr/bin/env bash
# Builds and runs projects that use cilantro as others do: scripts/consumers.sh [CASE...]
#
# Each is built from the installed package; what ends in /within builds the library within the project. Without
# names, all; --list names them. What cannot work must be refused in configuration, by the words that stand here.
#
#   CILANTRO_PREFIX    an installed cilantro, instead of the release build's
#   CXX                the compiler, clang++-22 otherwise
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source=$PWD
compiler=${CXX:-clang++-22}
folder=build/consumers
projects=tests/consumers

cases=(default_settings release debug refusals mixed exports from_gcc component component/within window mpi
  standard_23 standard_26 extensions_on extensions_off openmp_flag warnings undefined_sanitizer thread_sanitizer
  unoptimized march_native other_alignment static with_pcl with_open3d
  objects/within areas/within fetch/within shared/within march_native/within address_sanitizer/within)

configure() {  # PROJECT [ARGUMENT...]: into $build
  local project=$1
  shift
  cmake -S "$project" -B "$build" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_PREFIX_PATH="$prefix" "$@"
}
run_consumer() { "$build/import_only" "$build/cloud.ply" && "$build/eigen_first"; }
consume() { configure $projects "$@" && cmake --build "$build" && run_consumer; }
# A first build says nothing of warnings, nor anything else that looks broken.
consume_silently() {
  consume "$@" 2>&1 | tee "$build.first"
  ! grep -iE 'warning|unused' "$build.first"
}
project() { configure "$@" && cmake --build "$build"; }
within() { consume -DCILANTRO_SOURCE="$source" "$@"; }
# Its last argument: a part of the one sentence that must say why.
refuse() { refuse_project $projects "$@"; }
refuse_project() {
  local because=${*: -1} said
  rm -rf "$build"
  said=$(configure "${@:1:$#-1}" 2>&1) && { echo "not refused: $because"; return 1; }
  tr -s '\n ' ' ' <<< "$said" | sed 's|.*CMake Error|CMake Error|' | grep -F "$because"
}
skip() { echo "skipped: $*"; return 77; }

run_case() {
  case $1 in
    default_settings) consume_silently ;;
    release) consume -DCMAKE_BUILD_TYPE=Release ;;
    debug) consume -DCMAKE_BUILD_TYPE=Debug ;;
    standard_23) consume_silently -DCMAKE_CXX_STANDARD=23 ;;
    standard_26) consume -DCMAKE_CXX_STANDARD=26 ;;
    extensions_on) consume -DCMAKE_CXX_STANDARD=20 -DCMAKE_CXX_EXTENSIONS=ON ;;
    extensions_off) consume_silently -DCMAKE_CXX_STANDARD=20 -DCMAKE_CXX_EXTENSIONS=OFF ;;
    openmp_flag) consume_silently -DCONSUMER_OPTIONS=-fopenmp ;;
    warnings) consume '-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror' ;;
    undefined_sanitizer) consume -DCMAKE_CXX_FLAGS=-fsanitize=undefined ;;
    # The runtime of OpenMP is not compiled for it; a tool of its tells who waits for whom.
    thread_sanitizer)
      export OMP_TOOL_LIBRARIES=/usr/lib/llvm-22/lib/libarcher.so TSAN_OPTIONS=ignore_noninstrumented_modules=1
      consume -DCONSUMER_OPTIONS=-fsanitize=thread ;;
    unoptimized) consume -DCMAKE_CXX_FLAGS=-O0 ;;
    static) consume -DCMAKE_EXE_LINKER_FLAGS=-static-libstdc++ -DBUILD_SHARED_LIBS=OFF ;;
    march_native)
      # Not grep -q, which leaves early: a compiler that cannot write what is left fails.
      if "$compiler" -march=native -dM -E -x c++ /dev/null | grep __AVX__; then
        refuse -DCMAKE_CXX_FLAGS=-march=native 'is compiled with -march=native, under which Eigen allocates'
      else
        consume -DCMAKE_CXX_FLAGS=-march=native
      fi ;;
    other_alignment)
      refuse -DCMAKE_CXX_FLAGS=-DEIGEN_MAX_ALIGN_BYTES=64 'must be compiled with EIGEN_MAX_ALIGN_BYTES=16' ;;
    refusals)
      refuse -DCMAKE_CXX_FLAGS=-mavx 'is compiled with -mavx, under which Eigen allocates'
      refuse -DCONSUMER_OPTIONS=-fsanitize=address 'is compiled with -fsanitize=address, under which'
      local other=$PWD/$build.eigen/Eigen/src/Core/util
      mkdir -p "$other"
      printf '#define EIGEN_%s_VERSION 3\n' WORLD MAJOR MINOR > "$other/Macros.h"
      refuse -DCONSUMER_INCLUDES="$PWD/$build.eigen" 'finds Eigen 3.3.3 in'
      # Without make, CMake itself refuses.
      if command -v make > /dev/null; then refuse -G 'Unix Makefiles' 'which need the Ninja generator'; fi
      refuse -DCILANTRO_SOURCE="$source" -DCONSUMER_OPTIONS=-mavx 'is compiled with -mavx, under which Eigen allocates' ;;
    mixed)
      project $projects/mixed
      for name in plain strict with_openmp/parallel; do "$build/$name"; done ;;
    exports)
      local installed=$PWD/$build/installed
      project $projects/exports/library -DCMAKE_INSTALL_PREFIX="$installed"
      cmake --install "$build"
      prefix="$installed;$prefix" build=$build/program project $projects/exports/program
      "$build/program/program" ;;
    from_gcc)
      cmake -S examples/from_gcc -B "$build" -G Ninja -DCLANG="$compiler" -DCMAKE_PREFIX_PATH="$prefix"
      cmake --build "$build"
      "$build/installed/bin/program" ;;
    # One that is built for what is installed, and put beside it; areas can be asked for as components can.
    component)
      local installed=$PWD/$build/installed
      project $projects/component/empty -DCMAKE_INSTALL_PREFIX="$installed"
      cmake --install "$build"
      prefix="$installed;$prefix" build=$build/program project $projects/component/program "-DCONSUMER_COMPONENT=empty;registration"
      "$build/program/program"
      refuse_project $projects/component/program -DCONSUMER_COMPONENT=none 'there is no component "none" beside this cilantro' ;;
    # One of the tree: not in the library, and not at all unless it is asked for.
    component/within)
      mkdir -p "$build/tree"
      cp -r CMakeLists.txt cmake modules "$build/tree"
      cp -r $projects/component/empty "$build/tree/modules"
      local within=(cmake -S "$build/tree" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" -DCILANTRO_BUILD_TESTS=OFF -DCILANTRO_BUILD_EXAMPLES=OFF)
      "${within[@]}" -B "$build/without"
      "${within[@]}" -B "$build/with" -DCILANTRO_BUILD_EMPTY=ON
      if ninja -C "$build/without" -t targets all | grep empty; then echo 'the component is not left out'; return 1; fi
      if ninja -C "$build/with" -t inputs libcilantro.a | grep empty; then echo 'the component is in the library'; return 1; fi
      cmake --build "$build/with" --target modules/empty/CMakeFiles/cilantro_empty.dir/empty.cpp.o ;;
    window)
      [ -n "$(find "$prefix" -path '*/cmake/cilantro-window')" ] || skip 'windows were not built, since libglfw3-dev is not installed'
      project $projects/window
      "$build/program" ;;
    mpi)
      [ -n "$(find "$prefix" -path '*/cmake/cilantro-mpi')" ] || skip 'ranks were not built, since libopenmpi-dev is not installed'
      project $projects/mpi
      tests/mpi/on_ranks.sh 2 "$build/program" ;;
    with_pcl | with_open3d)
      local name=${1#with_}
      compgen -G "/usr/lib/*/cmake/$name" > /dev/null || compgen -G "/usr/lib/*/cmake/${name/open3d/Open3D}" > /dev/null ||
        skip "lib$name-dev is not installed"
      project $projects/$1
      "$build/program" ;;
    # Its interfaces and what imports them; that the library itself compiles so, others show.
    objects/within)
      configure $projects -DCILANTRO_SOURCE="$source" -DCMAKE_CXX_STANDARD=23 -DCMAKE_CXX_EXTENSIONS=OFF
      cmake --build "$build" --target CMakeFiles/import_only.dir/import_only.cpp.o CMakeFiles/eigen_first.dir/eigen_first.cpp.o ;;
    # What reads, writes and filters clouds, without registration, tiles and the like.
    areas/within)
      configure $projects -DCILANTRO_SOURCE="$source" -DCILANTRO_AREAS=io
      ninja -C "$build" -t inputs cilantro/libcilantro.a > "$build/inputs"
      grep -q modules/io/ "$build/inputs"
      if grep -E 'modules/(registration|warp|features|tiles|spatial|clustering|consensus|embedding)/' "$build/inputs"; then return 1; fi
      cmake --build "$build" --target import_only
      "$build/import_only" "$build/cloud.ply"
      refuse -DCILANTRO_SOURCE="$source" -DCILANTRO_AREAS=tile 'CILANTRO_AREAS names tile, which is no area of cilantro'
      refuse -DCILANTRO_SOURCE="$source" "-DCILANTRO_AREAS=all;io" 'CILANTRO_AREAS names all beside others'
      refuse -DCILANTRO_SOURCE="$source" -DCILANTRO_AREAS=window 'CILANTRO_AREAS names window, which is a component' ;;
    fetch/within) project $projects/fetch -DCILANTRO_SOURCE="$source" && "$build/program" ;;
    shared/within) within -DBUILD_SHARED_LIBS=ON ;;
    march_native/within) within -DCMAKE_CXX_FLAGS=-march=native ;;
    address_sanitizer/within) within -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS=-fsanitize=address ;;
    *) echo "there is no case $1"; return 2 ;;
  esac
}

[ "${1:-}" != --list ] || { printf '%s\n' "${cases[@]}"; exit; }
mkdir -p $folder
if [ -z "${CILANTRO_PREFIX:-}" ]; then
  scripts/build.sh release all
  CILANTRO_PREFIX=$PWD/$folder/prefix
  cmake --install build/release --prefix "$CILANTRO_PREFIX" > /dev/null
fi
failed=0
[ $# -gt 0 ] || set -- "${cases[@]}"
for name in "$@"; do
  build=$folder/${name/\//_} prefix=$CILANTRO_PREFIX
  rm -rf "$build"
  begin=$SECONDS status=0
  # Apart, so that errors end it: they do not where a status is asked for.
  set +e
  (set -e; run_case "$name") > "$build.log" 2>&1
  status=$?
  set -e
  case $status in
    0) result=passed ;;
    77) result=$(tail -n 1 "$build.log") ;;
    *) result="FAILED: $build.log" failed=1 ;;
  esac
  printf '%-28s %4d s  %s\n' "$name" $((SECONDS - begin)) "$result"
  [ $status != 0 ] && [ $status != 77 ] && tail -n 25 "$build.log"
  rm -rf "$build" "$build.eigen"
done
exit $failed
