#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Settings of OpenVSLAM, stella_vslam and ORB-SLAM become calibrations."""
import math
import random
import unittest

import numpy as np
import waymark
from support import Test
from waymark import importing_settings

EUROC = [458.654, 457.296, 367.215, 248.375]
LENS = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0]
SECTIONS = """
Camera:
  name: "cam"
  setup: "monocular"
  model: "perspective"
  fx: 458.654
  fy: 457.296
  cx: 367.215
  cy: 248.375
  k1: -0.28340811
  k2: 0.07395907
  p1: 0.00019359
  p2: 1.76187114e-05
  k3: 0.0
  fps: 20.0
  cols: 752
  rows: 480
  color_order: "Gray"
Preprocessing:
  min_size: 250
Mapping:
  backend: "g2o"
"""
FLAT = """%YAML:1.0
# Camera
Camera.name: "Kinect"
Camera.setup: "RGBD"
Camera.model: "fisheye"
Camera.fx: 500.0
Camera.fy: 501.0
Camera.cx: 320.5
Camera.cy: 241.5
Camera.k1: 0.01
Camera.k2: 0.002
Camera.k3: -0.001
Camera.k4: 0.0001
Camera.cols: 640
Camera.rows: 480
Feature.max_num_keypoints: 1000
Feature.mask_rectangles:
  - [0.0, 1.0, 0.0, 0.1]
depthmap_factor: 5000.0
"""
STEREO = """
Camera: {setup: stereo, model: perspective, cols: 640, rows: 480, fx: 350, fy: 350, cx: 320,
         cy: 240, focal_x_baseline: 42.0}
"""
SECOND = """Camera2.fx: 457.587
Camera2.fy: 456.134
Camera2.cx: 379.999
Camera2.cy: 255.238
Camera2.k1: -0.28368365
Stereo.ThDepth: 60.0
Stereo.T_c1_c2: !!opencv-matrix
  rows: 4
  cols: 4
  dt: f
  data: [1,0,0,0.11, 0,1,0,-0.0002, 0,0,1,0.0009, 0,0,0,1.0]
"""
OLDER = "Camera.fx: 435.2\nCamera.fy: 435.2\nCamera.cx: 367.4\nCamera.cy: 252.2\nCamera.k1: 0.0\nCamera.width: 752\nCamera.height: 480\n"


def newer(kind, more=""):
    return (f'%YAML:1.0\n\nFile.version: "1.0"\nCamera.type: "{kind}"\nCamera1.fx: 458.654\nCamera1.fy: 457.296\nCamera1.cx: 367.215\n'
            "Camera1.cy: 248.375\nCamera1.k1: -0.28340811\nCamera1.k2: 0.07395907\nCamera1.p1: 0.00019359\nCamera1.p2: 1.76187114e-05\n"
            "Camera.width: 752\nCamera.height: 480\nCamera.fps: 20\nORBextractor.nFeatures: 1000\n" + more)


def read(text, name="s.yaml"):
    return importing_settings.read(name, text.encode())


class SettingsTest(Test):
    def assert_fails(self, text, *words):
        self.assert_raises(waymark.InputError, words, read, text)

    def assert_camera(self, camera, intrinsics, lens, coefficients, size):
        self.assertEqual((camera.intrinsics, camera.distortion_model, camera.distortion_coeffs), (intrinsics, lens, coefficients))
        self.assertEqual((camera.width_px, camera.height_px), size)


