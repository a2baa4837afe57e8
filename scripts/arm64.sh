#!/usr/bin/env bash
# Builds cilantro for arm64 on a machine of another kind, and runs it in an emulator:
#
#   scripts/arm64.sh          all tests but the consumers outside the tree, then the bits
#   scripts/arm64.sh kernels  the tests of what is written in vectors
#   scripts/arm64.sh bits     compares the bits of results with those on this machine
#
# On two busy cores the first build took 20 minutes, the tests then 33, and `bits` 6. The emulator is some 40 times as slow
# as the machine: most tests end within a minute, clustering/labelled_sets_data and registration/registration_data
# take 13.
# Debian's arm64 packages are unpacked into build/arm64-sysroot; nothing is installed for them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() { printf 'cilantro: %s\n' "$*" >&2; exit 1; }

mode=${1:-all}
[[ $mode =~ ^(all|kernels|bits)$ ]] || fail 'usage: scripts/arm64.sh [kernels|bits]'
sysroot=build/arm64-sysroot
kernels='^(search/.*|geometry/(normals|voxel_grid|depth)|clustering/kmeans|consensus/ransac|registration/(align|icp|estimator))$'
packages=(libc6-dev libeigen3-dev libpng-dev libjpeg62-turbo-dev liblzf-dev libqhull-dev libomp-22-dev
  doctest-dev libcli11-dev nlohmann-json3-dev libnanoflann-dev)

# apt as on an arm64 machine on which nothing is installed, with the archives that are configured here.
apt_for_arm64() {
  local tool=$1 state=$PWD/build/arm64-packages
  shift
  mkdir -p "$state"/{lists,archives}/partial
  : > "$state/status"
  "$tool" -q -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o APT::Sandbox::User=root \
    -o Dir::State="$state" -o Dir::State::lists="$state/lists" -o Dir::State::status="$state/status" \
    -o Dir::Cache="$state" -o Dir::Cache::archives="$state/archives" -o Debug::NoLocking=1 "$@"
}

unpack_sysroot() {
  local log=build/arm64-packages.log libstdcxx
  echo "unpacking Debian's arm64 packages into $sysroot ..."
  mkdir -p build
  rm -rf $sysroot.partial build/arm64-packages
  apt_for_arm64 apt-get update > $log 2>&1 ||
    { tail -n 15 $log >&2; fail 'apt-get update failed (see above): check the network and the sources in /etc/apt.'; }
  # Its name carries the version, and the newest is the one that fits the libraries.
  libstdcxx=$(apt_for_arm64 apt-cache pkgnames libstdc++- | grep -x 'libstdc++-[0-9]*-dev' | sort -V | tail -n 1)
  [ -n "$libstdcxx" ] ||
    fail 'no archive in /etc/apt has packages for arm64: add one that is not limited to another architecture.'
  apt_for_arm64 apt-get install -y --download-only --no-install-recommends "$libstdcxx" "${packages[@]}" > $log 2>&1 ||
    { tail -n 15 $log >&2; fail 'downloading failed (see above): put right what apt-get names, then run this again.'; }
  # Packages put files in both, and programs look in /lib.
  mkdir -p $sysroot.partial/usr/lib
  ln -sfn usr/lib $sysroot.partial/lib
  local package
  for package in build/arm64-packages/archives/*.deb; do
    dpkg-deb --fsys-tarfile "$package" | tar -x -C $sysroot.partial --keep-directory-symlink
  done
  # What is absolute there would lead out of it.
  local link to
  find $sysroot.partial -lname '/*' -printf '%P %l\n' | while read -r link to; do
    ln -sfnr "$sysroot.partial$to" "$sysroot.partial/$link"
  done
  mv $sysroot.partial $sysroot
  rm -rf build/arm64-packages build/arm64
}

compare_bits() {
  local machine depth=../shared/data/rgbd/7scenes_1000/frame-000000.depth.png
  [ -e $depth ] || depth=
  for machine in release arm64; do scripts/build.sh $machine fingerprint; done
  build/release/tests/fingerprint $depth > build/bits-here.txt
  qemu-aarch64-static -L $sysroot build/arm64/tests/fingerprint $depth > build/bits-arm64.txt
  diff build/bits-here.txt build/bits-arm64.txt > build/bits.diff ||
    { grep '^>' build/bits.diff | cut -c 20- >&2; fail 'these have other bits on arm64 than here.'; }
  echo "$(wc -l < build/bits-here.txt) results have the same bits on arm64 and here"
}

scripts/setup.sh arm64
[ -e $sysroot ] || unpack_sysroot
case $mode in
  all)
    scripts/build.sh arm64 all
    # What must not compile does not on any machine.
    ctest --preset arm64 --parallel "$(nproc)" --timeout 3600 -E '^must_not_compile/'
    compare_bits
    ;;
  kernels)
    scripts/build.sh arm64 cilantro_tests
    scripts/build.sh arm64 cilantro_computing_tests
    ctest --preset arm64 --parallel "$(nproc)" -R "$kernels"
    ;;
  bits) compare_bits ;;
esac
