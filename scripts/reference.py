#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes the reference: a Markdown page for each partition, one for each module, and an index of all names.

usage: reference.py MODULES_FOLDER OUT_FOLDER
"""
import pathlib
import re
import sys

from interfaces import partitions

# What may stand under the comment of the declaration before. A member that holds data may not.
SHARING = ("function", "guide", "alias", "constant")
# What a member of an options struct means if it says nothing itself.
MEMBERS_OF_EXECUTION = {"threads": "As in `execution`.", "monitor": "As in `execution`."}


def slug(name):
    """The anchor that Markdown gives a heading."""
    return re.sub(r"[^\w -]", "", name).lower().replace(" ", "-")


def first_sentence(text):
    found = re.match(r"(.*?[.:;])(\s|$)", " ".join(text.split()))
    return re.sub(r"[:;]$", ".", found[1]) if found else " ".join(text.split())


def runs(declarations):
    """Declarations that stand under one comment, together: [comment, [declaration, ...]]."""
    found = []
    for one in declarations:
        before = found and found[-1][1][-1]
        if before and not one.comment and one.kind in SHARING and (
                one.beneath or one.kind == "guide" or one.name == before.name):
            found[-1][1].append(one)
        else:
            found.append([one.comment, [one]])
    return found


class Reference:
    def __init__(self, modules):
        self.partitions = [p for p in partitions(modules) if p.declarations]
        self.about = {p.module: p.about for p in partitions(modules) if p.name == p.module}
        self.root = modules
        self.places = {}  # name -> [(module, partition, anchor)], what is documented first.
        for p in self.partitions:
            taken = []
            for name, _ in self.sections(p):
                anchor = slug(name) + (f"-{taken.count(slug(name))}" if slug(name) in taken else "")
                taken.append(slug(name))
                self.places.setdefault(name, []).append((p.module, p.name, anchor))

    def sections(self, partition):
        """For each name, in the order of the file, the runs in which it is declared."""
        found = {}
        for comment, together in runs(partition.declarations):
            names = list(dict.fromkeys(one.name for one in together))
            for name in names:
                others = [n for n in names if n != name]
                found.setdefault(name, []).append((comment, [d for d in together if d.name == name], others))
        return list(found.items())

    def link(self, name, module, up):
        """The path to a name as seen from a module, with `up` to get to the reference's folder; or nothing."""
        places = self.places.get(name, [])
        near = [p for p in places if p[0] == module] or places
        return f"{up}{near[0][0]}/{near[0][1]}.md#{near[0][2]}" if near else None

    def linked(self, text, module, up, without=""):
        """`text` in which the names in backticks lead to where they are documented."""
        def replace(found):
            name = re.match(r"`(\w+)(?:[<({].*)?`$", found[0], re.S)
            path = name and name[1] != without and self.link(name[1], module, up)
            return f"[{found[0]}]({path})" if path else found[0]
        return re.sub(r"(?<![\[`])`[^`]+`(?![`\]])", replace, text)

    def prose(self, comment, module, without=""):
        # Sources and lists begin paragraphs of their own; < is no HTML.
        text = re.sub(r"\n(Source|Models|Semantics):", r"\n\n\1:", comment)
        text = re.sub(r"(`[^`]*`|^    .*)|<(?=\w)", lambda found: found[1] or r"\<", text, flags=re.M)
        return self.linked(text, module, "../", without)

    def code(self, declarations):
        between = "\n\n" if any("\n" in d.code for d in declarations) else "\n"
        return "```cpp\n" + between.join(d.code for d in declarations) + "\n```\n"

    def members(self, owner, module):
        """A list; enumerators that say nothing are in the code of their type already."""
        for comment, together in runs(owner.members):
            comment = comment if comment != owner.comment else ""
            if owner.kind == "enum" and not comment:
                continue
            if together[0].kind == "variable":
                comment = comment or MEMBERS_OF_EXECUTION.get(together[0].name, "")
            item = self.code(together) + "\n" + self.prose(comment, module)
            yield "- " + "\n".join("  " + line if line else "" for line in item.strip().split("\n"))[2:] + "\n"
            for inner in together:
                yield from ("  " + line.replace("\n", "\n  ") for line in self.members(inner, module))

    def page(self, p):
        path = p.path.relative_to(self.root.parent).as_posix()
        yield f"# cilantro.{p.module}:{p.name}\n"
        yield f"`import cilantro.{p.module};`, or `import cilantro;`. Declared in `{path}`.\n"
        if p.about and p.name != p.module:
            yield self.prose(p.about, p.module)
        for name, groups in self.sections(p):
            yield f"## `{name}`\n"
            for comment, together, others in groups:
                yield self.code(together)
                if not comment and (place := self.documented_elsewhere(name, p)):
                    comment = f"As [`{name}`](../{place[0]}/{place[1]}.md#{place[2]}), with what it works on left out."
                if comment:
                    yield self.prose(comment, p.module, name) + "\n"
                if others:
                    yield "Together with " + ", ".join(self.linked(f"`{o}`", p.module, "../") for o in others) + ".\n"
                for one in together:
                    yield from self.members(one, p.module)

    def documented_elsewhere(self, name, partition):
        return next((p for p in self.places[name] if p[0] == partition.module and p[1] != partition.name), None)

    def about_of(self, module):
        text = re.sub(rf"^cilantro\.{module}: ", "", self.about.get(module, ""))
        return text[:1].upper() + text[1:]

    def module_page(self, module):
        yield f"# Reference of cilantro.{module}\n"
        yield f"{self.about_of(module)}\n`import cilantro.{module};`, or `import cilantro;`.\n"
        for p in self.partitions:
            if p.module != module:
                continue
            yield f"## [{p.name}]({p.name}.md)\n"
            yield "| | |\n|---|---|"
            for name, groups in self.sections(p):
                comment = next((c for c, _, _ in groups if c), "")
                text = self.prose(first_sentence(comment), module, name).replace("|", "\\|")
                anchor = next(a for m, q, a in self.places[name] if (m, q) == (module, p.name))
                shown = name.replace("|", "\\|")
                yield f"| [`{shown}`]({p.name}.md#{anchor}) | {text} |"
            yield ""

    def index(self):
        yield "# Reference\n"
        yield "Everything that cilantro exports. `import cilantro;` gives all of it, and each module can be imported alone.\n"
        yield "| module | |\n|---|---|"
        for module in dict.fromkeys(p.module for p in self.partitions):
            yield f"| [cilantro.{module}]({module}/index.md) | {' '.join(self.about_of(module).split())} |"
        yield "\n## All names\n"
        letters = {}
        for name, places in self.places.items():
            for module, page, anchor in places:
                where = f" ({module}:{page})" if len(places) > 1 else ""
                letters.setdefault(name[0].upper(), []).append((name.lower(), f"[`{name}`]({module}/{page}.md#{anchor}){where}"))
        for letter, entries in sorted(letters.items()):
            yield f"**{letter}** " + "\u00a0· ".join(link for _, link in sorted(entries)) + "\n"

    def write(self, out):
        pages = {"index.md": self.index()}
        for p in self.partitions:
            pages[f"{p.module}/{p.name}.md"] = self.page(p)
            pages[f"{p.module}/index.md"] = self.module_page(p.module)
        for name, lines in pages.items():
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            (out / name).write_text("\n".join(lines).rstrip() + "\n")


if __name__ == "__main__":
    Reference(pathlib.Path(sys.argv[1])).write(pathlib.Path(sys.argv[2]))
