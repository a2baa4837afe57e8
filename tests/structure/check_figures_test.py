#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Quotes figures rightly and wrongly, and expects check_figures.py to tell."""
import unittest

from check_figures import violations

README = "A pipeline\ncompiles in {seconds} s.\n- **Fast**: normals and outliers {first} times as fast, PLY files\n  {second} times,\n [measured](x)."
PERFORMANCE = """
| one thread | cilantro | Open3D | PCL | nanoflann and loops |
|---|---|---|---|---|
| normals, 10 | 10.0 | 21.0 (2.1×) ≠ | 30.0 (3.0×) | 990.0 (99.0×) |
| statistical outliers | 10.0 |  | 77.0 (7.7×) |  |
| read PLY | 1.0 | 15.2 (15.2×) | 45.6 (45.6×) |  |
| write PLY | 1.0 | 5.2 (5.2×) |  |  |

| two threads | cilantro | Open3D | PCL | nanoflann and loops |
|---|---|---|---|---|
| normals, 10 | 10.0 | 99.0 (9.9×) | 99.0 (9.9×) |  |

| read, clean, downsample, normals, write | 0.36 s |
"""


class CheckFigures(unittest.TestCase):
    def expect(self, first, second, seconds, *wanted):
        found = list(violations(README.format(first=first, second=second, seconds=seconds), PERFORMANCE))
        self.assertEqual(len(found), len(wanted), found)
        for sentence, part in zip(found, wanted):
            self.assertIn(part, sentence)

    def test_accepts_what_was_measured_as_it_is_rounded(self):
        self.expect("3.0 to 7.7", "5 to 46", "0.36")
        self.expect("3 to 8", "5.2 to 45.6", "0.4")

    def test_refuses_other_figures(self):
        self.expect("2.1 to 7.7", "5 to 46", "0.4", "3.0 to 7.7")
        self.expect("3 to 8", "5 to 45", "0.4", "5.2 to 45.6")
        self.expect("3 to 8", "5 to 46", "0.3", "0.36 s")

    def test_refuses_what_it_cannot_find(self):
        self.assertIn("no row", list(violations("**Fast**: cooking 2 to 3 times [measured]", PERFORMANCE))[0])
        self.assertIn("no figures", list(violations("slow", PERFORMANCE))[0])


if __name__ == "__main__":
    unittest.main()
