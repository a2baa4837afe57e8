# SPDX-License-Identifier: MIT
"""Reads what the interfaces of modules export: declarations, their public members, and the comments of both.

It is no compiler: it counts on `export` before each declaration or block, and on brackets that match.
"""
import pathlib
import re
import textwrap
from dataclasses import dataclass, field

# What may hold brackets that mean nothing: comments, literals, and what the preprocessor reads.
NOISE = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<!\w)\'(?:\\.|[^\'\\\n])+\''
                   r'|^[ \t]*#(?:[^\n]*\\\n)*[^\n]*|^[A-Z_]+\([^\n]*\)$', re.M | re.S)
CLOSING = {"(": ")", "[": "]", "{": "}", "<": ">"}


@dataclass
class Declaration:
    kind: str      # concept, class, enum, alias, function, guide, constant, variable or enumerator
    name: str
    code: str      # Without its body.
    line: int
    comment: str   # Empty if it has none of its own.
    beneath: bool  # It follows the declaration before, with no empty line between.
    members: list = field(default_factory=list)


@dataclass
class Partition:
    module: str  # Without `cilantro.`.
    name: str
    path: pathlib.Path
    about: str
    declarations: list


def behind(bare, i, opening="([{"):
    """The place behind the bracket that closes the one at `i`."""
    depth = 0
    while i < len(bare):
        if bare.startswith("->", i):
            i += 1
        elif bare[i] in opening:
            depth += 1
        elif bare[i] in [CLOSING[b] for b in opening]:
            depth -= 1
            if depth == 0:
                return i + 1
        i += 1
    return i


def behind_constraint(bare, i):
    """The place behind the constraint at `i`: terms with && and || between them."""
    while True:
        i = re.compile(r"\s*").match(bare, i).end()
        if bare.startswith("requires", i):
            i = behind(bare, bare.index("{", i))
        elif bare[i] == "(":
            i = behind(bare, i)
        else:
            i = re.compile(r"[\w:]+").match(bare, i).end()
            i = behind(bare, i, "([{<") if bare[i] == "<" else i
        more = re.compile(r"\s*(&&|\|\|)").match(bare, i)
        if not more:
            return i
        i = more.end()


def without_heads(bare):
    """A declaration without `export`, attributes, template parameters and what is required of them."""
    while True:
        bare = bare.lstrip()
        if re.match(r"template\s*<", bare):
            bare = bare[behind(bare, bare.index("<"), "([{<"):]
        elif re.match(r"requires\b", bare):
            bare = bare[behind_constraint(bare, len("requires")):]
        elif bare.startswith("[["):
            bare = bare[behind(bare, 0):]
        elif re.match(r"export\b", bare):
            bare = bare[len("export"):]
        else:
            return bare


def kind_and_name(bare):
    bare = without_heads(bare)
    for kind, pattern in (("concept", r"concept\s+(\w+)"), ("enum", r"enum\s+(?:class\s+)?(\w+)"),
                          ("class", r"(?:class|struct|union)\s+(\w+)"), ("alias", r"using\s+(?:[\w:]+::)?(\w+)\s*[=;]")):
        if found := re.match(pattern, bare):
            return kind, found[1]
    i = 0
    while i < len(bare) and bare[i] not in "={;[":
        if found := re.compile(r"\boperator\s*(\(\)|[^\s\w(]+|[^()]+)").match(bare, i):
            return "function", "operator" + " " * found[1][0].isalpha() + found[1].strip()
        if bare[i] == "<":
            i = behind(bare, i, "([{<")
        elif bare[i] == "(":
            name = re.search(r"(~?\w+)\s*$", bare[:i])[1]
            if name not in ("decltype", "explicit"):
                is_guide = re.match(r"(explicit\s+)?\w+\s*$", bare[:i]) and "->" in bare[i:]
                return ("guide" if is_guide else "function"), name
            i = behind(bare, i)
        else:
            i += 1
    # Several of one type have their names together.
    kind = "constant" if re.search(r"\bconstexpr\b", bare[:i]) else "variable"
    flat = bare
    while (flatter := re.sub(r"<[^<>]*>|\{[^{}]*\}|\([^()]*\)|\[[^][]*\]", "", flat)) != flat:
        flat = flatter
    return kind, ", ".join(re.findall(r"(\w+)\s*(?:=[^,;]*)?(?=[,;]|$)", flat))


def shown(code, column):
    """A declaration that began at `column`, without what is said to the compiler alone."""
    lines, shift = [], 0
    for line in textwrap.dedent(" " * column + code.rstrip(" \n;,")).split("\n"):
        # What was aligned with a bracket stays so.
        indent = len(line) - len(line.lstrip())
        line = line[shift if indent >= shift + 4 else 0:]
        short = re.sub(r"^(\s*)(?:(?:export|inline|\[\[nodiscard\]\])(?: |$))+", r"\1", line)
        shift = len(line) - len(short) if "(" in short and len(short) < len(line) else shift
        short = re.sub(r" \[\[clang::lifetimebound\]\]|\s*//.*", "", short)
        lines += [short.rstrip()] if short.strip() else []
    return "\n".join(lines)


