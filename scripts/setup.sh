#!/usr/bin/env bash
# Installs what cilantro is built with, from the Debian archives that this machine already uses.
#
#   scripts/setup.sh run        what the library and the quickstart need
#   scripts/setup.sh test       that, and what the tests need
#   scripts/setup.sh check      that, and what formatting, the sanitizers and fuzzing need
#   scripts/setup.sh package    what the library, its components and the program need, and what makes Debian packages of them
#   scripts/setup.sh benchmark  what the library and the benchmarks need, without the peers
#   scripts/setup.sh site       what the site of documentation is built with, which is not the library
#   scripts/setup.sh arm64      what tests need, and what building and running them for arm64 needs
#
# Installs nothing, and needs neither root nor a network, when everything is there.
set -euo pipefail

fail() { printf 'cilantro: %s\n' "$*" >&2; exit 1; }

# package | why it is needed
packages_to_run='
clang-22|the compiler: the oldest Debian ships that can build Eigen as a C++20 module
clang-tools-22|clang-scan-deps, which tells CMake the order of modules
libomp-22-dev|OpenMP for clang-22
cmake|the build system, 3.28 or newer for C++20 modules
ninja-build|the build tool; the only one with which CMake builds modules
libc6-dev|the C library headers
libstdc++-dev|the C++ standard library headers
libeigen3-dev|Eigen, the linear algebra
libpng-dev|libpng, for depth images and pictures
libjpeg62-turbo-dev|libjpeg, for pictures
liblzf-dev|liblzf, for compressed PCD files
libqhull-dev|Qhull, for convex hulls
'
packages_to_test='
doctest-dev|doctest, the test framework
libcli11-dev|CLI11, for the command line of the program cilantro
nlohmann-json3-dev|JSON, for what that program prints
python3-minimal|runs the checks of the source tree and of the documentation
valgrind|counts instructions of the main steps
'
packages_for_components='
libglfw3-dev|GLFW, for windows on the screen
libgl-dev|the headers of OpenGL, for the same
libegl-dev|those of EGL, by which graphics cards draw without a display
libopenmpi-dev|Open MPI, for ranks on several machines
'
packages_to_package='
file|tells programs from texts
dpkg-dev|finds out which packages a program needs
'
packages_to_check='
clang-format-22|clang-format, which says whether a file is formatted
clang-tidy-22|clang-tidy, which finds what a compiler does not see
libclang-rt-22-dev|the run-time libraries of the sanitizers and of the fuzzer
libgl1-mesa-dri|a driver of OpenGL for machines without a graphics card, on which windows are tested
openmpi-bin|mpirun, which starts them in tests
xvfb|a display that nobody sees, for the same
xdotool|a mouse and keys that nobody touches, for the same
'
packages_to_benchmark='
libbenchmark-dev|Google Benchmark
'
packages_to_test_and_benchmark='
libnanoflann-dev|nanoflann, for an example and to compare with
'
packages_for_arm64='
lld-22|the linker, which knows other machines than this one
qemu-user-static|runs programs for arm64 here
'
packages_for_site='
python3-sphinx|Sphinx, which makes a site of pages
python3-myst-parser|MyST, by which Sphinx reads Markdown
furo|Furo, how the site looks
'

mode=${1:-run}
case $mode in
  run) wanted=$packages_to_run ;;
  test) wanted=$packages_to_run$packages_to_test$packages_to_test_and_benchmark ;;
  check) wanted=$packages_to_run$packages_to_test$packages_to_test_and_benchmark$packages_for_components$packages_to_check ;;
  package) wanted=$packages_to_run$packages_to_test$packages_for_components$packages_to_package ;;
  benchmark) wanted=$packages_to_run$packages_to_benchmark$packages_to_test_and_benchmark ;;
  arm64) wanted=$packages_to_run$packages_to_test$packages_to_test_and_benchmark$packages_for_arm64 ;;
  site) wanted=$packages_for_site ;;
  *) fail "usage: scripts/setup.sh run|test|check|package|benchmark|site|arm64" ;;
esac

is_installed() {
  case $1 in
    # The package carries a version in its name; the compiler needs any one of them.
    libstdc++-dev) compgen -G '/usr/include/c++/[0-9]*/vector' > /dev/null ;;
    *) [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2> /dev/null)" = installed ] ;;
  esac
}

# Anything from `cmake --version` counts, also one that was not installed by apt.
cmake_is_new_enough() {
  local version
  version=$(cmake --version 2> /dev/null | sed -n '1s/cmake version //p')
  [ -n "$version" ] && [ "$(printf '%s\n' 3.28 "$version" | sort -V | head -n 1)" = 3.28 ]
}

