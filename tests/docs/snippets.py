#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes a program of the code on a page of documentation, and checks what it prints.

snippets.py extract PAGE.md OUT.cpp    the program
snippets.py check PAGE.md COMMAND...   runs it in a temporary folder
snippets.py draw PAGE.md COMMAND...    the same, and keeps the pictures that it makes for the page

Fences `cpp` follow each other in one function, so that later ones may use what earlier ones define;
`cpp global`, and lines that import, stand before it. Code in a comment `<!-- cpp ... -->` is compiled but not shown. What
fences `text` hold must be printed, in their order; and a picture of the page that its program makes must be the same.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zlib

PRELUDE = """
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <ranges>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

import cilantro;
import simulated_room;
using namespace cilantro;
"""


def blocks(page):
    pattern = r"^```([a-z]+(?: global)?)\n(.*?)^```$|^<!-- cpp( global)?\n(.*?)^-->$"
    for m in re.finditer(pattern, page.read_text(), re.M | re.S):
        yield (m[1], m[2]) if m[1] else ("cpp" + (m[3] or ""), m[4])


def extract(page):
    code = list(blocks(page))
    at_global = "".join(text for kind, text in code if kind == "cpp global")
    body = "".join(text for kind, text in code if kind == "cpp")
    imports = "".join(re.findall(r"^import .*\n", body, re.M))
    body = re.sub(r"^import .*\n", "", body, flags=re.M)
    return f"// Made from {page.name}.{PRELUDE}\n{imports}{at_global}\nint main() {{\n{body}}}\n"


def pixels(picture):
    """The rows of a PNG file as they are before compression, which other versions of zlib do otherwise."""
    data, at, packed = picture.read_bytes(), 8, b""
    while at < len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] == b"IDAT":
            packed += data[at + 8 : at + 8 + size]
        at += size + 12
    return zlib.decompress(packed)


def compare_pictures(page, folder, keep):
    for name in re.findall(r"^!\[[^\]]*\]\((pictures/[\w-]+\.png)\)$", page.read_text(), re.M):
        kept, made = page.parent / name, pathlib.Path(folder) / pathlib.Path(name).name
        if not made.exists():
            sys.exit(f"the program of {page.name} does not make {made.name}")
        if keep:
            shutil.copyfile(made, kept)
        elif not kept.exists() or pixels(kept) != pixels(made):
            sys.exit(f"{name} is not what {page.name} draws; if it should be: snippets.py draw")


def check(page, command, keep=False):
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if run.returncode == 0:
            compare_pictures(page, folder, keep)
    print(run.stdout, run.stderr, sep="")
    if run.returncode != 0:
        sys.exit(f"the program of {page.name} ended with {run.returncode}")
    at = 0
    for kind, text in blocks(page):
        if kind == "text":
            found = run.stdout.find(text, at)
            if found < 0:
                sys.exit(f"{page.name} shows this, which is not printed:\n{text}")
            at = found + len(text)


def main():
    mode, page, rest = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3:]
    if mode == "extract":
        pathlib.Path(rest[0]).write_text(extract(page))
    else:
        check(page, rest, keep=mode == "draw")


if __name__ == "__main__":
    main()
