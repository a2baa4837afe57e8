#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Small interfaces, with and without comments, of which check_comments.py and the reference must find the right names."""
import pathlib
import tempfile
import unittest

import check_comments
from interfaces import declarations
from reference import Reference


def with_modules(body, use, exports=("a",), more=()):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder) / "modules"
        (root / "search").mkdir(parents=True)
        contents = "".join(f"export import :{name};\n" for name in exports)
        (root / "search/search.cppm").write_text(f"export module cilantro.search;\n{contents}")
        for name, text in [("a", body), *more]:
            (root / f"search/{name}.cppm").write_text(f"export module cilantro.search:{name};\nnamespace cilantro {{\n{text}\n}}\n")
        return use(root)


def uncommented(body, **more):
    return with_modules(body, lambda root: [name for _, _, name in check_comments.uncommented(root)], **more)


class CheckComments(unittest.TestCase):
    def test_asks_for_a_comment_of_everything_exported(self):
        self.assertEqual(uncommented("export void f();\n\n// Not one of those.\nexport struct s {};\n\nvoid hidden();"), ["f", "s"])
        self.assertEqual(uncommented("export using a = int;\n\nexport enum class e { x };\n\nexport inline constexpr int c = 1;\n\n"
                                     "export template <class T>\nconcept k = requires(T t) { t.f(); };"), ["a", "e", "e::x", "c", "k"])
        self.assertEqual(uncommented("export {\nvoid f();\n\n/// What it does.\nvoid g();\n}"), ["f"])
        self.assertEqual(uncommented("/// What it does.\n\nexport void f();"), ["f"])

    def test_lets_declarations_stand_together(self):
        self.assertEqual(uncommented("/// What both do.\nexport void f();\nexport void g();"), [])
        self.assertEqual(uncommented("/// What it does.\nexport void f();\n\nexport void f(int);"), [])
        self.assertEqual(uncommented("/// What it does.\nexport void f();\n\nexport void g();"), ["g"])
        self.assertEqual(uncommented("/// What it is.\nexport struct s {};\n\nexport s(int) -> s;"), [])
        self.assertEqual(uncommented("export void f(int);", exports=("a", "b"), more=[("b", "/// What it does.\nexport void f();")]), [])
        self.assertEqual(uncommented("export void f(int);", more=[("b", "/// What it does.\nexport void f();")]), ["f"])

    def test_asks_for_a_comment_of_each_member_that_holds_data(self):
        self.assertEqual(uncommented("/// Options.\nexport struct o {\n  int a = 1;  ///< What it is.\n  int b{2};\n  /// What it is.\n"
                                     "  int c;\n  int threads = 0;\n};"), ["o::b"])
        self.assertEqual(uncommented("/// The `k` nearest.\nexport struct knn {\n  int k;\n};"), [])
        self.assertEqual(uncommented("/// Kinds.\nexport enum class e {\n  a,  ///< What it is.\n  b\n};"), ["e::b"])
        self.assertEqual(uncommented("/// Either of both.\nexport enum class e { a, b };"), [])

    def test_asks_for_a_comment_of_public_functions_that_nothing_else_explains(self):
        self.assertEqual(uncommented("/// What it is.\nexport class c {\n public:\n  c() : x_{1} {}\n  int size() const { return 1; }\n"
                                     "  int f() const;\n\n private:\n  int g();\n  int x_;\n};"), ["c::f"])
        self.assertEqual(uncommented("/// Semantics: `fit(x)` fits.\nexport template <class T>\nconcept K = true;\n\n"
                                     "/// A model of it.\nexport struct m {\n  int fit(int);\n  int fat(int);\n};"), ["m::fat"])


class Interfaces(unittest.TestCase):
    def names(self, text):
        return [one.name for one in declarations(text)]

    def test_finds_names_whatever_is_around_them(self):
        self.assertEqual(self.names("export template <class T>\n  requires(sizeof(T) > 1) && requires(T t) { t.f(); }\n"
                                    "[[nodiscard]] auto f(const T& t = {}) -> std::optional<T> {\n  return \"}\";\n}\nexport int g();"), ["f", "g"])
        self.assertEqual(self.names("export std::function<void(int)> f(int);\nexport bool operator==(a, b);\nexport std::vector<int> v{1, 2};"),
                         ["f", "operator==", "v"])
        self.assertEqual(self.names("// export void no();\n/* export void no(); */\n#define X export void no();\nexport void yes();"), ["yes"])

    def test_shows_no_bodies(self):
        first = declarations("export template <class T>\nclass c : public b {\n public:\n  explicit c(int x) : x_{x} { f(); }\n"
                             "  int x_ = 3;\n private:\n  int y_;\n};")[0]
        self.assertEqual(first.code, "template <class T>\nclass c : public b")
        self.assertEqual([m.code for m in first.members], ["explicit c(int x)", "int x_ = 3"])
        self.assertEqual(declarations("export [[nodiscard]] int f(int a,\n                           int b);")[0].code,
                         "int f(int a,\n      int b)")

    def test_reference_has_a_page_for_what_is_exported(self):
        def pages(root):
            Reference(root).write(root / "out")
            return {p.relative_to(root / "out").as_posix(): p.read_text() for p in (root / "out").rglob("*.md")}
        written = with_modules("/// Does `g`.\nexport void f();", pages, exports=("a", "c"),
                               more=[("b", "/// No.\nexport void hidden();"), ("c", "/// Yes.\nexport void g();")])
        self.assertEqual(sorted(written), ["index.md", "search/a.md", "search/c.md", "search/index.md"])
        self.assertIn("Does [`g`](../search/c.md#g).", written["search/a.md"])
        self.assertIn("[`f`](search/a.md#f)", written["index.md"])
        self.assertIn("`import cilantro.search;`", written["search/a.md"])


if __name__ == "__main__":
    unittest.main()
