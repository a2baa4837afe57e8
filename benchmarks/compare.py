#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prints tables of what the benchmark programs measured: compare.py RESULTS DATA [--json FILE]

RESULTS has a folder SET.THREADS for each set of points, with files LIBRARY.ROUND.json; DATA has the points.
Medians in milliseconds, and in brackets how many times as long as cilantro. A result that differs from cilantro's by
more than a thousandth is marked: that program did other work.
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
            if run.get("run_type") != "iteration" or run.get("error_occurred"):
                continue
            measured = tasks[run["name"].split("/")[0]][library]
            measured.times.append(run["real_time"])
            measured.result = run.get("result")
            if "error_mm" in run:
                measured.error = f'{run["error_mm"]:.3f} mm, {run["error_deg"]:.4f}°'
            if "psnr_db" in run:
                measured.error = f'{run["psnr_db"]:.1f} dB'
    return tasks


def read_all(results):
    """By set of points and number of threads: what `read` returns."""
    def order(path):
        name, threads = path.name.rsplit(".", 1)
        return int(threads), name
    return {(path.name.rsplit(".", 1)[0], int(path.name.rsplit(".", 1)[1])): read(path)
            for path in sorted(filter(pathlib.Path.is_dir, results.iterdir()), key=order)}


def is_equal(by_library, library):
    """Whether a library found what cilantro found; None if nobody can tell."""
    mine, other = by_library["cilantro"].result if "cilantro" in by_library else None, by_library[library].result
    if not mine or other is None:
        return None
    return abs(other - mine) <= TOLERANCE * abs(mine)


def points_of(task, points, folder):
    """The name and the number of points of what a task works on."""
    name = "large" if task.startswith(("segment", "large", "picture", "page", "spacing")) else points
    if task.startswith(("icp_", "colored_icp_")):
        name = task.removeprefix("colored_").removeprefix("icp_") + "_source"
    path = folder / f"{name}.f32"
    return name, path.stat().st_size // 12 if path.exists() else None


def libraries_of(tasks):
    return sorted({library for by_library in tasks.values() for library in by_library},
                  key=lambda name: (name != "cilantro", name))


def table(tasks):
    libraries = libraries_of(tasks)
    yield "| | " + " | ".join(libraries) + " |"
    yield "|---" * (len(libraries) + 1) + "|"
    for task, by_library in tasks.items():
        cells = [task]
        for library in libraries:
            cell = ""
            if library in by_library:
                cell = f"{by_library[library].median:.1f}"
                if "cilantro" in by_library and library != "cilantro":
                    cell += f" ({by_library[library].median / by_library['cilantro'].median:.1f}×)"
                if is_equal(by_library, library) is False:
                    cell += f" ≠ {by_library[library].result / by_library['cilantro'].result:.3f}"
            cells.append(cell)
        yield "| " + " | ".join(cells) + " |"
    if any(m.error for by_library in tasks.values() for m in by_library.values()):
        yield "\nfrom the recorded pose; from the picture of cilantro\n"
        for task, by_library in tasks.items():
            if any(m.error for m in by_library.values()):
                errors = (by_library[name].error if name in by_library else "" for name in libraries)
                yield f"| {task} | " + " | ".join(errors) + " |"


def rows(all_tasks, folder):
    for (points, threads), tasks in all_tasks.items():
        for task, by_library in tasks.items():
            data, n = points_of(task, points, folder)
            for library, measured in sorted(by_library.items()):
                yield {"task": task, "data": data, "n": n, "threads": threads, "library": library,
                       "min_ms": min(measured.times), "median_ms": measured.median,
                       "equal": is_equal(by_library, library)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path, help="write one row a task, data, library and number of threads")
    wanted = parser.parse_args()
    all_tasks = read_all(wanted.results)
    for (points, threads), tasks in all_tasks.items():
        print(f"\n{points}, {threads} thread(s): milliseconds, median (times cilantro)\n")
        print("\n".join(table(tasks)))
    if wanted.json:
        wanted.json.write_text(json.dumps(list(rows(all_tasks, wanted.data)), indent=1) + "\n")


if __name__ == "__main__":
    main()
