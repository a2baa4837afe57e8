#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails if a figure that README quotes is not that of docs/performance.md.

usage: check_figures.py README.md PERFORMANCE.md

README says of some tasks how many times as fast they are as with the peers, from the least to the most: "ICP 4.7 to 33 times".
These must be the least and the most of Open3D and PCL in the rows of those tasks on one thread, rounded as README has them; where a peer did other work (≠), it does not count.
"""
import pathlib
import re
import sys

# How README calls a task, and the rows of the table that are it.
TASKS = {"neighbours": r"\d+ nearest|all within", "normals": r"normals", "outliers": r".*outliers",
         "grids": r"voxel means|5 mm|2 cm, of", "ICP": r"ICP", "segments": r"parts by|DBSCAN",
         "PLY": r"(read|write) PLY", "PCD": r"(read|write) (compressed )?PCD"}
QUOTED = re.compile(r"(?P<what>[^:;.]*?)\s(?P<least>\d+(?:\.\d+)?) to (?P<most>\d+(?:\.\d+)?) times")
A_PIPELINE = "read, clean, downsample, normals, write"


def rounded_as(value, quoted):
    return f"{value:.{len(quoted.partition('.')[2])}f}"


def ratios(performance, task):
    table = performance.split("| one thread |", 1)[-1].split("\n\n", 1)[0]
    for row in table.split("\n")[2:]:
        label, _, *peers = (cell.strip() for cell in row.strip("|").split("|"))
        if re.match(task, label):
            yield from (float(x) for cell in peers[:2] for x in re.findall(r"\(([\d.]+)×\)(?! ≠)", cell))


def violations(readme, performance):
    quotes = re.search(r"\*\*Fast\*\*:(.*?)\[measured\]", readme, re.S)
    if not quotes:
        yield "README quotes no figures after **Fast**"
        return
    for quote in QUOTED.finditer(" ".join(quotes[1].split())):
        tasks = [rows for name, rows in TASKS.items() if re.search(rf"\b{name}\b", quote["what"])]
        found = [ratio for rows in tasks for ratio in ratios(performance, rows)]
        if not found:
            yield f"no row is that of \"{quote['what'].strip(', ')}\""
            continue
        least, most = rounded_as(min(found), quote["least"]), rounded_as(max(found), quote["most"])
        if (least, most) != (quote["least"], quote["most"]):
            yield f"\"{quote[0].strip(', ')}\": docs/performance.md has {min(found)} to {max(found)}"
    seconds = re.search(r"compiles in ([\d.]+) s", " ".join(readme.split()))
    measured = re.search(rf"^\| {A_PIPELINE} \| ([\d.]+) s", performance, re.M)
    if seconds and not (measured and rounded_as(float(measured[1]), seconds[1]) == seconds[1]):
        yield f"\"{seconds[0]}\": docs/performance.md has {measured[1] if measured else 'no'} s"


def main():
    found = list(violations(*(pathlib.Path(path).read_text() for path in sys.argv[1:3])))
    print("\n".join(found) or "README quotes what was measured")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
