#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Atlas: maps in tiles, and images found in them."""
import unittest

import numpy as np
import waymark
from support import DATA, Test, camchain, frames


class OfOneMap(Test):
    def make(self):
        atlas = waymark.Atlas(self.folder / "atlas")
        return atlas, atlas.add([DATA / "stereo_out/map.wmap"], keyframes=8)

    def test_tiles(self):
        atlas, added = self.make()
        self.assertEqual(added["num_added"], 1)
        self.assertEqual(len(atlas.tiles), added["num_tiles"])
        self.assertEqual([recording["name"] for recording in atlas.recordings], ["map"])
        self.assertTrue(all(tile["frame"] == 0 and tile["num_keyframes"] <= 8 for tile in atlas.tiles))
        self.assertTrue(all(link["is_border"] for link in atlas.links))
        self.assertEqual(atlas.check(), [])
        whole, map_of_one = atlas.export(), waymark.Map.load(DATA / "stereo_out/map.wmap")
        self.assertEqual(len(whole.keyframes()), len(map_of_one.keyframes()))
        again = waymark.Atlas(self.folder / "atlas")
        self.assertEqual(again.tiles, atlas.tiles)
        self.assertEqual(again.add([DATA / "stereo_out/map.wmap"])["num_added"], 0)
        self.assertEqual(again.optimize(), 0)

    def test_localizing(self):
        atlas, _ = self.make()
        localizer = waymark.AtlasLocalizer(atlas, camchain(), max_open_tiles=1)
        roomy = waymark.AtlasLocalizer(atlas, camchain(), max_open_tiles=16)
        truth = np.loadtxt(DATA / "stereo_out/trajectory.txt")[:, 1:4]
        images = frames()
        for index in (30, 3, 17, 30, 3):
            result = localizer.locate(images[index].image0, images[index].image1)
            self.assertEqual((result.state, result.submap), ("tracked", 0))
            self.assertLess(np.linalg.norm(result.world_from_rig[:3, 3] - truth[index]), 0.02)
            # Whatever is open.
            other = roomy.locate(images[index].image0, images[index].image1)
            np.testing.assert_array_equal(other.world_from_rig, result.world_from_rig)
        for index in range(5, 35):
            frame = images[index]
            result = localizer.track(frame.timestamp_ns, frame.image0, frame.image1)
            self.assertLess(np.linalg.norm(result.world_from_rig[:3, 3] - truth[index]), 0.02)
        self.assertGreaterEqual(localizer.num_opened, 1)

    def test_faults(self):
        (self.folder / "file").write_text("no atlas")
        self.assert_raises(waymark.InputError, "no atlas", waymark.Atlas, self.folder)
        atlas, _ = self.make()
        self.assert_raises(ValueError, "8 to 2048", atlas.add, [], keyframes=3)
        self.assert_raises(waymark.InputError, "missing", atlas.add, [self.folder / "missing.wmap"])


if __name__ == "__main__":
    unittest.main()
