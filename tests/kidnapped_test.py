#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Interrupted views of recorded sequences: known places are found again, others kept apart.

Needs WAYMARK_DATA; script/evaluate --table kidnapped has more cases, which take longer."""
import os
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "script"))
from evaluation.kidnapped import CASES, Judge  # noqa: E402


class Kidnapped(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="waymark_kidnapped_")
        self.addCleanup(self._folder.cleanup)

    def judge(self, case):
        if "WAYMARK_DATA" not in os.environ:
            self.skipTest("needs WAYMARK_DATA, the folder of the recorded sequences")
        judge = Judge(pathlib.Path(os.environ["WAYMARK_DATA"]), pathlib.Path(self._folder.name))
        if not judge.has(case):
            self.skipTest(f"WAYMARK_DATA lacks a sequence of {case.title}")
        report = judge.judge(case)
        self.assertFalse(report.failures, "\n" + "\n".join(report.failures))


def add_test(case):
    setattr(Kidnapped, f"test_{case.title}", lambda self: self.judge(case))


for quick_case in (case for case in CASES if case.is_quick):
    add_test(quick_case)

if __name__ == "__main__":
    unittest.main()
