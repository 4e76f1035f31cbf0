#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What moves before a camera at rest is no motion of its own."""
import pathlib
import sys
import unittest

import cv2
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "script"))
from cli_support import CliTest, waymark  # noqa: E402
from evaluation.boxes import write_scene  # noqa: E402

NUM_FRAMES = 60


def textured(seed):
    values = np.random.default_rng(seed).integers(0, 256, (240, 320)).astype(np.uint8)
    return cv2.equalizeHist(cv2.GaussianBlur(values, (0, 0), 2.0))


class BoxBeforeACameraAtRest(CliTest):
    def test_no_map_is_made_of_a_box_that_hides_half_of_the_view(self):
        scene = self.folder / "scene"
        hidden = write_scene(scene, [textured(1)], textured(2), 256.0, 0.65, seed=1,
                             has_hand=True, num_resting=NUM_FRAMES)
        self.assertGreater(hidden, 0.5)
        done = waymark("run", scene, "-c", scene / "camchain.yaml", "-o", self.folder / "out")
        self.assertEqual(done.returncode, 3, done.stderr)


if __name__ == "__main__":
    unittest.main()
