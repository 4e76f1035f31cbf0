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
    @classmethod
    def setUpClass(cls):
        if "WAYMARK_DATA" not in os.environ:
            raise unittest.SkipTest("needs WAYMARK_DATA, the folder of the recorded sequences")
        cls._folder = tempfile.TemporaryDirectory(prefix="waymark_kidnapped_")
        cls.addClassCleanup(cls._folder.cleanup)
        cls._judge = Judge(pathlib.Path(os.environ["WAYMARK_DATA"]), pathlib.Path(cls._folder.name))

    def judge(self, case):
        if not self._judge.has(case):
            self.skipTest(f"WAYMARK_DATA lacks a sequence of {case.title}")
        report = self._judge.judge(case)
        self.assertFalse(report.failures, "\n" + "\n".join(report.failures))


def add_test(case):
    setattr(Kidnapped, f"test_{case.title}", lambda self: self.judge(case))


for quick_case in (case for case in CASES if case.is_quick):
    add_test(quick_case)

if __name__ == "__main__":
    unittest.main()
