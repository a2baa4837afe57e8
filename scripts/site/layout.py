#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Lays out what Sphinx reads: README, docs, examples and CHANGELOG of the project, and the reference.

usage: layout.py PROJECT OUT_FOLDER

Names of the library that stand in backticks on a page become links to the reference.
"""
import pathlib
import re
import shutil
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
from reference import Reference, first_sentence  # noqa: E402

GUIDE = ["install", "coming-from", "core", "search", "geometry", "cloud", "pipelines", "ranges", "io", "files", "registration",
         "global-registration", "many-scans", "warp", "clustering", "consensus", "spatial", "embedding", "scale", "visualization", "windows", "determinism", "performance"]
# Areas whose page has another name than the module that it is about.
MODULE_OF = {"pipelines": "cloud", "ranges": "cloud", "files": "io",
             "global-registration": "registration", "many-scans": "registration", "scale": "tiles",
             "windows": "window"}


def toctree(pages):
    """What the sidebar shows of a page that leads to these."""
    return "\n```{toctree}\n:hidden:\n\n" + "\n".join(pages) + "\n```\n"


def contents(title, pages, out):
    """A page that leads to others in its folder, with the first sentence of each."""
    lines = []
    for page in pages:
        heading, rest = (out / f"{page}.md").read_text().split("\n", 1)
        paragraphs = re.split(r"\n{2,}", re.sub(r"^```.*?^```$", "", rest, flags=re.M | re.S))
        prose = next((p for p in paragraphs if re.match(r"\s*(\w|`|\*\*)", p)), "")
        lines.append(f"- [{heading[2:]}]({page}.md)" + f": {first_sentence(prose)}" * bool(prose))
    write(out / "index.md", f"# {title}\n\n" + "\n".join(lines) + "\n" + toctree(pages))


def for_the_site(text, module, up, reference):
    """A page as the site has it: without hidden code, and with links where GitHub has none."""
    text = re.sub(r"^<!--.*?-->\n", "", text, flags=re.M | re.S)
    text = re.sub(r"reference, `build/site/(reference/[\w/]+)\.html` once `scripts/site.sh` has run",
                  rf"[reference]({up}\1.md)", text)
    text = re.sub(r"\]\(([\w./-]+)/\)", r"](\1/index.md)", text)
    text = re.sub(r"\]\(([\w./-]+)\.cpp\)", r"](\1.md)", text)
    parts = re.split(r"(^```.*?^```$|^#[^\n]*$)", text, flags=re.M | re.S)
    return "".join(p if i % 2 else reference.linked(p, module, f"{up}reference/") for i, p in enumerate(parts))


def code_page(title, paths, root):
    """Files as they are; what a file says at its head comes before its code."""
    page = f"# {title}\n"
    for path in paths:
        text = re.sub(r"^(//|#) SPDX.*\n(\1\n)?", "", path.read_text())
        about = re.match(r"((?://|#)(?: .*)?\n)*", text)[0]
        page += f"\n## {path.relative_to(root)}\n" if len(paths) > 1 else ""
        page += "\n" + re.sub(r"^(//|#) ?( ?)", r"\2\2\2", about, flags=re.M)
        page += f"\n```{'cmake' if path.suffix == '.txt' else 'cpp'}\n{text[len(about):].lstrip()}```\n"
    return page


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def lay_out(project, out):
    reference = Reference(project / "modules")
    reference.write(out / "reference")
    modules = list(dict.fromkeys(p.module for p in reference.partitions))
    for module in modules:
        page = out / "reference" / module / "index.md"
        about = f"\nWhat one does with it: [guide to cilantro.{module}](../../docs/{module}.md).\n" if module in GUIDE else ""
        names = [f"{p.name} <{p.name}>" for p in reference.partitions if p.module == module]
        head, rest = page.read_text().split("\n## ", 1)
        write(page, head + about + "\n## " + rest + toctree(names))
    index = out / "reference" / "index.md"
    write(index, index.read_text() + toctree([f"cilantro.{m} <{m}/index>" for m in modules]))

    docs, decisions = project / "docs", []
    for path in sorted(docs.rglob("*.md")):
        name = path.relative_to(docs)
        module = MODULE_OF.get(path.stem, path.stem)
        write(out / "docs" / name, for_the_site(path.read_text(), module, "../" * len(name.parts), reference))
        if len(name.parts) > 1:
            decisions.append(name.stem)
    for folder in ("performance", "pictures"):
        shutil.copytree(docs / folder, out / "docs" / folder)
    guide = GUIDE + sorted({p.stem for p in docs.glob("*.md")} - set(GUIDE))
    contents("Guide", guide, out / "docs")
    contents("Decisions", decisions, out / "docs/decisions")

    examples = project / "examples"
    names = [path.stem for path in sorted(examples.glob("*.cpp"))]
    for name in names:
        write(out / "examples" / f"{name}.md", code_page(name, [examples / f"{name}.cpp"], examples))
    folders = sorted(path.name for path in examples.iterdir() if path.is_dir())
    for folder in folders:
        paths = sorted(p for p in (examples / folder).rglob("*") if p.is_file())
        write(out / "examples" / folder / "index.md", code_page(folder, paths, examples / folder))
    contents("Examples", names + [f"{f}/index" for f in folders], out / "examples")

    shutil.copy(project / "CITATION.cff", out)
    for name, to in (("README.md", "index.md"), ("CHANGELOG.md", "CHANGELOG.md")):
        write(out / to, for_the_site((project / name).read_text(), "", "", reference))
    with (out / "index.md").open("a") as start:
        start.write(toctree(["Start <self>", "Guide <docs/index>", "Reference <reference/index>", "Examples <examples/index>",
                             "Decisions <docs/decisions/index>", "Changes <CHANGELOG>"]))


if __name__ == "__main__":
    lay_out(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
