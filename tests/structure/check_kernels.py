#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails if a vector kernel's object file shares an inline function with the rest of the program.

usage: check_kernels.py NM TARGET OBJECT...

The linker keeps one of several copies of such a function. One that was compiled for wide vectors
would crash a machine without them, so kernels may only share what carries their target's name.
"""
import re
import subprocess
import sys


# As in core/vector_kernels.hpp.
NUMBERS = {"baseline": 0, "avx2": 1, "avx512": 2}


def shared_symbols(nm, target, path):
    own = re.compile(rf"cilantro::detail::{target}::|<\(cilantro::detail::kernel_target\){NUMBERS[target]}[,>]")
    listing = subprocess.run([nm, "--demangle", path], check=True, capture_output=True, text=True)
    for line in listing.stdout.splitlines():
        found = re.match(r"[0-9a-f]* ([WVu]) (.*)", line)
        if found and not own.search(found[2]):
            yield found[2]


def main():
    nm, target, *paths = sys.argv[1:]
    found = [f"{path}: {name}" for path in paths for name in shared_symbols(nm, target, path)]
    print("\n".join(found) or f"{len(paths)} objects for {target} share nothing")
    sys.exit(bool(found) or not paths)


if __name__ == "__main__":
    main()
