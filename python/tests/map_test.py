#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Map: its arrays agree with each other and with what the program wrote."""
import gc
import os
import pathlib
import sys
import unittest

import numpy as np
import waymark
from support import DATA, Test, camchain, frames, map_stereo

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests"))
import map_records  # noqa: E402

FILE = DATA / "stereo_out/map.wmap"


class MapArrays(Test):
    @classmethod
    def setUpClass(cls):
        cls.map = waymark.Map.load(FILE)
        cls.keyframes = cls.map.keyframes()
        cls.landmarks = cls.map.landmarks()

    def test_keyframes_are_those_of_the_program(self):
        written = np.loadtxt(DATA / "stereo_out/keyframes.txt")
        self.assertEqual(len(self.keyframes), len(written))
        np.testing.assert_allclose(1e-9 * self.keyframes.timestamps_ns, written[:, 0], atol=1e-9)
        np.testing.assert_allclose(self.keyframes.world_from_rig[:, :3, 3], written[:, 1:4], atol=1e-7)

    def test_keyframe_is_its_row(self):
        for row in (0, len(self.keyframes) - 1):
            keyframe = self.map.keyframe(self.keyframes.ids[row])
            self.assertEqual(keyframe.id, self.keyframes.ids[row])
            self.assertEqual(keyframe.frame, self.keyframes.frames[row])
            self.assertEqual(keyframe.timestamp_ns, self.keyframes.timestamps_ns[row])
            self.assertEqual(keyframe.submap, self.keyframes.submaps[row])
            np.testing.assert_array_equal(keyframe.world_from_rig, self.keyframes.world_from_rig[row])
        self.assertIsNone(self.map.keyframe(0).parent)
        self.assertEqual(self.keyframes.parents[0], waymark.NO_ID)

    def test_tables_of_markers_are_empty_where_none_were_looked_for(self):
        markers, observations = self.map.markers(), self.map.marker_observations()
        self.assertEqual((len(markers), len(observations)), (0, 0))
        self.assertEqual(markers.world_from_marker.shape, (0, 4, 4))
        self.assertEqual(observations.pixels.shape, (0, 4, 2))

    def test_observations_go_both_ways(self):
        id = self.landmarks.ids[np.argmax(self.landmarks.num_observers)]
        landmark = self.map.landmark(id)
        row = np.searchsorted(self.landmarks.ids, id)
        np.testing.assert_array_equal(landmark.position_in_world, self.landmarks.positions_in_world[row])
        self.assertEqual(len(np.unique(landmark.observations[:, 0])), self.landmarks.num_observers[row])
        for keyframe, feature in landmark.observations:
            self.assertEqual(self.map.keyframe(keyframe).features.landmarks[feature], id)
        self.assertGreaterEqual(landmark.num_visible, landmark.num_found)

    def test_landmarks_project_onto_their_features(self):
        keyframe = self.map.keyframe(self.keyframes.ids[2])
        features, world_from_rig = keyframe.features, keyframe.world_from_rig
        used = np.flatnonzero((features.landmarks != waymark.NO_ID) & (features.cameras == 0))
        rows = np.searchsorted(self.landmarks.ids, features.landmarks[used])
        points = self.landmarks.positions_in_world[rows] - world_from_rig[:3, 3]
        pixels, is_visible = keyframe.cameras[0].project(points @ world_from_rig[:3, :3])
        self.assertGreater(is_visible.mean(), 0.99)
        errors = np.linalg.norm(pixels - features.pixels[used], axis=1)
        self.assertLess(np.median(errors), 0.5)

    def test_features(self):
        features = self.map.keyframe(0).features
        size, primary = len(features), features.num_primary
        self.assertLess(primary, size)
        for name, shape, dtype in (("pixels", (size, 2), np.float32), ("angles", (size,), np.float32),
                                   ("responses", (size,), np.float32), ("levels", (size,), np.uint8),
                                   ("cameras", (size,), np.uint8), ("bearings", (size, 3), np.float32),
                                   ("descriptors", (primary, 32), np.uint8),
                                   ("partners", (size,), np.uint32), ("ranges", (primary,), np.float32),
                                   ("landmarks", (size,), np.uint32)):
            values = getattr(features, name)
            self.assertEqual((values.shape, values.dtype), (shape, dtype), name)
            self.assertFalse(values.flags.writeable, name)
            with self.assertRaises(ValueError):
                values[...] = 0
        np.testing.assert_array_equal(features.cameras, np.arange(size) >= primary)
        np.testing.assert_allclose(np.linalg.norm(features.bearings, axis=1), 1, atol=1e-6)
        camera = self.map.keyframe(0).cameras[0]
        bearings, is_valid = camera.unproject(features.pixels[:primary])
        self.assertTrue(is_valid.all())
        np.testing.assert_allclose(bearings, features.bearings[:primary], atol=1e-5)
        self.assertGreater(np.unpackbits(features.descriptors, axis=1).mean(), 0.3)

    def test_views_outlive_the_map(self):
        arrays = waymark.Map.load(FILE).keyframe(0).features
        pixels, landmarks = arrays.pixels, arrays.landmarks
        observations = waymark.Map.load(FILE).landmark(self.landmarks.ids[0]).observations
        del arrays
        gc.collect()
        features = self.map.keyframe(0).features
        np.testing.assert_array_equal(pixels, features.pixels)
        np.testing.assert_array_equal(landmarks, features.landmarks)
        np.testing.assert_array_equal(observations,
                                      self.map.landmark(self.landmarks.ids[0]).observations)

    def test_covisibility(self):
        edges = self.map.covisibility()
        self.assertTrue((edges[:, 0] < edges[:, 1]).all())
        ids, counts = self.map.covisible(0)
        np.testing.assert_array_equal(edges[edges[:, 0] == 0][:, 1:], np.stack([ids, counts], axis=1))
        first, second = (set(self.map.keyframe(id).features.landmarks) - {waymark.NO_ID}
                         for id in (0, ids[0]))
        self.assertEqual(len(first & second), counts[0])

    def test_parts(self):
        self.assertTrue(self.map.is_metric)
        self.assertEqual([(s.id, s.is_metric, s.root, s.joined_into) for s in self.map.submaps()],
                         [(0, True, 0, None)])
        self.assertEqual(self.map.loop_edges(), [])
        self.assertIn("features:", self.map.settings)
        self.assertIn("keyframes", repr(self.map))
        mono = waymark.Map.load(DATA / "mono_out/map.wmap")
        self.assertFalse(mono.is_metric)

    def test_images_give_colors(self):
        self.assertEqual(self.map.image(0)[:2], b"\xff\xd8")
        colors = self.map.landmark_colors()
        self.assertEqual(colors.shape, (len(self.landmarks), 3))
        self.assertGreater(colors.std(), 10)
        fed = map_stereo().map()
        self.assertIsNone(fed.image(0))
        self.assertIsNone(fed.landmark_colors())

    def test_images_from_arrays(self):
        fed = map_stereo().map()
        times = {frame.timestamp_ns: frame.image0 for frame in frames()}
        images = {id: times[time] for id, time in zip(fed.keyframes().ids, fed.keyframes().timestamps_ns)}
        red = np.zeros((240, 376, 3), np.uint8)
        red[..., 0] = 255
        shown = fed.with_images(images)
        np.testing.assert_allclose(shown.landmark_colors(), self.map.landmark_colors(), atol=12)
        self.assertIsNone(fed.image(0))
        of_red = fed.with_images({id: red for id in images}).landmark_colors()
        of_red = of_red[(of_red != 128).any(axis=1)]  # Grey is what fewer than two keyframes see.
        self.assertGreater(len(of_red), 300)
        self.assertGreater(np.median(of_red[:, 0]), 245)
        self.assertLess(np.median(of_red[:, 1]), 10)
        again = fed.with_images({0: shown.image(0)})
        self.assertEqual(again.image(0), shown.image(0))
        again.save(self.folder / "images.wmap")
        self.assertEqual(waymark.Map.load(self.folder / "images.wmap").image(0), shown.image(0))
        self.assert_raises(KeyError, "10000", fed.with_images, {10000: red})
        self.assert_raises(ValueError, "images: ", fed.with_images, {0: b"no image"})
        png = sorted((DATA / "stereo/mav0/cam0/data").iterdir())[0].read_bytes()
        self.assert_raises(ValueError, "JPEG", fed.with_images, {0: png})
        self.assert_raises(ValueError, "images: ", fed.with_images, {0: red[0, 0]})
        self.assert_raises(TypeError, "images: ", fed.with_images, {0: "image.jpg"})

    def test_empty_map(self):
        empty = waymark.System(camchain()).map()
        self.assertEqual((empty.num_keyframes, len(empty.keyframes()), len(empty.landmarks())), (0, 0, 0))
        self.assertEqual(empty.keyframes().world_from_rig.shape, (0, 4, 4))
        self.assertEqual(empty.landmarks().positions_in_world.shape, (0, 3))
        self.assertEqual(empty.covisibility().shape, (0, 3))