class Openvslam(SettingsTest):
    def test_sections(self):
        calibration = read(SECTIONS)
        camera, = calibration.cameras
        self.assert_camera(camera, EUROC, "radtan", LENS, (752, 480))
        self.assertIsNone(calibration.depth_factor)
        self.assertEqual(calibration.notes, ["s.yaml: settings of another program's algorithms are ignored: Preprocessing, Mapping"])

    def test_flat_keys_of_old_files(self):
        calibration = read(FLAT)
        self.assert_camera(calibration.cameras[0], [500, 501, 320.5, 241.5], "equidistant", [0.01, 0.002, -0.001, 0.0001], (640, 480))
        self.assertEqual(calibration.depth_factor, 5000)
        self.assertTrue(calibration.notes[0].endswith(": Feature"))

    def test_other_models(self):
        around = read("Camera: {setup: monocular, model: equirectangular, cols: 1920, rows: 960}")
        self.assertEqual(around.cameras[0].model, "equirectangular")
        division = read("Camera: {setup: monocular, model: radial_division, cols: 640, rows: 480, fx: 300, fy: 300, cx: 320, cy: 240, "
                        "distortion: -0.1}")
        self.assertEqual(division.cameras[0].model, "division")

    def test_rectified_pairs(self):
        left, right = read(STEREO).cameras
        self.assertAlmostEqual(right.cam_from_rig[0, 3], -0.12, places=12)
        self.assertEqual(left.intrinsics, right.intrinsics)

    def test_undoes_rectification(self):
        """What each camera sees, turned by its R, must lie in the same row, 42 / z columns apart."""
        c, s = math.cos(0.02), math.sin(0.02)
        left, right = read(STEREO + f"""StereoRectifier:
  K_left: [400, 0, 310, 0, 401, 245, 0, 0, 1]
  K_right: [405, 0, 312, 0, 406, 241, 0, 0, 1]
  D_left: [-0.2, 0.05, 0.001, 0.0002, 0.0]
  D_right: [-0.21, 0.04, 0.0, 0.0003, 0.0]
  R_left: [{c!r}, 0, {s!r}, 0, 1, 0, {-s!r}, 0, {c!r}]
  R_right: [{c!r}, {-s!r}, 0, {s!r}, {c!r}, 0, 0, 0, 1]
""").cameras
        self.assert_camera(left, [400, 401, 310, 245], "radtan", [-0.2, 0.05, 0.001, 0.0002, 0], (640, 480))
        self.assertEqual(right.intrinsics[0], 405)
        point = np.array([0.5, -0.3, 4.0])  # In camera 0.
        in_left = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ point
        in_right = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ (right.cam_from_rig @ [*point, 1])[:3]
        self.assertAlmostEqual(in_left[1] / in_left[2], in_right[1] / in_right[2], places=12)
        self.assertAlmostEqual(350 * (in_left[0] / in_left[2] - in_right[0] / in_right[2]), 42 / in_left[2], places=9)

    def test_names_what_is_wrong(self):
        self.assert_fails("a: 1", "s.yaml: has no Camera.model, which is needed")
        self.assert_fails("Camera: 3", "has no Camera.model")
        self.assert_fails("\nCamera: {model: square, setup: monocular, cols: 9, rows: 9, fx: 1, fy: 1, cx: 1, cy: 1}",
                          "s.yaml:2: Camera: model 'square'")
        self.assert_fails("Camera: {model: perspective, setup: monocular, cols: 640, rows: 480}", "has no fx")
        self.assert_fails("Camera: {model: perspective, setup: two, cols: 640, rows: 480, fx: 300, fy: 300, cx: 320, cy: 240}",
                          "set-up 'two'")
        self.assert_fails(STEREO + "StereoRectifier: {K_left: [1, 2]}", "R_left")
        self.assert_fails(SECTIONS.replace("458.654", "wide"), "s.yaml:6: Camera.fx is wide, expected a number")
        self.assert_fails(SECTIONS.replace("458.654", "-458.654"), "Camera: ")


