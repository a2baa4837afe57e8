#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Counts what main steps take, by callgrind, and holds it against steps.txt: check_steps.py PROGRAM STEPS.txt [--write]

Instructions and calls of the allocator, unlike time, are nearly the same on every machine; with one thread and a
vector target that valgrind knows. Ends with 77, which ctest takes for skipped, where there is no valgrind.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

TARGETS = ["baseline", "avx2"]
# More is a step that has become slower; less is one whose number in the file is due.
ALLOWED = {"more": 1.10, "less": 0.80}


def is_available(target):
    """Valgrind runs what the processor has, up to AVX2."""
    return target == "baseline" or target in pathlib.Path("/proc/cpuinfo").read_text()


def count(program, step, target):
    """Instructions and allocations of a step."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "callgrind.out"
        environment = os.environ | {"CILANTRO_VECTOR_TARGET": target, "OMP_NUM_THREADS": "1"}
        done = subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}",
                               "--toggle-collect=measured_step", program, step],
                              env=environment, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{step}: {done.stderr}")
        profile = out.read_text()
    instructions = int(re.search(r"^(?:summary|totals): (\d+)", profile, re.MULTILINE)[1])
    return instructions, int(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("expected", type=pathlib.Path)
    parser.add_argument("--write", action="store_true", help="measure anew, and keep the comments of the file")
    wanted = parser.parse_args()
    if not shutil.which("valgrind"):
        print("no valgrind: nothing was counted")
        sys.exit(77)
    wrong, lines = [], []
    for line in wanted.expected.read_text().splitlines():
        if not line.strip() or line.startswith("#"):
            lines.append(line)
            continue
        step, target, instructions, allocations = line.split()
        if not is_available(target):
            lines.append(line)
            print(f"{step} {target}: not on this processor")
            continue
        found = count(wanted.program, step, target)
        print(f"{step} {target}: {found[0]} instructions, {found[1]} allocations")
        lines.append(f"{step:<11} {target:<9} {found[0]:>11} {found[1]:>6}")
        for what, now, before in [("instructions", found[0], int(instructions)),
                                  ("allocations", found[1], int(allocations))]:
            if now > before * ALLOWED["more"] + 2 or now < before * ALLOWED["less"] - 2:
                wrong.append(f"{step}, {target}: {now} {what} where {wanted.expected.name} says {before}")
    if wanted.write:
        wanted.expected.write_text("\n".join(lines) + "\n")
    elif wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