class MapFiles(Test):
    def test_saved_and_loaded(self):
        system = map_stereo()
        system.save(self.folder / "a.wmap")
        loaded = waymark.Map.load(str(self.folder / "a.wmap"))
        for ours, theirs in ((system.map().keyframes(), loaded.keyframes()),
                             (system.map().landmarks(), loaded.landmarks())):
            for name in (name for name in dir(ours) if not name.startswith("_")):
                np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), name)
        self.assertEqual(loaded.settings, system.map().settings)
        loaded.save(self.folder / "b.wmap")
        self.assertEqual((self.folder / "a.wmap").read_bytes(), (self.folder / "b.wmap").read_bytes())

    def test_images_are_kept(self):
        waymark.Map.load(FILE).save(self.folder / "copy.wmap")
        self.assertEqual((self.folder / "copy.wmap").read_bytes(), FILE.read_bytes())

    def test_what_is_no_map(self):
        bad = self.folder / "bad.wmap"
        bad.write_bytes(FILE.read_bytes()[:5000])
        self.assert_raises(waymark.InputError, str(bad), waymark.Map.load, bad)
        self.assert_raises(waymark.InputError, "missing", waymark.Map.load, self.folder / "none.wmap")
        self.assert_raises(TypeError, "path: ", waymark.Map.load, None)
        self.assert_raises(TypeError, "path: ", waymark.Map.load, 7)
        loaded = waymark.Map.load(FILE)
        self.assert_raises(waymark.OutputError, "no/", loaded.save, self.folder / "no/map.wmap")
        for id in (10**6, -1, 2**40, waymark.NO_ID):
            self.assert_raises(KeyError, str(id), loaded.keyframe, id)
            self.assert_raises(KeyError, str(id), loaded.landmark, id)
            self.assert_raises(KeyError, str(id), loaded.covisible, id)
        self.assert_raises(TypeError, "id: ", loaded.keyframe, "0")
        with self.assertRaises(TypeError):
            waymark.Map()

    def test_text_that_is_no_utf8(self):
        records = map_records.split(FILE.read_bytes())
        next(record for record in records if record.get("kind") == "map")["settings"] = "a\udcffb"
        (self.folder / "odd.wmap").write_bytes(map_records.join(records))
        odd = waymark.Map.load(self.folder / "odd.wmap")
        self.assertEqual(odd.settings, "a\ufffdb")
        odd.save(self.folder / "again.wmap")
        self.assertIn(b"a\xffb", (self.folder / "again.wmap").read_bytes())

    def test_camera_of_an_unknown_model(self):
        records = map_records.split(FILE.read_bytes())
        next(record for record in records if record.get("kind") == "camera")["camera_model"] = "mirror"
        (self.folder / "mirror.wmap").write_bytes(map_records.join(records))
        kept = waymark.Map.load(self.folder / "mirror.wmap")
        self.assertEqual(len(kept.landmark_colors()), kept.num_landmarks)
        camera = kept.keyframe(0).cameras[0]
        self.assertEqual((camera.model, camera.width_px), ("mirror", 376))
        missing = "camera_model is mirror, expected one of: "
        self.assert_raises(waymark.InputError, missing, camera.project, [[0, 0, 1]])
        self.assert_raises(waymark.InputError, missing, waymark.System, camchain(), map=kept)
        self.assert_raises(waymark.InputError, missing, waymark.Localizer, kept, camchain())

    def test_odd_file_names(self):
        odd = os.fsdecode(bytes(self.folder) + b"/\xff.wmap")
        loaded = waymark.Map.load(FILE)
        self.assert_raises(waymark.InputError, "\ufffd.wmap: missing", waymark.Map.load, odd)
        loaded.save(odd)
        self.assertEqual(waymark.Map.load(pathlib.Path(odd)).num_keyframes, loaded.num_keyframes)
        cut = f"{FILE}\0.wmap"
        system = waymark.System(camchain())
        for function in (waymark.Map.load, loaded.save, system.save, system.trajectory().write,
                         waymark.open_input, waymark.read_grey_image, waymark.read_depth_image,
                         waymark.Calibration, waymark.System):
            self.assert_raises(ValueError, "embedded null byte", function, cut)
        self.assert_raises(ValueError, "format: ", system.trajectory().write, FILE, "tum\0")


