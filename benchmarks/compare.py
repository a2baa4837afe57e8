#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prints a table of what the benchmark programs measured: compare.py FOLDER THREADS [--json FILE] [--svg FILE]

Medians of all repetitions in milliseconds, and in brackets how many times as long as cilantro. A result that differs
from cilantro's by more than a thousandth is marked: that program did other work.
"""
import argparse
import collections
import dataclasses
import json
import pathlib
import statistics

TOLERANCE = 1e-3


@dataclasses.dataclass
class Measured:
    """What one library took for one task."""
    times: list = dataclasses.field(default_factory=list)
    result: float | None = None
    error: str = ""

    @property
    def median(self):
        return statistics.median(self.times)


def read(folder):
    """By task, then by library."""
    tasks = collections.defaultdict(lambda: collections.defaultdict(Measured))
    for path in sorted(folder.glob("*.json")):
        library = path.name.split(".")[0]
        text = path.read_text()
        for run in json.loads(text)["benchmarks"] if text else []:  # Empty: it has no such task.
            if run.get("run_type") != "iteration":
                continue
            measured = tasks[run["name"].split("/")[0]][library]
            measured.times.append(run["real_time"])
            measured.result = run.get("result")
            if "error_mm" in run:
                measured.error = f'{run["error_mm"]:.3f} mm {run["error_deg"]:.4f} deg'
    return tasks


def is_equal(by_library, library):
    """Whether a library found what cilantro found; None if nobody can tell."""
    mine, other = by_library["cilantro"].result if "cilantro" in by_library else None, by_library[library].result
    if not mine or other is None:
        return None
    return abs(other - mine) <= TOLERANCE * abs(mine)


def data_of(task, folder):
    """The name and the number of points of what a task works on."""
    name = "large" if task.startswith("segment") else "frame"
    if task.startswith("icp_"):
        name = task.removeprefix("icp_") + "_source"
    path = folder / f"{name}.f32"
    return name, path.stat().st_size // 12 if path.exists() else None


def table(tasks, threads):
    libraries = libraries_of(tasks)
    yield f"{threads} thread(s); milliseconds, median (times cilantro)"
    yield f"{'':16}" + "".join(f"{name:>22}" for name in libraries)
    for task, by_library in tasks.items():
        line = f"{task:16}"
        for library in libraries:
            cell = ""
            if library in by_library:
                cell = f"{by_library[library].median:.1f}"
                if "cilantro" in by_library:
                    cell += f" ({by_library[library].median / by_library['cilantro'].median:.2f})"
                if is_equal(by_library, library) is False:
                    cell += f" ≠{by_library[library].result / by_library['cilantro'].result:.3f}"
            line += f"{cell:>22}"
        yield line
    if any(m.error for by_library in tasks.values() for m in by_library.values()):
        yield "\nfrom the recorded pose"
        for task, by_library in tasks.items():
            if any(m.error for m in by_library.values()):
                errors = (by_library[name].error if name in by_library else "" for name in libraries)
                yield f"{task:16}" + "".join(f"{error:>26}" for error in errors)


def libraries_of(tasks):
    return sorted({library for by_library in tasks.values() for library in by_library},
                  key=lambda name: (name != "cilantro", name))


def rows(tasks, threads, folder):
    for task, by_library in tasks.items():
        data, n = data_of(task, folder)
        for library, measured in sorted(by_library.items()):
            yield {"task": task, "data": data, "n": n, "threads": threads, "library": library,
                   "min_ms": min(measured.times), "median_ms": measured.median,
                   "equal": is_equal(by_library, library)}


def draw(tasks, threads, path):
    """Bars of how many times as long as cilantro the others take."""
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot
    others = [name for name in libraries_of(tasks) if name != "cilantro"]
    compared = [task for task, by_library in tasks.items()
                if "cilantro" in by_library and len(by_library) > 1]
    figure, axes = pyplot.subplots(figsize=(8, 0.45 * len(compared) + 1.5))
    height = 0.8 / max(len(others), 1)
    for k, library in enumerate(others):
        ratios = [tasks[task][library].median / tasks[task]["cilantro"].median if library in tasks[task] else 0
                  for task in compared]
        places = [row + (k - (len(others) - 1) / 2) * height for row in range(len(compared))]
        axes.barh(places, ratios, height, label=library)
    axes.axvline(1, color="black", linewidth=1)
    axes.set_xscale("log")
    axes.set_yticks(range(len(compared)), compared)
    axes.invert_yaxis()
    axes.set_xlabel(f"times as long as cilantro, {threads} thread(s)")
    axes.legend()
    figure.tight_layout()
    figure.savefig(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("threads", type=int)
    parser.add_argument("--json", type=pathlib.Path, help="write one row a task and library")
    parser.add_argument("--svg", type=pathlib.Path, help="draw ratios (needs python3-matplotlib)")
    wanted = parser.parse_args()
    tasks = read(wanted.folder)
    print("\n".join(table(tasks, wanted.threads)))
    if wanted.json:
        wanted.json.write_text(json.dumps(list(rows(tasks, wanted.threads, wanted.folder)), indent=1) + "\n")
    if wanted.svg:
        draw(tasks, wanted.threads, wanted.svg)


if __name__ == "__main__":
    main()
