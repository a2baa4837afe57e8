#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prints a table of what the benchmark programs measured: compare.py FOLDER THREADS

Medians of all repetitions in milliseconds, and in brackets how many times as long as cilantro. A result that differs
from cilantro's by more than a thousandth is marked: that program did other work.
"""
import collections
import json
import pathlib
import statistics
import sys

folder, threads = pathlib.Path(sys.argv[1]), sys.argv[2]
times = collections.defaultdict(lambda: collections.defaultdict(list))
results = collections.defaultdict(dict)
errors = collections.defaultdict(dict)
for path in sorted(folder.glob("*.json")):
    library = path.name.split(".")[0]
    text = path.read_text()
    for run in json.loads(text)["benchmarks"] if text else []:  # Empty: it has no such task.
        if run.get("run_type") == "iteration":
            task = run["name"].split("/")[0]
            times[task][library].append(run["real_time"])
            results[task][library] = run.get("result")
            if "error_mm" in run:
                errors[task][library] = f'{run["error_mm"]:.3f} mm {run["error_deg"]:.4f} deg'

libraries = sorted({library for task in times.values() for library in task},
                   key=lambda name: (name != "cilantro", name))
print(f"{threads} thread(s); milliseconds, median (times cilantro)")
print(f"{'':14}" + "".join(f"{name:>22}" for name in libraries))
for task, by_library in times.items():
    ours = by_library.get("cilantro")
    line = f"{task:14}"
    for library in libraries:
        if library not in by_library:
            line += f"{'':>22}"
            continue
        median = statistics.median(by_library[library])
        cell = f"{median:.1f}"
        if ours:
            cell += f" ({median / statistics.median(ours):.2f})"
            mine, other = results[task].get("cilantro"), results[task].get(library)
            if mine and other and abs(other - mine) > 1e-3 * abs(mine):
                cell += f" ≠{other / mine:.3f}"
        line += f"{cell:>22}"
    print(line)

if errors:
    print("\nfrom the recorded pose")
    for task, by_library in errors.items():
        print(f"{task:14}" + "".join(f"{by_library.get(library, ''):>26}" for library in libraries))
