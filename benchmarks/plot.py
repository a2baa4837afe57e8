#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws what the benchmark programs measured: plot.py RESULTS DATA tasks|sizes|sequence FILE.svg

Tasks: bars of how many times as long as cilantro the others take. Sizes: time against the number of points. A
sequence: a curve over its frames, and a box for each library. Needs matplotlib (Debian: python3-matplotlib).
"""
import argparse
import pathlib
import statistics
import sys

import compare
try:
    import matplotlib
except ImportError:
    sys.exit(f"no plot: {sys.executable} has no matplotlib (Debian: python3-matplotlib)")
matplotlib.use("svg")
from matplotlib import pyplot


def grid(rows, columns):
    figure, axes = pyplot.subplots(rows, columns, figsize=(5 * columns, 3.6 * rows), squeeze=False)
    return figure, axes


def threads_of(rows):
    return sorted({row["threads"] for row in rows})


def libraries_of(rows):
    return sorted({row["library"] for row in rows}, key=lambda name: (name != "cilantro", name))


def draw_tasks(rows):
    counts = threads_of(rows)
    tasks = list(dict.fromkeys(row["task"] for row in rows))
    figure, axes = pyplot.subplots(1, len(counts), figsize=(7 * len(counts), 0.45 * len(tasks) + 1.5), squeeze=False)
    for axis, threads in zip(axes[0], counts):
        median = {(row["task"], row["library"]): row["median_ms"] for row in rows if row["threads"] == threads}
        others = [name for name in libraries_of(rows) if name != "cilantro"]
        compared = [task for task in tasks if (task, "cilantro") in median
                    and any((task, other) in median for other in others)]
        height = 0.8 / max(len(others), 1)
        for k, library in enumerate(others):
            ratios = [median.get((task, library), 0) / median[task, "cilantro"] for task in compared]
            places = [row + (k - (len(others) - 1) / 2) * height for row in range(len(compared))]
            axis.barh(places, ratios, height, label=library)
        axis.axvline(1, color="black", linewidth=1)
        axis.set_xscale("log")
        axis.set_yticks(range(len(compared)), compared)
        axis.invert_yaxis()
        axis.set_xlabel(f"times as long as cilantro, {threads} thread(s)")
        axis.legend()
    return figure


def draw_sizes(rows):
    counts = threads_of(rows)
    rows = [row for row in rows if row["data"].startswith("uniform")]
    tasks = list(dict.fromkeys(row["task"] for row in rows))
    figure, axes = grid(len(counts), len(tasks))
    for line, threads in zip(axes, counts):
        for axis, task in zip(line, tasks):
            for library in libraries_of(rows):
                curve = sorted((row["n"], row["median_ms"]) for row in rows
                               if (row["task"], row["library"], row["threads"]) == (task, library, threads))
                if curve:
                    axis.loglog(*zip(*curve), marker="o", label=library)
            axis.set_title(f"{task}, {threads} thread(s)")
            axis.set_xlabel("points")
            axis.set_ylabel("ms")
            axis.legend()
    return figure


def draw_sequence(rows):
    """The aligned frames are one task."""
    rows = [row | {"task": "icp"} if row["task"].startswith("icp_") else row for row in rows]
    tasks = list(dict.fromkeys(row["task"] for row in rows))
    figure, axes = grid(2 * len(threads_of(rows)), len(tasks))
    for t, threads in enumerate(threads_of(rows)):
        for column, task in enumerate(tasks):
            curve, box = axes[2 * t][column], axes[2 * t + 1][column]
            times = {}
            for library in libraries_of(rows):
                some = sorted((row["data"], row["median_ms"]) for row in rows
                              if (row["task"], row["library"], row["threads"]) == (task, library, threads))
                if some:
                    times[library] = [ms for _, ms in some]
                    curve.semilogy(range(len(some)), times[library], label=library)
            curve.set_title(f"{task}, {threads} thread(s)")
            curve.set_xlabel("frame")
            curve.set_ylabel("ms")
            curve.legend()
            box.boxplot(list(times.values()))
            box.set_xticks(range(1, len(times) + 1),
                           [f"{name}\n{statistics.median(all_ms):.1f} ms" for name, all_ms in times.items()])
            box.set_yscale("log")
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("what", choices=["tasks", "sizes", "sequence"])
    parser.add_argument("file", type=pathlib.Path)
    wanted = parser.parse_args()
    rows = list(compare.rows(compare.read_all(wanted.results), wanted.data))
    figure = {"tasks": draw_tasks, "sizes": draw_sizes, "sequence": draw_sequence}[wanted.what](rows)
    figure.tight_layout()
    figure.savefig(wanted.file)


if __name__ == "__main__":
    main()
