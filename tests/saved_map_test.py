#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The contract of the command line where it uses saved maps."""
import re
import shutil
import unittest

import map_records
from cli_support import CAMERA, NUM_FRAMES, CliTest, png_size, truncate, waymark, write_png


class SavedMap(CliTest):
    """A saved map is extended, and images are found in it."""

    def setUp(self):
        super().setUp()
        self.map = self.folder / "saved.wmap"

    def save_map(self, setup, *arguments):
        source = self.sequence(setup)
        done = self.run_on(source, "--map-out", self.map, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        shutil.rmtree(self.out)
        return source

    def localize(self, source, *arguments):
        return waymark("localize", self.map, source, "-o", self.out, *arguments)

    def test_images_are_found_as_a_stream_and_one_by_one(self):
        self.save_map("mono")
        before = self.map.read_bytes()
        shutil.rmtree(self.folder / "input_mono")
        images = self.image_folder()
        write_png(images / "000010.png", *png_size(images / "000010.png"))  # Nothing to see.
        for order in ([], ["--unordered"]):
            done = self.localize(images, "-c", self.folder / "camchain.yaml", "--verbose", *order)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stderr, "frame 10: lost: no_features")
            summary, frames = self.summary(), self.frames()
            lines = (self.out / "trajectory.txt").read_text().strip().split("\n")
            self.assertGreaterEqual(summary["localized"], NUM_FRAMES - 4)
            self.assertEqual(summary["localized"], len(lines))
            self.assertEqual(summary["localized"], sum(f["state"] == "tracked" for f in frames))
            self.assertEqual(len(frames), NUM_FRAMES)
            self.assertNotIn("1", [f["is_keyframe"] for f in frames])
            self.assertGreater((self.out / "keyframes.txt").stat().st_size, 0)
        self.assertEqual(self.map.read_bytes(), before)

    def test_a_search_that_fails_is_explained(self):
        self.save_map("mono")
        elsewhere = self.folder / "elsewhere"
        done = waymark("simulate", "hall", "--motion", "slide", "--camera",
                       self.config(CAMERA.split("cam1")[0]), "--setup", "mono", "--frames", 3, "-o",
                       elsewhere)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.localize(elsewhere, "--verbose")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertRegex(done.stderr, r"frame 0: lost: \w+, \d+ inliers of \d+ matches, best of \d+")
        self.assertEqual(self.summary()["localized"], 0)
        for frame in self.frames():
            self.assertIn(frame["reason"], ("too_few_matches", "too_few_inliers", "not_verified"))

    def test_a_map_in_metres_contradicts_depth_in_other_units(self):
        source = self.save_map("rgbd", "-c", self.folder / "input_rgbd/camchain.yaml")
        for command in ("localize", self.map, source), ("run", source, "--map-in", self.map):
            for factor, is_wrong in (5000, False), (1000, True):
                done = waymark(*command, "-c", source / "camchain.yaml", "--set", f"depth.factor={factor}", "-o", self.out)
                self.assertEqual(done.returncode, 0, done.stderr)
                warned = "warning: calibration: depth is 5 times what the map says: is depth.factor right?"
                self.assertEqual(warned in done.stderr, is_wrong, done.stderr)
                self.assertEqual(bool(self.summary().get("mistakes")), is_wrong)

    def test_a_map_is_extended(self):
        source = self.save_map("stereo", "--frames", NUM_FRAMES // 2)
        done = self.run_on(source, "--first", NUM_FRAMES // 2, "--map-in", self.map, "--map-out",
                           self.map)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("in metres", done.stderr)
        summary = self.summary()
        self.assertEqual((summary["submaps"], summary["tracked"]), (1, NUM_FRAMES // 2))
        self.assertEqual(waymark("map", "check", self.map).returncode, 0)
        first_half = self.frames()[0]["timestamp_ns"]
        keyframes = (self.out / "keyframes.txt").read_text().strip().split("\n")
        self.assertEqual(len(keyframes), summary["keyframes"])
        before = [k for k in keyframes if float(k.split()[0]) * 1e9 < int(first_half) - 1000]
        self.assertGreater(len(before), 0)

    def export(self, kind):
        out = self.folder / f"export_{kind}"
        return out, waymark("export", self.map, "--format", kind, "-o", out)

    def test_a_map_of_a_camera_model_of_ones_own(self):
        """What needs no projection works without the model; the rest says what is missing."""
        source = self.save_map("mono")
        points = {}
        for model in ("pinhole", "mirror"):
            records = map_records.split(self.map.read_bytes())
            next(r for r in records if r.get("kind") == "camera")["camera_model"] = model
            self.map.write_bytes(map_records.join(records))
            for kind in ("ply", "tum", "kitti"):
                out, done = self.export(kind)
                self.assertEqual(done.returncode, 0, done.stderr)
            header = (self.folder / "export_ply").read_bytes().split(b"end_header")[0].decode()
            points[model] = int(re.search("element vertex (.*)", header)[1])
        self.assertGreater(points["mirror"], 0.98 * points["pinhole"])
        self.assertEqual(waymark("map", "check", self.map).stdout, f"{self.map}: sound\n")
        self.assertIn("mirror (unknown model), distortion radtan", waymark("map", "info", self.map).stdout)
        out, done = self.export("colmap")
        self.assert_fails(done, 2, "mirror")
        self.assertFalse(out.exists())
        missing = f"{self.map}: camera 0: camera_model is mirror, expected one of: "
        self.assert_fails(self.localize(source, "-c", source / "camchain.yaml"), 2, missing)
        self.assert_fails(self.run_on(source, "-c", source / "camchain.yaml", "--map-in", self.map), 2, missing)
        aligned = self.folder / "aligned.wmap"
        done = waymark("map", "align", self.map, "--up", "0,-1,0", "-o", aligned)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("mirror", waymark("map", "info", aligned).stdout)

    def test_maps_that_cannot_be_used(self):
        source = self.sequence("stereo")
        self.assert_fails(self.run_on(source, "--map-in", self.map), 2, self.map, "missing")
        self.assert_fails(self.localize(source), 2, self.map, "missing")
        self.save_map("mono")
        self.assert_fails(self.run_on(source, "--map-in", self.map), 2, self.map, "--setup mono")
        truncate(self.map)
        self.assert_fails(self.localize(source), 2, self.map, "truncated")


if __name__ == "__main__":
    unittest.main()
