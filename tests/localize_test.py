#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Images are found in a saved map, and a saved map is extended as if there had been no break.

Needs WAYMARK_DATA."""
import os
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "script"))
from evaluation.localization import (QUERY, SHOP, alignment_with, extend, localize,  # noqa: E402
                                     map_to_file, query_of)

MAX_MEDIAN_M, MAX_MEDIAN_DEG, MAX_M = 0.03, 1.0, 0.5
MAX_EXTENDED_ATE_RATIO = 1.2
ATE_FLOOR_M = 0.002  # So much more is allowed in any case: what chance does to millimetres.


class DataTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if "WAYMARK_DATA" not in os.environ:
            raise unittest.SkipTest("needs WAYMARK_DATA, the folder of the recorded sequences")
        cls.data = pathlib.Path(os.environ["WAYMARK_DATA"])
        folder = tempfile.TemporaryDirectory(prefix="waymark_localize_")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)

    @classmethod
    def need(cls, *names):
        for name in names:
            if not (cls.data / name / "groundtruth.txt").exists():
                raise unittest.SkipTest(f"WAYMARK_DATA lacks {name}")


class Bookstore(DataTest):
    """Another camera on another path in other light."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.need(SHOP, QUERY)
        cls.map_file = cls.folder / "shop.wmap"
        map_to_file(cls.data / SHOP, cls.map_file, cls.folder / "map")
        cls.alignment = alignment_with(cls.folder / "map/trajectory.txt",
                                       cls.data / SHOP / "groundtruth.txt")

    def judge(self, min_share, *options):
        found = localize(self.map_file, self.alignment, query_of(self.data), self.folder / "out",
                         *options)
        print(found, file=sys.stderr)
        self.assertEqual(found.num_images, 264)
        self.assertGreaterEqual(found.share, min_share)
        self.assertLessEqual(found.median_m, MAX_MEDIAN_M)
        self.assertLessEqual(found.median_deg, MAX_MEDIAN_DEG)
        self.assertLessEqual(found.largest_m, MAX_M)

    def test_stream(self):
        before = self.map_file.read_bytes()
        self.judge(0.85)
        self.assertEqual(self.map_file.read_bytes(), before)

    def test_unordered(self):
        self.judge(0.6, "--unordered")


class Extend(DataTest):
    def test_drone_with_one_camera(self):
        name = "euroc_mh01_stereo"
        self.need(name)
        result = extend(self.data / name, "mono", 300, self.folder)
        print(result, file=sys.stderr)
        self.assertEqual(result.submaps, 1)
        self.assertGreaterEqual(result.coverage, 0.98)
        self.assertGreaterEqual(result.keyframes, 0.7 * result.once_keyframes)
        self.assertLessEqual(result.ate_m, max(MAX_EXTENDED_ATE_RATIO * result.once_ate_m,
                                               result.once_ate_m + ATE_FLOOR_M))


if __name__ == "__main__":
    unittest.main()