class WithoutContent(Test):
    """What __new__() alone made is refused by whatever takes it."""

    def test_members(self):
        classes = [value for value in vars(waymark).values()
                   if isinstance(value, type) and not issubclass(value, Exception)]
        self.assertGreater(len(classes), 15)
        for cls in classes:
            for name, member in vars(cls).items():
                with self.subTest(f"{cls.__name__}.{name}"):
                    if isinstance(member, property):
                        self.assert_raises(TypeError, "__new__", getattr, cls.__new__(cls), name)
                    elif name in ("__len__", "__repr__", "__next__", "finish", "map", "submaps", "keyframes"):
                        self.assert_raises(TypeError, "__new__", member, cls.__new__(cls))

    def test_arguments(self):
        bare = {name: cls.__new__(cls) for name, cls in vars(waymark).items() if isinstance(cls, type)}
        loaded = waymark.Map.load(FILE)
        frame = frames()[0]
        for function, arguments in ((waymark.System, [bare["Calibration"]]),
                                    (waymark.Localizer, [loaded, bare["Calibration"]]),
                                    (waymark.Calibration, [bare["Calibration"]]),
                                    (waymark.open_input, [DATA / "stereo", bare["Calibration"]]),
                                    (bare["System"].feed, [0, frame.image0, frame.image1]),
                                    (bare["System"].save, [self.folder / "a.wmap"]),
                                    (bare["Map"].save, [self.folder / "a.wmap"]),
                                    (bare["Localizer"].track, [0, frame.image0, frame.image1])):
            self.assert_raises(TypeError, "__new__", function, *arguments)
        with self.assertRaises(RuntimeError):  # Of pybind11, for what is kept by a shared pointer.
            waymark.System(camchain(), map=bare["Map"])
        with self.assertRaises(RuntimeError):
            waymark.Localizer(bare["Map"], camchain())


