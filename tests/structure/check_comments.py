#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails if something that users can name has no comment that says what it is.

usage: check_comments.py MODULES_FOLDER

A comment is `///` above or `///<` behind. A declaration may do without one if it

- repeats the name of the declaration before it, is a deduction guide, or stands beneath one that has a comment, with no
  empty line between: they stand under one comment;
- is a function whose name is explained elsewhere in its module, as a step is by its function on clouds;
- is a member function whose name a concept explains, or the standard library, an operator, or a constructor: the comment of
  the class says what they do; or a member type or constant, which is what it says.

Data and enumerators have comments of their own, or are named in backticks in that of their type. Only `threads` and `monitor` are
everywhere what they are in `execution`.
"""
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "scripts"))
from interfaces import partitions  # noqa: E402
from reference import MEMBERS_OF_EXECUTION, runs  # noqa: E402

# `dimension` is how many coordinates a point has, wherever there are points.
KNOWN = {"size", "empty", "begin", "end", "data", "min", "max", "construct", "rebind", "dimension"}


def uncommented(root):
    """(path, line, name) of what has no comment."""
    pages = list(partitions(root))
    by_concepts = {name for p in pages for d in p.declarations if d.kind == "concept"
                   for name in re.findall(r"`(?:\w+\.)?(\w+)\(", d.comment)}
    for page in pages:
        explained = {d.name for p in pages if p.module == page.module and p is not page for d in p.declarations if d.comment}
        for comment, together in runs(page.declarations):
            for one in together:
                if not comment and not (one.kind == "function" and one.name in explained):
                    yield page.path, one.line, one.name
                yield from ((page.path, *found) for found in members_of(one, one.name, by_concepts))


def members_of(owner, name, by_concepts):
    for comment, together in runs(owner.members):
        for member in together:
            explains_itself = member.kind in ("alias", "constant") or member.kind in ("function", "class") and (
                member.name.startswith("operator") or member.name in KNOWN | by_concepts | {owner.name})
            is_named = all(f"`{part}`" in owner.comment for part in member.name.split(", "))
            is_of_execution = owner.name != "execution" and member.name in MEMBERS_OF_EXECUTION
            if not (comment or explains_itself or is_named or is_of_execution):
                yield member.line, f"{name}::{member.name}"
            yield from members_of(member, f"{name}::{member.name}", by_concepts)


def main():
    root = pathlib.Path(sys.argv[1])
    found = sorted(set(uncommented(root)))
    for path, line, name in found:
        print(f"{path.relative_to(root)}:{line} {name}")
    pages = len(list(partitions(root)))
    print(f"{pages} partitions, {len(found)} names without a comment")
    sys.exit(bool(found) or not pages)


if __name__ == "__main__":
    main()
