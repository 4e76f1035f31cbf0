#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps of OpenVSLAM and stella_vslam come in as they are.

The real one needs WAYMARK_DATA with stella_bookstore/map.msg (or .msg.xz) and the sequences it is of."""
import lzma
import os
import pathlib
import unittest

import numpy as np
import waymark
from importing_support import ImportTest, SmallMap, camera, make_database, pose
from waymark import importing, importing_settings


class Small(ImportTest):
    def test_holds_what_the_file_holds(self):
        small = SmallMap()
        loaded, notes = self.load(small)
        self.assertEqual(notes, [])
        self.assertEqual((loaded.num_keyframes, loaded.num_landmarks), (3, 30))
        self.assertEqual([submap.is_metric for submap in loaded.submaps()], [False])
        self.assert_no_residuals(loaded)

        last = loaded.keyframe(2)
        self.assertEqual((last.parent, last.timestamp_ns, last.frame), (1, 102_500_000_000, 2))
        rig_from_world = np.linalg.inv(last.world_from_rig)
        self.assertLess(np.linalg.norm(rig_from_world[:3, 3] - pose(2)[1]), 1e-9)
        features = last.features
        self.assertEqual(len(features), 31)
        self.assertEqual(features.landmarks[30], waymark.NO_ID)
        self.assertEqual(features.levels[11], 3)
        self.assertAlmostEqual(features.angles[11], -np.pi / 2, places=6)
        self.assertEqual(features.descriptors[4].view("<u4").tolist(), small.keyframe(2)["descs"][4])

        landmark = loaded.landmark(7)
        self.assertEqual((landmark.num_visible, landmark.num_found, len(landmark.observations)), (9, 5, 3))
        edge, = loaded.loop_edges()
        self.assertEqual((edge.from_keyframe, edge.to_keyframe), (0, 2))
        self.assertLess(np.linalg.norm(edge.to_from_from - rig_from_world), 1e-9)
        loaded.save(self.folder / "map.wmap")
        self.assertEqual(waymark.Map.load(self.folder / "map.wmap").num_landmarks, 30)

    def test_older_keys(self):
        small = SmallMap()
        for key in ("orb_params", "keyframe_next_id"):
            del small.document[key]
        small.document["frame_next_id"] = 90
        for number in range(3):
            keyframe = small.keyframe(number)
            del keyframe["orb_params"]
            keyframe.update(src_frm_id=30 * number, depth_thr=40.0, keypts=keyframe["undist_keypts"], n_scale_levels=8,
                            scale_factor=1.44)  # Two of our levels each.
        small.keyframe(0)["span_parent"] = -1
        loaded, _ = self.load(small)
        self.assert_no_residuals(loaded)
        levels = loaded.keyframe(0).features.levels
        self.assertEqual((levels[11], levels[7]), (6, 7))  # No coarser one here.

    def stereo_map(self, **numbers):
        small = SmallMap(camera(**numbers))
        for number in range(3):
            keyframe = small.keyframe(number)
            for i, (point, (_, _, z)) in enumerate(zip(keyframe["undist_keypts"], small.seen(number))):
                keyframe["x_rights"].append(-1.0 if i == 3 else point["pt"][0] - 40 / z)
                keyframe["depths"].append(-1.0 if i == 3 else z)
            keyframe["x_rights"].append(-1.0)
            keyframe["depths"].append(-1.0)
        return small

    def test_stereo_keeps_right_columns_and_ranges(self):
        small = self.stereo_map(setup_type="Stereo", focal_x_baseline=40.0)
        loaded, _ = self.load(small)
        self.assert_no_residuals(loaded)
        self.assertTrue(loaded.submaps()[0].is_metric)
        features = loaded.keyframe(1).features
        self.assertEqual(features.num_primary, 31)
        self.assertEqual((features.partners[3], features.ranges[3]), (waymark.NO_ID, 0))
        self.assertEqual(features.partners[features.partners[4]], 4)
        self.assertEqual(features.landmarks[4], 4)
        self.assertAlmostEqual(features.ranges[4], np.linalg.norm(small.seen(1)[4]), delta=1e-3)

    def test_depth_gives_ranges(self):
        small = self.stereo_map(setup_type="RGBD")
        loaded, _ = self.load(small)
        features = loaded.keyframe(1).features
        self.assertEqual((len(features), features.ranges[3]), (31, 0))
        self.assertAlmostEqual(features.ranges[4], np.linalg.norm(small.seen(1)[4]), delta=1e-3)

    def test_other_cameras(self):
        around = {"model_type": "Equirectangular", "setup_type": "Monocular", "cols": 1280, "rows": 640}
        for model in (camera(model_type="Fisheye", k4=0.001, setup_type="RGBD"), camera(model_type="RadialDivision", distortion=-0.1),
                      around):
            with self.subTest(model["model_type"]):
                loaded, _ = self.load(SmallMap(model))
                self.assertEqual(len(loaded.keyframe(1).features), 31)
                self.assert_no_residuals(loaded)

    def test_leaves_out_what_leads_nowhere(self):
        small = SmallMap()
        landmarks = small.document["landmarks"]
        del landmarks["5"]
        small.keyframe(1)["lm_ids"][8] = 7
        small.keyframe(1)["loop_edges"] = [77]
        small.keyframe(2)["undist_keypts"][9]["pt"] = [-9000.0, 0.0]
        landmarks["99"] = landmarks["4"]
        landmarks["6"]["ref_keyfrm"] = 1234
        loaded, notes = self.load(small)
        self.assertEqual((loaded.num_landmarks, len(loaded.keyframe(2).features)), (29, 30))
        self.assertEqual([note.split(": ")[1].split()[0] for note in notes], ["1", "3", "1", "1", "1"])

    def test_each_tree_is_a_submap(self):
        small = SmallMap()
        small.keyframe(0)["span_parent"] = 1  # Children may be older than their parents.
        small.keyframe(1)["span_parent"] = small.keyframe(2)["span_parent"] = -1
        loaded, _ = self.load(small)
        self.assertEqual((len(loaded.submaps()), loaded.num_keyframes), (2, 3))


class DataBase(ImportTest):
    def test_is_the_map_of_the_other_format(self):
        expected, _ = self.load(SmallMap())
        loaded, notes = self.load_database(SmallMap())
        self.assertEqual(len(notes), 1)
        self.assertIn("is 8 levels of 1.2; --settings FILE", notes[0])
        for number in range(3):
            one, other = expected.keyframe(number), loaded.keyframe(number)
            self.assertEqual(one.timestamp_ns, other.timestamp_ns)
            self.assertLess(np.abs(one.world_from_rig - other.world_from_rig).max(), 1e-12)
            for values in ("pixels", "levels", "descriptors", "landmarks"):
                self.assertTrue(np.array_equal(getattr(one.features, values), getattr(other.features, values)), values)
        for values in ("positions_in_world", "num_observers", "num_visible"):
            self.assertTrue(np.array_equal(getattr(expected.landmarks(), values), getattr(loaded.landmarks(), values)), values)
        self.assertEqual(len(loaded.loop_edges()), 1)

    def test_takes_the_pyramid_from_the_settings(self):
        make_database(self.db, SmallMap().document)

        def load(text):
            return importing.take_over(self.db, importing_settings.Settings("c.yaml", text))

        loaded, _, _ = load(b"Feature: {scale_factor: 1.44, num_levels: 8}\n")
        self.assertEqual(loaded.keyframe(0).features.levels[3], 6)  # Two of our levels each.
        self.assert_raises(waymark.InputError, "expected a level below 4", load, b"Feature.num_levels: 4\n")


class Recorded(ImportTest):
    def setUp(self):
        super().setUp()
        self.data = pathlib.Path(os.environ.get("WAYMARK_DATA", "none"))
        path = self.data / "stella_bookstore/map.msg"
        if not path.exists() and path.with_suffix(".msg.xz").exists():
            self.msg.write_bytes(lzma.decompress(path.with_suffix(".msg.xz").read_bytes()))
            path = self.msg
        if not path.exists() or not (self.data / "sim_bookstore_query_mono/groundtruth.txt").exists():
            self.skipTest("WAYMARK_DATA has no stella_bookstore/map.msg")
        self.map, self.notes = waymark.import_map(path)

    def test_fits_its_observations(self):
        self.assertEqual((self.map.num_keyframes, self.map.num_landmarks, self.notes), (26, 3158, []))
        positions = dict(zip(self.map.landmarks().ids.tolist(), self.map.landmarks().positions_in_world))
        errors = []
        for number in self.map.keyframes().ids.tolist():
            keyframe = self.map.keyframe(number)
            features = keyframe.features
            is_used = features.landmarks != waymark.NO_ID
            points = np.array([[*positions[one], 1] for one in features.landmarks[is_used].tolist()])
            pixels, _ = keyframe.cameras[0].project((points @ np.linalg.inv(keyframe.world_from_rig).T)[:, :3])
            errors.extend(np.linalg.norm(pixels - features.pixels[is_used], axis=1))
        self.assertGreater(len(errors), 10_000)
        self.assertLess(np.median(errors), 1.5)

    def test_finds_another_camera(self):
        """The other camera has another lens, walked another way and under other light. Some 150 of the images show what the map
        shows."""
        aligned = self.map.align(trajectory=self.data / "sim_bookstore_mono/groundtruth.txt")
        query = self.data / "sim_bookstore_query_mono"
        truth = np.loadtxt(query / "groundtruth.txt")
        localizer = waymark.Localizer(aligned, query / "camchain.yaml", setup="mono", seed=0)
        errors = []
        for frame in waymark.open_input(query, cameras=query / "camchain.yaml"):
            found = localizer.locate(frame.image0)
            if found.world_from_rig is not None:
                errors.append(np.linalg.norm(found.world_from_rig[:3, 3] - truth[frame.index, 1:4]))
        self.assertGreaterEqual(len(errors), 90)
        self.assertLessEqual(np.median(errors), 0.15)


if __name__ == "__main__":
    unittest.main()