class Scope:
    """Reads the declarations between two places of a file."""

    def __init__(self, text):
        self.text = text
        self.bare = NOISE.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)

    def comment_above(self, start):
        lines = self.text[:start].split("\n")[:-1]
        found = []
        while lines and re.match(r"\s*///(?!<)", lines[-1]):
            found.append(re.sub(r"^\s*/// ?", "", lines.pop()))
        return found[::-1]

    def comment_behind(self, end):
        found = re.compile(r"[ \t]*///< ?[^\n]*(?:\n[ \t]*///< ?[^\n]*)*").match(self.text, end)
        return re.findall(r"///< ?([^\n]*)", found[0]) if found else []

    def item_end(self, start, end, terminator):
        """Where the item at `start` ends, and where its body, or what initialises a constructor's members, begins."""
        i, cut, seen_call = start, None, False
        while i < end:
            c = self.bare[i]
            if c == terminator:
                return i + 1, cut
            if c == ":" and seen_call and cut is None and "::" not in self.bare[i - 1:i + 2]:
                cut = i
            if c == "{":
                head, close = self.bare[start:i], behind(self.bare, i)
                if not re.search(r"(requires|=|&&|\|\||!|\()\s*requires\s*(\([^{}]*\))?\s*$", head):
                    cut = i if cut is None else cut
                    if re.match(r"\s*($|[^\s;,{&|)>.?])", self.bare[close:end]):
                        return close, cut
                i = close
            elif c in "([":
                seen_call = seen_call or c == "("
                i = behind(self.bare, i)
            else:
                i += 1
        return end, cut

    def read(self, begin, end, exported=True, public=True, terminator=";"):
        """The declarations that are exported, or public. A scope in which none says so has `exported` or `public` set."""
        found, last_line, i = [], -1, begin
        while True:
            i = re.compile(r"[\s;]*").match(self.bare, i).end()
            if i >= end:
                return found
            if access := re.compile(r"(public|private|protected)\s*:").match(self.bare, i):
                public, last_line, i = access[1] == "public", -1, access.end()
                continue
            if opened := re.compile(r"(export\s+)?(?:inline\s+)?(?:namespace\b[\s\w:]*)?\{").match(self.bare, i):
                close = behind(self.bare, opened.end() - 1)
                found += self.read(opened.end(), close - 1, exported or opened[1] is not None)
                i, last_line = close, -1
                continue
            start = i
            i, cut = self.item_end(start, end, terminator)
            i = start + len(self.bare[start:i].rstrip())
            line = self.text.count("\n", 0, start) + 1
            comment = self.comment_above(start) or self.comment_behind(i)
            is_beneath = line == last_line + 1
            last_line = self.text.count("\n", 0, i) + 1
            bare = self.bare[start:i]
            if not public or not (exported or re.match(r"export\b", bare)):
                continue
            if re.match(r"(export )?(import|module|static_assert|extern template|friend (class|struct))\b", bare):
                continue
            kind, name = ("enumerator", re.match(r"\w+", bare)[0]) if terminator == "," else kind_and_name(bare)
            code = self.text[start:cut if cut and kind in ("class", "enum", "function", "guide") else i]
            column = start - self.text.rfind("\n", 0, start) - 1
            one = Declaration(kind, name, shown(code, column), line, "\n".join(comment), is_beneath)
            if cut and kind in ("class", "enum"):
                is_class = kind == "class" and re.match(r"class\b", without_heads(bare))
                one.members = self.read(cut + 1, behind(self.bare, cut) - 1, True, not is_class,
                                        "," if kind == "enum" else ";")
            if kind == "enum":
                one.code += " { " + ", ".join(m.code for m in one.members) + " }"
            found.append(one)


def declarations(text):
    """What an interface exports, in its order."""
    scope = Scope(text)
    return scope.read(0, len(text), exported=False)


def partitions(modules):
    """What users can import: the partitions that tables of contents export, module by module."""
    whole = modules / "cilantro.cppm"
    order = re.findall(r"^export import cilantro\.(\w+);", whole.read_text(), re.M) if whole.exists() else []
    areas = sorted((path.parent.name for path in modules.glob("*/*.cppm") if path.stem == path.parent.name),
                   key=lambda area: (order.index(area) if area in order else len(order), area))
    for area in areas:
        paths = {path.stem: path for path in (modules / area).rglob("*.cppm")}
        waiting, seen = [area], []
        while waiting:
            name = waiting.pop(0)
            seen.append(name)
            text = paths[name].read_text()
            exports = re.findall(r"^export import :(\w+);", text, re.M)
            waiting += [e for e in exports if e not in seen + waiting]
            about = re.match(r"// SPDX[^\n]*\n//\n((?://[^\n]*\n)+)", text)
            yield Partition(area, name, paths[name], re.sub(r"^// ?", "", about[1], flags=re.M) if about else "",
                            declarations(text))
