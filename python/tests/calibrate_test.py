#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A calibration is found from images alone."""
import unittest

import waymark
from support import DATA, Test


class Calibrate(Test):
    def test_finds_a_camera(self):
        found = waymark.calibrate(DATA / "stereo/mav0/cam0/data", fov_deg=68)
        self.assertEqual(found.model, "perspective")
        camera, = found.calibration.cameras
        self.assertEqual((camera.width_px, camera.height_px), (376, 240))
        self.assertLess(abs(camera.intrinsics[0] / 290 - 1), 0.1)
        self.assertTrue(60 < found.fov_deg < 76, found.fov_deg)
        self.assertTrue(0 < found.focal_sigma < 1)
        self.assertIsInstance(found.is_sure, bool)
        self.assertIn("model: perspective", found.report)
        waymark.System(found.calibration)

    def test_says_what_is_wrong(self):
        self.assert_raises(waymark.InputError, "holds no image", waymark.calibrate, self.folder)
        self.assert_raises(ValueError, ["fov_deg", "expected 5 to 240"], waymark.calibrate,
                           DATA / "stereo", 1000.0)


if __name__ == "__main__":
    unittest.main()