class Cameras(Test):
    def test_calibration(self):
        calibration = waymark.Calibration(camchain())
        left, right = calibration.cameras
        self.assertEqual((left.model, left.width_px, left.height_px), ("pinhole", 376, 240))
        self.assertEqual(left.intrinsics, [290, 291, 187, 121])
        self.assertEqual((left.distortion_model, len(left.distortion_coeffs)), ("radtan", 4))
        np.testing.assert_array_equal(left.cam_from_rig, np.eye(4))
        self.assertAlmostEqual(right.cam_from_rig[0, 3], -0.2)
        pixels = np.array([[0, 0], [187, 121], [375, 239]])
        bearings, is_valid = left.unproject(pixels)
        again, is_visible = left.project(3 * bearings)
        self.assertTrue(is_valid.all() and is_visible.all())
        np.testing.assert_allclose(again, pixels, atol=1e-6)
        self.assertFalse(left.project([[0, 0, -1]])[1][0])
        self.assertEqual(left.project(np.zeros((0, 3)))[0].shape, (0, 2))
        self.assert_raises(ValueError, "(N, 3)", left.project, [[1, 2]])
        self.assert_raises(TypeError, "points_in_cam", left.project, "abc")

    def test_images_and_inputs(self):
        path = DATA / "stereo/mav0/cam0/data"
        image = waymark.read_grey_image(sorted(path.iterdir())[0])
        self.assertEqual((image.shape, image.dtype), ((240, 376), np.uint8))
        self.assert_raises(waymark.InputError, "cam0", waymark.read_grey_image, path)
        self.assert_raises(waymark.InputError, "expected", waymark.read_depth_image,
                           sorted(path.iterdir())[0])
        given = waymark.open_input(DATA / "stereo", setup="mono")
        self.assertEqual((given.format, given.setup, given.num_frames), ("euroc", "mono", 40))
        self.assertEqual(len(given.calibration.cameras), 1)
        frames = list(given)
        self.assertIsNone(frames[0].image1)
        np.testing.assert_array_equal(frames[0].image0, image)
        self.assertEqual(list(given), [])
        rgbd = next(waymark.open_input(DATA / "rgbd", cameras=camchain("rgbd")))
        self.assertEqual(rgbd.depth.dtype, np.uint16)
        self.assert_raises(waymark.InputError, "none", waymark.open_input, self.folder / "none")
        self.assert_raises(ValueError, "setup", waymark.open_input, DATA / "stereo", setup="all")


if __name__ == "__main__":
    unittest.main()
