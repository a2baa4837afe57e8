#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Reads the import and include lines of the modules and fails on an edge that must not be.

usage: check_structure.py MODULES_FOLDER
"""
import pathlib
import re
import sys

# A module imports modules of lower floors only.
FLOORS = {"standard": 0, "eigen": 0, "core": 1, "numeric": 2, "search": 2, "geometry": 3, "cloud": 4,
          "consensus": 4, "clustering": 4, "spatial": 4, "embedding": 4, "features": 4, "io": 5, "registration": 5,
          "warp": 6, "tiles": 6, "visualization": 6, "mpi": 6, "window": 7}
# Interfaces that read headers, and what they may read; all others import.
HEADER_WRAPPERS = {"eigen.cppm": r"Eigen/\w+|arm_neon\.h", "standard.cppm": r"[a-z_]+"}
# What an interface may include: the seam to a plain unit, and macros, which a module cannot export.
INTERFACE_HEADERS = {"core/parallel_backend.hpp", "core/closed_spaces.hpp", "core/feature_macros.hpp"}
# Where a header of another library may be read: in implementation units, some in one only.
ONLY_IN = {"omp.h": ["core/parallel_backend.cpp"], "png.h": ["io/image/png.cpp"], "jpeglib.h": ["io/image/jpeg.cpp"],
           "libqhull_r/qhull_ra.h": ["spatial/qhull.cpp"], "lzf.h": ["io/pcd/pcd_read.cpp", "io/pcd/pcd_write.cpp"],
           "spawn.h": ["visualization/child_process.part.cpp"], "zlib.h": ["io/image/png.cpp", "visualization/packing.part.cpp"],
           "mpi.h": ["mpi/mpi_backend.cpp"],
           "GLFW/glfw3.h": ["window/desktop.part.cpp", "window/key_codes.part.cpp"], "EGL/egl.h": ["window/card_renderer.cpp"],
           "GL/glcorearb.h": ["window/card_objects.part.cpp", "window/gl_functions.part.cpp", "window/graphics_card.part.cpp",
                              "window/picture_texture.part.cpp"]}


def violations_in(root):
    """Sentences about the files below `root`, sorted by file."""
    wrapper = root / "standard.cppm"
    wrapped = set(re.findall(r"^#include <(\w+)>", wrapper.read_text(), re.M)) if wrapper.exists() else set()
    for path in sorted(root.rglob("*")):
        if path.suffix not in {".cppm", ".cpp", ".hpp"}:
            continue
        name = path.relative_to(root).as_posix()
        text = path.read_text()
        area = name.split("/")[0] if "/" in name else path.stem
        yield from (f"{name}: {what}" for what in violations_of(name, path, area, text, wrapped))


def violations_of(name, path, area, text, wrapped):
    is_interface = path.suffix == ".cppm"
    imports = re.findall(r"^(?:export )?import ([\w.:]+);", text, re.M)
    includes = re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', text, re.M)

    if area != "cilantro" and area not in FLOORS:
        yield f"the area {area} has no floor"
        return
    for module in (i for i in imports if not i.startswith(":")):
        below = module.removeprefix("cilantro.")
        if below not in FLOORS:
            yield f"imports {module}, which is no module of ours"
        elif area != "cilantro" and FLOORS[below] >= FLOORS[area]:
            yield f"imports {module}, which is not below cilantro.{area}"

    if is_interface:
        declared = re.search(r"^export module ([\w.:]+);", text, re.M)
        wanted = "cilantro" if area == "cilantro" else (
            f"cilantro.{area}" if path.stem == area else f"cilantro.{area}:{path.stem}")
        if not declared or declared[1] != wanted:
            yield f"should declare `export module {wanted};`"
        if path.stem == area and "/" in name and re.search(
                r"^(?!//|export import |export module |\s*$)", text, re.M):
            yield "is a table of contents and must hold nothing but `export import`"
        if re.search(r"^\s*#\s*pragma\s+omp", text, re.M):
            yield "holds an OpenMP pragma, which would force the flag on every importer"
        for parameters in re.findall(r"\(([^();]*)\)", text):
            names = [p.split("=")[0].split()[-1].lstrip("&*") for p in parameters.split(",") if p.split("=")[0].strip()]
            if "source" in names and "target" in names and names.index("target") < names.index("source"):
                yield f"names a target before a source: ({' '.join(parameters.split())})"
        for header in includes:
            allowed = HEADER_WRAPPERS.get(name)
            if not (allowed and re.fullmatch(allowed, header)) and header not in INTERFACE_HEADERS:
                yield f"includes {header}; interfaces import cilantro.standard and cilantro.eigen"
    else:
        is_of_a_module = re.search(r"^module [\w.:]+;", text, re.M)
        for header in includes:
            if is_of_a_module and header in wrapped:
                yield f"includes {header}, of which cilantro.standard has the names"
            if header.startswith(("Eigen/", "unsupported/")):
                yield f"includes {header} instead of importing cilantro.eigen"
            if name not in ONLY_IN.get(header, [name]):
                yield f"includes {header}, which belongs into {' and '.join(ONLY_IN[header])} alone"


def picture():
    """The floors, the highest first."""
    floors = sorted(set(FLOORS.values()), reverse=True)
    return "\n".join(f"{floor}  " + "   ".join(a for a, f in FLOORS.items() if f == floor) for floor in floors)


def main():
    found = list(violations_in(pathlib.Path(sys.argv[1])))
    print("\n".join(found) or picture() + "\nevery edge leads down")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
