#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prints what the programs of `run.sh global` found: global.py FOLDER RESULTS...

FOLDER has pairs.txt and frames.txt; each file of RESULTS is of one program. Right is within 10 cm and 5 degrees of the
recorded pose. A false `unique` is farther than that from it and from where two kinds of ICP end that start there.
"""
import collections
import math
import pathlib
import sys

KINDS = ("70 % and more", "30 to 70 %", "10 to 30 %", "less than 10 %")


def matrices(words):
    values = [float(w) for w in words]
    return [values[i:i + 16] for i in range(0, len(values), 16)]


def difference(a, b):
    """In metres and degrees."""
    away = math.dist((a[3], a[7], a[11]), (b[3], b[7], b[11]))
    turned = math.sqrt(sum((a[k] - b[k]) ** 2 for k in (0, 1, 2, 4, 5, 6, 8, 9, 10)))
    return away, math.degrees(2 * math.asin(min(1, turned / math.sqrt(8))))


def is_near(a, b):
    away, turned = difference(a, b)
    return away <= 0.1 and turned <= 5


def kind(overlap):
    return 0 if overlap >= 0.7 else 1 if overlap >= 0.3 else 2 if overlap >= 0.1 else 3


def read_pairs(folder):
    pairs = {}
    for line in (folder / "pairs.txt").read_text().splitlines():
        words = line.split()
        pairs[int(words[0]), int(words[1])] = (float(words[2]), words[3] == "1", matrices(words[4:]))
    return pairs


def percent(count, of):
    return f"{100 * count / of:.1f} %" if of else ""


def print_bound(pairs):
    """How many recorded poses ICP leaves that starts there."""
    print("\nrecorded poses that ICP by planes within 10 cm, and generalised ICP within 5 cm, leave by more than 10 cm or 5°:")
    for k, name in enumerate(KINDS):
        all_of = [m for overlap, _, m in pairs.values() if kind(overlap) == k]
        left = [sum(not is_near(m[0], m[e]) for m in all_of) for e in (1, 2)]
        print(f"  {name}: {len(all_of)} pairs, {left[0]} ({percent(left[0], len(all_of))}), {left[1]} ({percent(left[1], len(all_of))})")


def summarise(path, pairs, names, sample_only):
    tally = collections.defaultdict(collections.Counter)
    wrong, features = [], ""
    for line in path.read_text().splitlines():
        words = line.split()
        if words[0] == "features":
            features = f"{float(words[1]):.1f} ms a frame for features ({float(words[2]):.1f} of processors)"
            continue
        target, source = int(words[1]), int(words[2])
        overlap, is_sampled, (recorded, *ends) = pairs[target, source]
        if sample_only and not is_sampled:
            continue
        status, (rough, fine, finer) = " ".join(words[7:-48]), matrices(words[-48:])
        t, sure = tally[kind(overlap)], status in ("unique", "fits")
        t["pairs"] += 1
        t["wall"] += float(words[3])
        t["processor"] += float(words[4])
        t["refine"] += float(words[6])
        t["slowest"] = max(t["slowest"], float(words[4]))
        found = status != "too few"
        t["rough"] += found and is_near(rough, recorded)
        t["fine"] += found and is_near(fine, recorded)
        t["finer"] += found and is_near(finer, recorded)
        t["sure_finer"] += sure and is_near(finer, recorded)
        t["fine_ends"] += found and any(is_near(fine, m) for m in (recorded, *ends))
        t["sure"] += sure
        t["sure_rough"] += sure and is_near(rough, recorded)
        t["sure_fine"] += sure and is_near(fine, recorded)
        if sure and not is_near(rough, recorded):
            away, turned = difference(rough, recorded)
            least = min(difference(rough, m) for m in ends)
            is_false = not any(is_near(rough, m) for m in ends)
            fine_is_false = not any(is_near(x, m) for x in (fine, finer) for m in (recorded, *ends))
            t["false"] += is_false
            t["fine_false"] += fine_is_false
            wrong.append((is_false, fine_is_false, f"{names[target]} {names[source]} overlap {overlap:.2f}: {100 * away:.1f} cm {turned:.1f}° "
                          f"from the recorded pose, {100 * least[0]:.1f} cm {least[1]:.1f}° from the nearest end of ICP"))
    print(f"\n{path.parent.name}/{path.stem}{' (sample)' if sample_only else ''}: {features}")
    print("| overlap | pairs | right | by planes | generalised | by planes, or an end of ICP | sure | sure, right | by planes | generalised | false, refined false | ms, of processors, longest | ms refining |")
    print("|---" * 13 + "|")
    for k, name in enumerate(KINDS):
        t = tally[k]
        n = t["pairs"]
        if n:
            print(f"| {name} | {n} | {percent(t['rough'], n)} | {percent(t['fine'], n)} | {percent(t['finer'], n)} | {percent(t['fine_ends'], n)} | "
                  f"{percent(t['sure'], n)} | {percent(t['sure_rough'], n)} | {percent(t['sure_fine'], n)} | {percent(t['sure_finer'], n)} | {t['false']}, {t['fine_false']} | "
                  f"{t['wall'] / n:.1f}, {t['processor'] / n:.1f}, {t['slowest']:.1f} | {t['refine'] / n:.1f} |")
    return wrong


def main():
    folder = pathlib.Path(sys.argv[1])
    pairs, names = read_pairs(folder), (folder / "frames.txt").read_text().split()
    print_bound(pairs)
    for path in map(pathlib.Path, sys.argv[2:]):
        wrong = summarise(path, pairs, names, False)
        if len(path.read_text().splitlines()) > len(pairs):
            summarise(path, pairs, names, True)
        if path.stem.startswith("cilantro"):
            for is_false, fine_is_false, text in wrong:
                print(("FALSE " if is_false else "only the recorded pose: ") + ("(refined, too) " if fine_is_false else "") + text)


if __name__ == "__main__":
    main()
