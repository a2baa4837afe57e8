#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Breaks each rule of check_structure.py once, in a small tree, and expects to hear of it."""
import pathlib
import tempfile
import unittest

import check_structure


def violations(files):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in files.items():
            (root / name).parent.mkdir(exist_ok=True)
            (root / name).write_text(text)
        return list(check_structure.violations_in(root))


class CheckStructure(unittest.TestCase):
    def expect(self, name, text, *wanted):
        found = violations({name: text})
        self.assertEqual(len(found), len(wanted), found)
        for sentence, part in zip(found, wanted):
            self.assertIn(part, sentence)

    def test_accepts_edges_that_lead_down(self):
        self.expect("search/kd_tree.cppm",
                    "export module cilantro.search:kd_tree;\nimport cilantro.core;\nimport :metric;\n")
        self.expect("core/core.cppm", "// What it is.\nexport module cilantro.core;\n\nexport import :error;\n")
        self.expect("search/kd_tree.cpp", "module;\n#include <algorithm>\nmodule cilantro.search;\n")

    def test_refuses_edges_up_and_sideways(self):
        self.expect("search/a.cppm", "export module cilantro.search:a;\nimport cilantro.cloud;\n", "not below")
        self.expect("search/a.cppm", "export module cilantro.search:a;\nimport cilantro.search;\n", "not below")
        self.expect("core/a.cpp", "module cilantro.core;\nimport cilantro.geometry;\n", "not below")
        self.expect("core/a.cpp", "module cilantro.core;\nimport boost;\n", "no module of ours")

    def test_refuses_headers_in_interfaces(self):
        for header in ("<Eigen/Core>", "<vector>", "<png.h>", '"search/own.hpp"'):
            self.expect("search/a.cppm", f"module;\n#include {header}\nexport module cilantro.search:a;\n",
                        "interfaces import")
        self.expect("eigen.cppm", "module;\n#include <Eigen/LU>\nexport module cilantro.eigen;\n")
        self.expect("eigen.cppm", "module;\n#include <png.h>\nexport module cilantro.eigen;\n", "interfaces import")

    def test_refuses_headers_in_units_that_the_wrapper_has(self):
        wrapper = "module;\n#include <vector>\nexport module cilantro.standard;\n"
        unit = "module;\n#include <thread>\n#include <vector>\nmodule cilantro.search;\n"
        self.assertEqual(violations({"standard.cppm": wrapper, "search/a.cpp": unit}),
                         ["search/a.cpp: includes vector, of which cilantro.standard has the names"])
        self.assertEqual(violations({"standard.cppm": wrapper, "search/plain.cpp": "#include <vector>\n"}), [])

    def test_refuses_a_target_before_a_source(self):
        declaration = "export module cilantro.search:a;\nvoid pair({});\n"
        self.expect("search/a.cppm", declaration.format("const P& source, const Q& target, int n = 0"))
        self.expect("search/a.cppm", declaration.format("const P& target,\n  const P& source = {}"), "target before a source")

    def test_refuses_headers_in_the_wrong_unit(self):
        self.expect("cloud/a.cpp", "module;\n#include <omp.h>\nmodule cilantro.cloud;\n", "alone")
        self.expect("cloud/a.cpp", "module;\n#include <Eigen/Dense>\nmodule cilantro.cloud;\n", "instead of importing")

    def test_refuses_names_that_do_not_match_and_code_in_a_table_of_contents(self):
        self.expect("core/a.cppm", "export module cilantro.core:b;\n", "should declare")
        self.expect("core/core.cppm", "export module cilantro.core;\nint x;\n", "table of contents")
        self.expect("other/a.cppm", "export module cilantro.other:a;\n", "no floor")
        self.expect("core/a.cppm", "export module cilantro.core:a;\n#pragma omp parallel\n", "OpenMP pragma")


if __name__ == "__main__":
    unittest.main()
