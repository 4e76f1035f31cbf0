#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Localizer: images are found in a saved map where they were taken."""
import threading
import unittest

import numpy as np
import waymark
from support import DATA, Test, camchain, frames


class Localizing(Test):
    @classmethod
    def setUpClass(cls):
        cls.map = waymark.Map.load(DATA / "stereo_out/map.wmap")
        cls.truth = np.loadtxt(DATA / "stereo_out/trajectory.txt")[:, 1:4]
        cls.frames = frames()

    def check(self, index, result):
        self.assertEqual((result.state, result.reason, result.submap), ("tracked", "none", 0))
        self.assertGreater(result.num_inliers, 50)
        self.assertLess(np.linalg.norm(result.world_from_rig[:3, 3] - self.truth[index]), 0.01)
        self.assertTrue((np.linalg.eigvalsh(result.covariance) > 0).all())

    def test_single_images(self):
        localizer = waymark.Localizer(self.map, camchain(), setup="mono")
        self.assertIs(localizer.map, self.map)
        for index in (30, 3, 17):
            self.check(index, localizer.locate(self.frames[index].image0))
        self.assertEqual(localizer.calibration(), [])

    def test_hint(self):
        localizer = waymark.Localizer(self.map, camchain(), setup="mono")
        hint = self.map.keyframe(0).world_from_rig
        self.check(2, localizer.locate(self.frames[2].image0, hint=hint))
        self.check(2, localizer.locate(self.frames[2].image0, hint=hint.tolist(), submap=0))
        far = np.eye(4)
        far[:3, 3] = 1000
        self.check(2, localizer.locate(self.frames[2].image0, hint=far))

    def test_stream(self):
        localizer = waymark.Localizer(self.map, camchain())
        for index in range(10, 30):
            frame = self.frames[index]
            self.check(index, localizer.track(frame.timestamp_ns, frame.image0, frame.image1))

    def test_depth_camera_in_the_map_of_one_camera(self):
        scale_free = waymark.Map.load(DATA / "mono_out/map.wmap")
        localizer = waymark.Localizer(scale_free, camchain("rgbd"))
        frame = frames("rgbd")[20]
        self.assertIsNotNone(localizer.locate(frame.image0, depth=frame.depth).world_from_rig)

    def test_diagnosis(self):
        localizer = waymark.Localizer(self.map, camchain(), setup="mono")
        nothing = localizer.locate(np.zeros((240, 376), np.uint8))
        self.assertEqual((nothing.state, nothing.reason), ("lost", "no_features"))
        noise = np.random.default_rng(0).integers(0, 256, (240, 376), dtype=np.uint8)
        lost = localizer.locate(noise)
        self.assertIsNone(lost.world_from_rig)
        self.assertNotEqual(lost.reason, "none")
        self.assertIsNone(lost.submap)

    def test_wrong_arguments(self):
        localizer = waymark.Localizer(self.map, camchain(), setup="mono")
        image = self.frames[0].image0
        for hint, error in ((np.zeros((4, 4)), waymark.InputError), (2 * np.eye(4), waymark.InputError),
                            (np.full((4, 4), np.nan), waymark.InputError), (np.eye(3), ValueError),
                            (np.zeros((8, 4)), ValueError), ("here", TypeError)):
            self.assert_raises(error, "hint: ", localizer.locate, image, hint=hint)
        for submap, error in ((1, ValueError), (-1, ValueError), ("0", TypeError)):
            self.assert_raises(error, "submap: ", localizer.locate, image, hint=np.eye(4), submap=submap)
        self.assert_raises(TypeError, "image0: ", localizer.locate, None)
        self.assert_raises(ValueError, "image1: ", localizer.locate, image, image)
        self.assert_raises(TypeError, "image0: ", localizer.track, 0, "image")
        localizer.track(5, image)
        self.assert_raises(waymark.InputError, "time stamp", localizer.track, 5, image)
        with self.assertRaises(TypeError):
            waymark.Localizer(None, camchain())
        empty = waymark.System(camchain()).map()
        result = waymark.Localizer(empty, camchain(), setup="mono").locate(image)
        self.assertIsNone(result.world_from_rig)

    def test_one_map_for_many_threads(self):
        found = {}

        def locate(index):
            localizer = waymark.Localizer(self.map, camchain(), setup="mono")
            found[index] = localizer.locate(self.frames[index].image0)

        threads = [threading.Thread(target=locate, args=(index,)) for index in (5, 15, 25)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for index, result in found.items():
            self.check(index, result)
        self.assertEqual(len(found), 3)


if __name__ == "__main__":
    unittest.main()
