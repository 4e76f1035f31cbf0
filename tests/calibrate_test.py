#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Images of an unknown camera are mapped, and calibrated without mapping."""
import json
import pathlib
import shutil
import tempfile
import unittest

from cli_support import waymark

FOCAL_PX = 280.0
CAMERA = """cam0:
  camera_model: pinhole
  intrinsics: [280, 280, 196, 152]
  distortion_model: radtan
  distortion_coeffs: [-0.1, 0.01, 0, 0]
  resolution: [400, 300]
"""


class Calibrate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="waymark_calibrate_")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        camera = cls.folder / "camera.yaml"
        camera.write_text(CAMERA)
        done = waymark("simulate", "room", "--motion", "inspect", "--camera", camera, "--setup", "mono",
                       "--frames", 60, "-o", cls.folder / "room")
        assert done.returncode == 0, done.stderr
        cls.images = cls.folder / "images"
        shutil.move(cls.folder / "room/mav0/cam0/data", cls.images)

    def check(self, camchain):
        focal_px = float(camchain.split("intrinsics: [")[1].split(",")[0])
        self.assertLess(abs(focal_px / FOCAL_PX - 1), 0.03)
        return focal_px

    def test_run_without_a_calibration(self):
        out = self.folder / "out"
        done = waymark("run", self.images, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("calibration estimated: perspective, focal length", done.stderr)
        self.assertNotIn("calibration from the settings", done.stderr)
        focal_px = self.check((out / "calibration.yaml").read_text())
        summary = json.loads((out / "summary.json").read_text())
        self.assertAlmostEqual(summary["calibration"].pop("focal_px"), focal_px, 3)
        self.assertEqual(summary["calibration"]["source"], "estimated")
        self.assertEqual(summary["calibration"]["model"], "perspective")
        self.assertTrue(summary["calibration"]["is_sure"])
        self.assertEqual(summary["coverage"], 1.0)
        self.calibrate_alone_gives((out / "calibration.yaml").read_text())

    def calibrate_alone_gives(self, expected):
        out = self.folder / "camchain.yaml"
        done = waymark("calibrate", self.images, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("model: perspective\nwhy: the motion tells\nfocal length: ", done.stdout)
        self.assertEqual(out.read_text(), expected)
        done = waymark("config", out)
        self.assertEqual(done.stdout, "valid: 1 camera\n", done.stderr)

    def test_a_map_tells_the_calibration_of_a_query(self):
        camera, told = self.folder / "camera.yaml", self.folder / "told.yaml"
        told.write_text(CAMERA.replace("[280, 280,", "[288.4, 288.4,"))
        map_file, out = self.folder / "room.wmap", self.folder / "found"
        done = waymark("run", self.images, "-c", camera, "--map-out", map_file, "-o", self.folder / "mapped")
        self.assertEqual(done.returncode, 0, done.stderr)
        for options in (["-c", told, "--unordered"], ["-c", told], []):
            done = waymark("localize", map_file, self.images, *options, "-o", out)
            self.assertEqual(done.returncode, 0, done.stderr)
            focal_px = self.check((out / "calibration.yaml").read_text())
            summary = json.loads((out / "summary.json").read_text())
            self.assertEqual(summary["localized"], 60)
            self.assertEqual("calibration" in summary, not options)
            if options:
                self.assertLess(abs(focal_px / FOCAL_PX - 1), 0.005, options)
                self.assertIn("calibration changed: cam0.fu 288.4 -> ", done.stderr)
                self.assertEqual(summary["refined_calibration"][0]["given"], 288.4)
            (out / "calibration.yaml").unlink()
        for options in (["-c", told, "--set", "calibration.refine=off"], ["-c", camera]):
            done = waymark("localize", map_file, self.images, *options, "-o", out)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertFalse((out / "calibration.yaml").exists())

    def test_images_that_are_resized_or_turned(self):
        """The calibration that is found is stated of the images as they are, and so is what the next run is given."""
        map_file, told = self.folder / "small.wmap", self.folder / "wrong.yaml"
        told.write_text(CAMERA.replace("[280, 280,", "[288.4, 288.4,"))
        for options in (["--resize", 320], ["--resize", 240, "--rotate", 90]):
            out = self.folder / "changed"
            done = waymark("run", self.images, *options, "--map-out", map_file, "-o", out)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("calibration estimated: ", done.stderr)
            found = out / "calibration.yaml"
            self.assertIn("resolution: [400, 300]", found.read_text())
            self.check(found.read_text())
            kept = self.folder / "kept.yaml"
            shutil.copy(found, kept)
            done = waymark("run", self.images, *options, "-c", kept, "-o", out)
            self.assertEqual(done.returncode, 0, done.stderr)
            for calibration in ([], ["-c", told], ["--unordered"]):
                done = waymark("localize", map_file, self.images, *options, *calibration, "-o", out)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual("once more with what the images tell" in done.stderr, "-c" in calibration, done.stderr)
                if "-c" in calibration:
                    self.assertIn("resolution: [400, 300]", found.read_text())
                    self.check(found.read_text())
                self.assertEqual(json.loads((out / "summary.json").read_text())["localized"], 60)
            done = waymark("calibrate", self.images, *options, "-o", kept)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("images: as turned or resized, ", done.stdout)
            self.check(kept.read_text())

    def test_what_cannot_tell(self):
        done = waymark("calibrate", self.images, "--frames", 1)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("warning: calibration: the motion does not tell", done.stderr)
        self.assertIn("why: the motion does not tell, the likeliest is taken\n", done.stdout)
        done = waymark("calibrate", self.images, "--frames", 1, "--fov", 90, "--quiet")
        self.assertIn("field of view: 90.0 degrees wide\n", done.stdout)

    def test_errors(self):
        for arguments, message in (
                (["calibrate", self.folder / "none"], "none: does not exist, expected"),
                (["calibrate", self.images, "--fov", 1000], "--fov"),
                (["calibrate", self.images, "-o", self.folder / "none/a.yaml"], "none/a.yaml"),
                (["localize", "none.wmap", self.images], "none.wmap: ")):
            done = waymark(*arguments)
            self.assertIn(done.returncode, (1, 2))
            self.assertRegex(done.stderr, "^error: .*" + message)
            self.assertEqual(done.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main()