class Orbslam(SettingsTest):
    def test_one_camera(self):
        calibration = read(newer("PinHole"))
        camera, = calibration.cameras
        self.assert_camera(camera, EUROC, "radtan", LENS, (752, 480))
        self.assertTrue(calibration.notes[0].endswith("ignored: ORBextractor"))

    def test_pairs(self):
        _, right = read(newer("PinHole", SECOND)).cameras
        # Camera 2 is 11 cm to the right of camera 1.
        self.assertTrue(np.allclose(right.cam_from_rig[:3, 3], [-0.11, 0.0002, -0.0009], rtol=0, atol=1e-12))
        self.assertEqual(right.intrinsics[0], 457.587)
        left, right = read(newer("Rectified", "Stereo.b: 0.11\n")).cameras
        self.assertEqual(right.cam_from_rig[0, 3], -0.11)
        self.assertEqual(left.distortion_model, "none")

    def test_fisheyes_and_depth(self):
        fisheye, = read(newer("KannalaBrandt8", "Camera1.k3: 0.001\n")).cameras
        self.assert_camera(fisheye, EUROC, "equidistant", [-0.28340811, 0.07395907, 0.001, 0], (752, 480))
        depth = read(newer("PinHole", "Stereo.b: 0.07732\nRGBD.DepthMapFactor: 5000.0\n"))
        self.assertEqual((len(depth.cameras), depth.depth_factor), (1, 5000))

    def test_flat_keys_of_older_files(self):
        self.assertEqual(len(read(OLDER).cameras), 1)
        self.assertEqual(read(OLDER + "Camera.bf: 40\nDepthMapFactor: 5000\n").depth_factor, 5000)
        _, right = read(OLDER + "Camera.bf: 43.52\n").cameras
        self.assertAlmostEqual(right.cam_from_rig[0, 3], -0.1, places=12)

        # The right camera is turned by 0.1 rad about y before rectification.
        rectifier = ""
        for side, turn in (("LEFT", "1, 0, 0, 0, 1, 0, 0, 0, 1"),
                           ("RIGHT", "0.9950041653, 0, 0.0998334166, 0, 1, 0, -0.0998334166, 0, 0.9950041653")):
            rectifier += f"{side}.width: 752\n{side}.height: 480\n"
            for key, data in (("K", "458.6, 0, 367.2, 0, 457.3, 248.4, 0, 0, 1"), ("D", "-0.28, 0.07, 0.0002, 0, 0"), ("R", turn)):
                rectifier += f"{side}.{key}: !!opencv-matrix\n  rows: 3\n  cols: 3\n  dt: d\n  data: [{data}]\n"
        left, right = read(OLDER + "Camera.bf: 43.52\n" + rectifier).cameras
        self.assertEqual(left.distortion_model, "radtan")
        self.assertAlmostEqual(math.acos((np.trace(right.cam_from_rig[:3, :3]) - 1) / 2), 0.1, places=6)
        # Its centre stays 10 cm to the right of the other.
        self.assertTrue(np.allclose(np.linalg.inv(right.cam_from_rig)[:3, 3], [0.1, 0, 0], rtol=0, atol=1e-9))

    def test_names_what_is_wrong(self):
        self.assert_fails(newer("Omni"), "s.yaml:4: Camera.type is Omni, expected PinHole")
        self.assert_fails("Camera.fx: 400\n", "s.yaml: has no Camera.width, which is needed")
        self.assert_fails(newer("Rectified", "Stereo.b: -1\n"), "baseline of -1 m")
        self.assert_fails(newer("PinHole", "Camera2.fx: 1\nStereo.T_c1_c2: [1, 2]\n"), "has 2 numbers, expected 16")
        self.assert_fails(newer("PinHole", SECOND.replace("[1,0,0", "[9,0,0")), "Stereo.T_c1_c2 has no rotation")


class Everywhere(SettingsTest):
    def test_where_calibrations_are_taken(self):
        for name, text in (("sections.yaml", SECTIONS), ("flat.yaml", FLAT), ("orbslam.yaml", newer("PinHole")), ("older.yaml", OLDER)):
            with self.subTest(name):
                path = self.folder / name
                path.write_text(text)
                expected = read(text)
                for calibration in (waymark.Calibration(path), waymark.Calibration([str(path)]), waymark.import_settings(path)):
                    self.assertEqual(calibration.cameras[0].intrinsics, expected.cameras[0].intrinsics)
                    self.assertEqual(calibration.depth_factor, expected.depth_factor)

    def test_damage_is_one_line(self):
        rng = random.Random(7)
        for whole in (SECTIONS, FLAT, newer("PinHole", SECOND), OLDER):
            for _ in range(150):
                text = bytearray(whole[:rng.randrange(1, len(whole))].encode())
                text[rng.randrange(len(text))] = rng.randrange(256)
                try:
                    importing_settings.read("s.yaml", bytes(text))
                except waymark.InputError as error:
                    self.assertNotIn("\n", str(error))


if __name__ == "__main__":
    unittest.main()