missing=()
while IFS='|' read -r name why; do
  [ -n "$name" ] || continue
  if [ "$name" = cmake ]; then cmake_is_new_enough && continue; else is_installed "$name" && continue; fi
  [ ${#missing[@]} -gt 0 ] || echo 'cilantro needs these Debian packages, which are not installed yet:'
  printf '  %-18s %s\n' "$name" "$why"
  missing+=("$name")
done <<< "$wanted"
[ ${#missing[@]} -gt 0 ] || exit 0

. /etc/os-release 2> /dev/null || true
[ "${ID:-}" = debian ] && [[ "${VERSION_ID:-}" =~ ^(12|13)$ ]] ||
  fail "this is ${PRETTY_NAME:-an unknown system}, and only Debian 12 and 13 are set up automatically: install the packages above by hand, then build with \`cmake --preset release && cmake --build --preset release\`."

as_root=()
if [ "$(id -u)" != 0 ]; then
  command -v sudo > /dev/null && sudo -n true 2> /dev/null ||
    fail 'packages have to be installed: run this as root, or as a user whose sudo asks for no password.'
  as_root=(sudo -n)
fi
apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300 "$@"; }

log=$(mktemp)
trap 'rm -f "$log"' EXIT
run_apt() {
  apt "$@" > "$log" 2>&1 || { tail -n 15 "$log" >&2; return 1; }
}

# Debian 12 has CMake 3.25, its backports have a newer one. The source is derived from the one that
# is configured, so that whatever mirror the machine uses is used again.
add_backports() {
  local list=/etc/apt/sources.list.d/cilantro-backports.sources uri signed
  [ -e "$list" ] && return
  # A deb822 stanza, or a one-line source, that offers the suite "bookworm" itself.
  local stanza
  stanza=$(cat /etc/apt/sources.list.d/*.sources 2> /dev/null |
    awk 'BEGIN { RS = ""; ORS = "\n\n" } /(^|\n)Suites:([^\n]*[ \t])?bookworm([ \t]|\n|$)/ { print; exit }')
  uri=$(sed -n 's/^URIs:[[:space:]]*\([^[:space:]]*\).*/\1/p' <<< "$stanza")
  signed=$(sed -n 's/^Signed-By:[[:space:]]*\(\/[^[:space:]]*\).*/\1/p' <<< "$stanza")
  [ -n "$uri" ] || uri=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list 2> /dev/null |
    sed -n 's/^deb[[:space:]]\{1,\}\(\[[^]]*\][[:space:]]*\)\{0,1\}\([^[:space:]]*\)[[:space:]]\{1,\}bookworm[[:space:]].*/\2/p' |
    head -n 1)
  [ -n "$uri" ] || fail 'no Debian archive is configured in /etc/apt: add one, then run this again.'
  echo "adding bookworm-backports from $uri, for CMake 3.28 or newer"
  printf 'Types: deb\nURIs: %s\nSuites: bookworm-backports\nComponents: main\nSigned-By: %s\n' \
    "$uri" "${signed:-/usr/share/keyrings/debian-archive-keyring.gpg}" | "${as_root[@]}" tee "$list" > /dev/null
}

pick=()
for name in "${missing[@]}"; do
  case $name in
    libstdc++-dev) [ "$VERSION_ID" = 12 ] && pick+=(libstdc++-12-dev) || pick+=(libstdc++-14-dev) ;;
    cmake) [ "$VERSION_ID" = 12 ] && { add_backports; pick+=(cmake/bookworm-backports cmake-data/bookworm-backports); } || pick+=(cmake) ;;
    *) pick+=("$name") ;;
  esac
done

echo 'installing them with apt-get ...'
run_apt update || fail 'apt-get update failed (see above): check the network and the sources in /etc/apt, then run this again.'
# apt-get calls it no failure if an archive was not reached, and one may be down that is not needed.
unreached=$(grep -o 'Failed to fetch [^ ]*' "$log" | head -n 1 || true)
refuse() { [ -z "$unreached" ] || fail "an archive cannot be reached (${unreached,}): check the network, then run this again."; fail "$1"; }
[ "$mode" = site ] || apt-cache show clang-22 > /dev/null 2>&1 || is_installed clang-22 ||
  refuse "clang-22 is in none of the configured archives: add Debian's security archive (suite ${VERSION_CODENAME}-security) to /etc/apt/sources.list, then run this again."
run_apt install -y --no-install-recommends "${pick[@]}" ||
  refuse 'apt-get install failed (see above): put right what it names, then run this again.'
[ "$mode" = site ] || cmake_is_new_enough || fail 'the cmake found first in PATH is still older than 3.28: put /usr/bin first, then run this again.'
