#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Markers of known size give a map of one camera metres, a frame, and a way back."""
import json
import math
import pathlib
import re
import unittest

import numpy as np

from cli_support import CliTest, made_once, waymark

NUM_FRAMES = 400
RATE_HZ = 12.5
NUM_MARKERS = 6
SIDE_M = 0.2
MAX_SCALE_ERROR = 0.005
MAX_LEVEL_DEG = 0.5
MAX_SURVEYED_ATE_M = 0.02


def flat():
    """A way through a flat with markers, made once."""
    return made_once("flat_with_markers", "apartment", "--setup", "mono", "--frames", NUM_FRAMES, "--rate", RATE_HZ,
                     "--markers", NUM_MARKERS)


def read_trajectory(path):
    rows = np.loadtxt(path, ndmin=2)
    return {round(row[0], 3): row[1:] for row in rows}


def rotation(q):
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def markers_of(folder):
    """Per marker the rotation and position that markers.yaml has."""
    found = {}
    for line in (folder / "markers.yaml").read_text().splitlines():
        at = re.match(r"  - \{id: (\d+), position: \[(.*?)\], rotation: \[(.*?)\]\}", line)
        if at:
            found[int(at[1])] = (rotation(np.array([float(v) for v in at[3].split(",")])),
                                 np.array([float(v) for v in at[2].split(",")]))
    return found


class Markers(CliTest):
    def run_flat(self, *options):
        source = flat()
        done = self.run_on(source, "-c", source / "camchain.yaml", "--setup", "mono", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def evaluate(self, alignment):
        done = waymark("eval", self.out / "trajectory.txt", flat() / "groundtruth.txt", "--align", alignment, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_the_map_is_in_metres_in_the_level_frame_of_marker_0(self):
        done = self.run_flat("--set", "markers.family=tag36h11", "--set", f"markers.size={SIDE_M}")
        self.assertEqual(self.summary()["markers"]["frame"], "marker 0", done.stderr)
        self.assertIn("in the frame of marker 0", done.stderr)
        self.assertLess(abs(self.evaluate("sim3")["scale"] - 1.0), MAX_SCALE_ERROR)
        estimate = read_trajectory(self.out / "trajectory.txt")
        truth = read_trajectory(flat() / "groundtruth.txt")
        rotation0, position0 = markers_of(flat())[0]
        up = np.zeros(3)
        offs = []
        for time, pose in estimate.items():
            # What is up in the estimate by each image, and where marker 0 then is.
            turn = rotation(pose[3:]) @ rotation(truth[time][3:]).T
            up += turn @ np.array([0.0, 0.0, 1.0])
            offs.append(pose[:3] + turn @ (position0 - truth[time][:3]))
        up /= np.linalg.norm(up)
        level_deg = math.degrees(math.acos(min(1.0, up @ (rotation0.T @ np.array([0.0, 0.0, 1.0])))))
        print(f"scale {self.evaluate('sim3')['scale']}, level {level_deg:.3f} deg, origin {np.median(np.linalg.norm(offs, axis=1)):.4f} m")
        self.assertLess(level_deg, MAX_LEVEL_DEG)
        self.assertLess(np.median(np.linalg.norm(offs, axis=1)), 0.05)

    def test_surveyed_markers_give_their_frame(self):
        lines = (flat() / "markers.yaml").read_text().splitlines()
        four = self.config("\n".join(lines[:7]) + "\n", "markers.yaml")
        self.assertEqual(len(lines), 3 + NUM_MARKERS)
        self.run_flat("--set", f"markers.file={four}")
        summary = self.summary()["markers"]
        self.assertEqual(summary["frame"], "surveyed", summary)
        found = self.evaluate("none")
        print(found["ate_rmse_m"], summary["survey_rms_m"])
        self.assertLessEqual(found["ate_rmse_m"], MAX_SURVEYED_ATE_M)

    def test_one_of_six_with_a_wrong_size_is_left_out(self):
        text = f"family: tag36h11\nsize: {SIDE_M}\nmarkers:\n  - {{id: 3, size: 0.26}}\n"
        done = self.run_flat("--set", f"markers.file={self.config(text, 'markers.yaml')}")
        verdicts = {marker["id"]: marker["verdict"] for marker in self.summary()["markers"]["markers"]}
        self.assertEqual(verdicts.pop(3), "wrong size")
        self.assertEqual(set(verdicts.values()), {"used"}, verdicts)
        self.assertRegex(done.stderr, r"marker 3: its side is 0\.\d+ m by the others, 0\.2600 m was said")
        self.assertLess(abs(self.evaluate("sim3")["scale"] - 1.0), MAX_SCALE_ERROR)

    def test_a_known_marker_locates_the_first_frames_that_see_it(self):
        saved = self.folder / "flat.wmap"
        self.run_flat("--set", f"markers.file={flat() / 'markers.yaml'}", "--map-out", saved)
        frames = [frame for frame in self.frames() if frame["is_keyframe"] == "1"]
        first = int(frames[len(frames) // 2]["index"])
        done = waymark("run", flat(), "-c", flat() / "camchain.yaml", "--setup", "mono", "--map-in", saved, "--first", first,
                       "--frames", 20, "--set", f"markers.file={flat() / 'markers.yaml'}", "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        exported = self.folder / "exported.yaml"
        self.assertEqual(waymark("export", saved, "--format", "markers", "-o", exported).returncode, 0)
        self.assertEqual(exported.read_text().count("- {id:"), NUM_MARKERS)
        states = [frame["state"] for frame in self.frames()]
        self.assertIn("tracked", states[:2], states)
        self.assertLessEqual(self.evaluate("none")["ate_rmse_m"], 2 * MAX_SURVEYED_ATE_M)

    def test_without_a_marker_in_view_all_bits_are_the_same(self):
        source = self.sequence("mono")
        texts = []
        for options in ((), ("--set", "markers.family=aruco_5x5_50", "--set", "markers.size=0.1")):
            done = self.run_on(source, "-c", source / "camchain.yaml", *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            texts.append((self.out / "trajectory.txt").read_bytes() + (self.out / "keyframes.txt").read_bytes())
        self.assertEqual(texts[0], texts[1])
        self.assertEqual(self.summary()["markers"]["markers"], [])


class Sheets(CliTest):
    def test_prints_pages_and_refuses_what_is_wrong(self):
        sheet = self.folder / "sheet.svg"
        done = waymark("markers", "--print", sheet, "--size", "0.16", "--ids", "0-2")
        self.assertEqual(done.returncode, 0, done.stderr)
        pages = [pathlib.Path(line) for line in done.stdout.split()]
        self.assertEqual([page.name for page in pages], ["sheet.svg", "sheet-2.svg", "sheet-3.svg"])
        self.assertIn('width="160.0000" height="160.0000"', pages[2].read_text())
        pdf = self.folder / "sheet.pdf"
        done = waymark("markers", "--print", pdf, "--size", "0.16", "--ids", "0-2")
        self.assertEqual((done.returncode, done.stdout.strip()), (0, str(pdf)), done.stderr)
        self.assertIn(b"/Count 3 ", pdf.read_bytes())
        for options, words in ((("--size", "0.3"), "expected at most 0.168"), (("--ids", "5-x"), "'x' is no number"),
                               (("--ids", "580-600"), "expected 0 to 586"), (("--family", "tag1"), "expected one of")):
            done = waymark("markers", "--print", self.folder / "none.svg", *options)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(words, done.stderr)
        self.assertFalse((self.folder / "none.svg").exists())


if __name__ == "__main__":
    unittest.main()
