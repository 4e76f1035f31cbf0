#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Two rooms that look exactly alike: places of one are never taken for places of the other."""
import json
import unittest

from cli_support import CAMERA, CliTest, waymark

NUM_FRAMES = 440
RATE_HZ = 12.5  # 1 m/s on the way through both rooms and back, 33 m.
ROOMS_APART_M = 5.2


class Twins(CliTest):
    """The walk begins in the middle of a round in one room, so that back there it comes to places of
    which only the twins in the other room have been seen."""

    def test_no_place_is_taken_for_its_twin(self):
        source = self.folder / "twins"
        done = waymark("simulate", "twins", "--motion", "loop", "--camera", self.config(CAMERA),
                       "--setup", "rgbd", "--frames", NUM_FRAMES, "--rate", RATE_HZ, "-o", source)
        self.assertEqual(done.returncode, 0, done.stderr)
        for setup, alignment in (("rgbd", "se3"), ("mono", "sim3")):
            with self.subTest(setup):
                done = self.run_on(source, "-c", source / "camchain.yaml", "--setup", setup)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertGreater(self.summary()["coverage"], 0.98)
                self.assertEqual(self.summary()["submaps"], 1)
                done = waymark("eval", self.out / "trajectory.txt", source / "groundtruth.txt",
                               "--align", alignment, "--json")
                # A single pose in the wrong room is wrong by ROOMS_APART_M, and a loop between the
                # rooms draws them together.
                self.assertLess(json.loads(done.stdout)["ate_max_m"], 0.05 * ROOMS_APART_M)


if __name__ == "__main__":
    unittest.main()
