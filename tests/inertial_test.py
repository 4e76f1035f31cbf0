#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""One camera and an IMU give metres and a level map, however the IMU is described; one that is wrong is left out with
a line, and changes nothing. Needs WAYMARK_DATA."""
import json
import math
import os
import pathlib
import unittest

from cli_support import CliTest, waymark

DATA = pathlib.Path(os.environ.get("WAYMARK_DATA", ""))
EUROC, PHONE = DATA / "euroc_mh01_stereo", DATA / "phone_lowlight_mono"
GOPRO = DATA / "gopro_max_imu"
WRONG = """cam0:
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.1]
  - [1.0, 0.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: 0.02
"""


@unittest.skipUnless(os.environ.get("WAYMARK_DATA") and EUROC.is_dir(), "needs euroc_mh01_stereo in WAYMARK_DATA")
class Recorded(CliTest):
    def figures(self, *options):
        done = self.run_on(EUROC, "--setup", "mono", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        judged = {}
        for align in ("se3", "sim3"):
            text = waymark("eval", self.out / "trajectory.txt", EUROC / "groundtruth.txt", "--align", align, "--json")
            judged[align] = json.loads(text.stdout)
        return judged["se3"]["ate_rmse_m"], judged["sim3"]["scale"], self.summary()

    def check(self, *options, scale_within=0.003, metric_before=110):
        ate_m, scale, summary = self.figures(*options)
        imu = summary["imu"]
        self.assertTrue(imu["used"])
        self.assertLess(ate_m, 0.008)
        self.assertLess(abs(scale - 1.0), min(scale_within, 3.0 * imu["scale_sigma"]))
        self.assertLess(imu["metric_from_frame"], metric_before)  # When it is known to 1 %.
        self.assertTrue(summary["quality"]["is_metric"])
        self.assertLess(abs(imu["time_shift_ms"]["value"]), 1.0)
        return imu

    def test_metres_from_one_camera(self):
        imu = self.check()
        self.assertLess(abs(imu["rotation_deg"]["value"][2] - 89.15), 0.3)

    def test_what_is_found_is_kept(self):
        kept = self.folder / "kept.wmap"
        done = self.run_on(EUROC, "--setup", "mono", "--frames", 200, "--map-out", kept, "--rate", "imu")
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = (self.out / "inertial.csv").read_text().splitlines()
        self.assertEqual(len(rows), 1 + self.summary()["tracked"])
        self.assertGreater(len((self.out / "trajectory.txt").read_text().splitlines()), 9 * len(rows))
        self.assertIn("T_cam_imu", (self.out / "calibration.yaml").read_text())
        first = self.summary()["imu"]
        ate_m, _, summary = self.figures("--map-in", kept, "--first", 150)
        self.assertLess(ate_m, 0.008)
        self.assertEqual(summary["submaps"], 1)
        for of_axis, before in zip(summary["imu"]["rotation_deg"]["value"], first["rotation_deg"]["value"]):
            self.assertAlmostEqual(of_axis, before, delta=0.3)

    def test_a_wrong_description(self):
        calibration = self.folder / "wrong.yaml"
        intrinsics = (EUROC / "camchain.yaml").read_text().split("cam0:\n")[1].split("cam1:")[0]
        kept = [line for line in intrinsics.splitlines() if "T_cam_imu" not in line and "- [" not in line]
        calibration.write_text(WRONG + "\n".join(kept) + "\n")
        self.check("-c", calibration, scale_within=0.005, metric_before=160)  # The map begins later.

    def test_without(self):
        _, scale, summary = self.figures("--imu", "none")
        self.assertNotIn("imu", summary)
        self.assertGreater(scale, 2.0)

    @unittest.skipUnless(GOPRO.is_dir(), "needs gopro_max_imu in WAYMARK_DATA")
    def test_a_video_that_the_camera_stabilised(self):
        done = self.run_on(GOPRO)
        self.assertEqual(done.returncode, 0, done.stderr)
        summary = self.summary()
        self.assertEqual(summary["coverage"], 1.0)
        self.assertTrue(summary["imu"]["used"])
        length_by_gps = 13.6
        self.assertLess(abs(summary["quality"]["length"] / length_by_gps - 1.0), 0.15)

    @unittest.skipUnless(PHONE.is_dir(), "needs phone_lowlight_mono in WAYMARK_DATA")
    def test_samples_of_two_devices(self):
        camera = ("-c", PHONE / "camchain.yaml", "--setup", "mono", "--frames", 100)
        done = self.run_on(PHONE, *camera)
        path = (self.out / "trajectory.txt").read_bytes()
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.run_on(PHONE, *camera, "--imu", PHONE / "imu0.csv")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("the inertial data is not used", done.stderr)
        self.assertFalse(self.summary()["imu"]["used"])
        self.assertEqual((self.out / "trajectory.txt").read_bytes(), path)


class Simulated(CliTest):
    def test_a_place_that_is_new_after_black_images_is_part_of_the_same_map(self):
        world = self.folder / "hall"
        made = waymark("simulate", "hall", "--setup", "mono", "--motion", "flight", "--frames", 200,
                       "--imu", "mems", "--black", "100,40", "-o", world)
        self.assertEqual(made.returncode, 0, made.stderr)
        # No place is recognised: only the IMU tells how the parts lie to each other.
        done = self.run_on(world, "--setup", "mono", "--set", "loop.enabled=false")
        self.assertEqual(done.returncode, 0, done.stderr)
        summary = self.summary()
        self.assertEqual((summary["submaps"], summary["coverage"]), (1, 1.0))
        text = waymark("eval", self.out / "trajectory.txt", world / "groundtruth.txt", "--align", "se3", "--json")
        self.assertLess(json.loads(text.stdout)["ate_rmse_m"], 0.15)

    def test_people_before_a_pair_at_rest_do_not_move_it(self):
        scene = self.folder / "scene"
        done = waymark("simulate", "hall", "--motion", "still", "--frames", 60, "--walkers", 3, "--imu", "phone", "--seed", 4,
                       "-o", scene)
        self.assertEqual(done.returncode, 0, done.stderr)
        # An IMU that is told to have no noise at all shows none at rest, either.
        quiet = self.folder / "quiet.yaml"
        quiet.write_text("".join(f"{name}: 0.0\n" for name in (
            "gyroscope_noise_density", "gyroscope_random_walk", "accelerometer_noise_density", "accelerometer_random_walk")))
        farthest = {}
        for imu in ("auto", "none"):
            done = waymark("run", scene, "-c", scene / "camchain.yaml", "-c", quiet, "-o", self.out, *(["--imu", imu] * (imu == "none")))
            self.assertEqual(done.returncode, 0, done.stderr)
            places = [[float(word) for word in line.split()[1:4]] for line in
                      (self.out / "trajectory.txt").read_text().splitlines() if not line.startswith("#")]
            self.assertEqual(len(places), 60)
            farthest[imu] = max(math.dist(place, places[0]) for place in places)
        self.assertLess(farthest["auto"], 0.03)
        self.assertGreater(farthest["none"], 0.3)

    def test_a_crowd_at_the_start_is_not_followed(self):
        scene = self.folder / "scene"
        done = waymark("simulate", "hall", "--frames", 80, "--walkers", 3, "--imu", "mems", "--seed", 2,
                       "--setup", "mono", "--camera", "perspective", "-o", scene)
        self.assertEqual(done.returncode, 0, done.stderr)
        ate_m = {}
        for imu in ("auto", "none"):
            done = waymark("run", scene, "-c", scene / "camchain.yaml", "-o", self.out, *(["--imu", imu] * (imu == "none")))
            self.assertEqual(done.returncode, 0, done.stderr)
            text = waymark("eval", self.out / "trajectory.txt", scene / "groundtruth.txt", "--align", "sim3", "--json")
            ate_m[imu] = json.loads(text.stdout)["ate_rmse_m"]
        self.assertLess(ate_m["auto"], 0.012)
        self.assertGreater(ate_m["none"], 0.02)


if __name__ == "__main__":
    unittest.main()
