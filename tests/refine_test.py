#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A calibration that is off is mended along with the map, and given back."""
import json
import pathlib
import re
import signal
import subprocess
import tempfile
import unittest

from cli_support import CAMERA, PROGRAM, waymark
from viewer_client import ViewerClient

TURN = 2e-3  # rad


class Refine(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="waymark_refine_")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.room = cls.folder / "room"
        camera = cls.folder / "camera.yaml"
        camera.write_text(CAMERA)
        done = waymark("simulate", "room", "--motion", "loop", "--camera", camera, "--setup", "stereo", "--frames", 90,
                       "--told", f"turn_y={TURN * 1e3}", "-o", cls.room)
        assert done.returncode == 0, done.stderr

    def run_with(self, name, *options, sequence=None):
        out = self.folder / name
        sequence = sequence or self.room
        camchain = () if sequence == self.room else ("-c", sequence / "camchain.yaml")
        done = waymark("run", sequence, "-o", out, *camchain, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return out, json.loads((out / "summary.json").read_text()), done.stderr

    def run_in_view(self, name):
        """The same with a viewer: what that says of the calibration at the end, too."""
        out = self.folder / name
        with subprocess.Popen([PROGRAM, "run", self.room, "-o", out, "--viewer", "0"], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True) as program:
            self.addCleanup(program.kill)
            url = next(found[1] for found in (re.search(r"open (http://\S+)", line) for line in program.stdout) if found)
            client = ViewerClient(url)
            self.addCleanup(client.close)
            client.wait_for(lambda c: c.status and c.status["phase"] == "done", seconds=300)
            said = program.stdout.read()
        self.assertEqual(program.returncode, 0, said)
        return out, json.loads((out / "summary.json").read_text()), said, client.status["calibration"]

    def error_m(self, out, sequence=None, name="trajectory.txt"):
        truth = (sequence or self.room) / "groundtruth.txt"
        done = waymark("eval", out / name, truth, "--align", "se3", "--json")
        return json.loads(done.stdout)["ate_rmse_m"]

    def test_a_turn_of_camera_1_is_found_and_kept(self):
        as_told, summary, _ = self.run_with("as_told", "--set", "calibration.refine=off")
        self.assertNotIn("refined_calibration", summary)
        self.assertFalse((as_told / "calibration.yaml").exists())

        refined, summary, said, told = self.run_in_view("refined")
        self.assertIn("calibration changed: ", said)
        found = {each["name"]: each for each in summary["refined_calibration"]}
        self.assertLess(abs(abs(found["cam1.turn_y"]["change"]) - TURN), 0.25 * TURN)
        self.assertLess(self.error_m(refined), 0.3 * self.error_m(as_told))
        self.assertIn("cam1.turn_y", [each["name"] for each in told])
        for each in told:
            self.assertEqual(each, {key: found[each["name"]][key] for key in ("name", "given", "change", "sigma")})

        self.told_how_sure((refined / "calibration.yaml").read_text(), found)
        again, summary, _ = self.run_with("again", "-c", refined / "calibration.yaml")
        self.assertNotIn("refined_calibration", summary, "what was found is right")
        self.assertLess(self.error_m(again), 0.3 * self.error_m(as_told))

    def test_what_is_wrong_altogether_is_mapped_once_more(self):
        longer = self.folder / "longer.yaml"
        longer.write_text(CAMERA.replace("[290, 291,", "[305, 306,"))
        out, summary, said = self.run_with("short", "--frames", 40, "-c", longer)
        self.assertIn("the calibration is another than stated: once more with what the images tell", said)
        focal = {each["name"]: each for each in summary["refined_calibration"]}["cam0.fu"]
        self.assertEqual(focal["given"], 305)
        self.assertLess(abs(focal["given"] + focal["change"] - 290), 0.003 * 290)
        self.assertLess(summary["keyframes"], 30, "is not calibrated before the end")
        self.assertLess(self.error_m(out), 1.5 * self.error_m(out, name="keyframes.txt"))
        out, summary, said = self.run_with("short_small", "--frames", 40, "-c", longer, "--resize", 300)
        self.assertIn("the calibration is another than stated: once more", said)
        mended = (out / "calibration.yaml").read_text()
        self.assertEqual(mended.count("resolution: [376, 240]"), 2)
        self.assertLess(abs(float(mended.split("intrinsics: [")[1].split(",")[0]) - 290), 0.01 * 290)

    def test_the_first_time_stays_where_the_second_is_interrupted(self):
        longer = self.folder / "longer_still.yaml"
        longer.write_text(CAMERA.replace("[290, 291,", "[305, 306,"))
        out, told = self.folder / "interrupted", self.folder / "interrupted.wmap"
        with subprocess.Popen([PROGRAM, "run", self.room, "-o", out, "--map-out", told, "--frames", "40", "-c", longer],
                              stderr=subprocess.PIPE, text=True) as program:
            self.addCleanup(program.kill)
            said = next(line for line in program.stderr if "once more" in line)
            program.send_signal(signal.SIGINT)
            said += program.stderr.read()
        self.assertEqual(program.returncode, 0, said)
        self.assertIn("the results are those of the first time", said)
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual(summary["frames"], 40)
        self.assertIn("refined_calibration", summary)
        self.assertEqual(len((out / "frames.csv").read_text().splitlines()), 41)
        self.assertEqual(waymark("map", "check", told).returncode, 0)

    def test_a_rolling_shutter_is_found_and_kept(self):
        walk = self.folder / "walk"
        done = waymark("simulate", "room", "--motion", "inspect", "--setup", "rgbd", "--frames", 120, "--readout", 30,
                       "-o", walk)
        self.assertEqual(done.returncode, 0, done.stderr)
        as_told, _, _ = self.run_with("global", "--set", "calibration.refine=off", sequence=walk)
        refined, summary, said = self.run_with("rolling", sequence=walk)
        self.assertIn("readout_ms 0 -> ", said)
        found = {each["name"]: each for each in summary["refined_calibration"]}["readout_ms"]
        self.assertLess(abs(found["change"] - 30), 2)
        self.assertLess(self.error_m(refined, walk), 0.8 * self.error_m(as_told, walk))
        self.assertIn("  readout_ms: ", (refined / "calibration.yaml").read_text())

    def told_how_sure(self, camchain, found):
        """The file says the same of its numbers as the summary, which has the errors of bearings beside."""
        found = {name: each for name, each in found.items() if not re.search("along|across", name)}
        lists = re.findall(r"(\w+): \[([^][]*)\]", camchain)
        sigmas = [float(each) for key, numbers in lists if key in (
            "intrinsics_sigma", "distortion_coeffs_sigma", "rotation_mrad", "baseline_direction_mrad")
                  for each in numbers.split(", ")]
        self.assertEqual(len(sigmas), len(found))
        for sigma, (name, each) in zip(sigmas, found.items()):
            unit = 1e-3 if "turn" in name or "baseline" in name else 1.0
            self.assertAlmostEqual(unit * sigma / each["sigma"], 1.0, 3, name)
        self.assertEqual(found["cam0.pu"]["sigma"], found["cam0.pu"]["given_sigma"], "not looked for")

    def test_words_that_mean_nothing(self):
        done = waymark("run", self.room, "-o", self.folder / "none", "--set", "calibration.refine=maybe")
        self.assertEqual(done.returncode, 2)
        self.assertIn("expected auto, on or off", done.stderr)


if __name__ == "__main__":
    unittest.main()
