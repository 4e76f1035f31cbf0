#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Single and unordered images are found in maps and atlases, under their own names; what takes a map takes an atlas."""
import csv
import json
import math
import shutil
import signal
import subprocess
import unittest

from cli_support import PROGRAM, CliTest, waymark, write_png


class Images(CliTest):
    def setUp(self):
        super().setUp()
        self.source = self.image_folder()
        self.map = self.folder / "m.wmap"
        done = self.run_on(self.source, "-c", self.folder / "camchain.yaml", "--keep-images", "--map-out", self.map)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.path = [list(map(float, row.split())) for row in (self.out / "trajectory.txt").read_text().splitlines()]
        self.snapshots = self.folder / "snapshots"
        self.snapshots.mkdir()
        for name, frame in (("zebra, red.png", 10), ("apple.png", 30)):
            shutil.copy(self.source / f"{frame:06d}.png", self.snapshots / name)

    def true_position(self, frame):
        return min(self.path, key=lambda row: abs(row[0] - 0.05 * frame))[1:4]

    def localize(self, where, *images, status=0):
        out = self.folder / "found"
        done = waymark("localize", where, *images, "-o", out)
        self.assertEqual(done.returncode, status, done.stderr)
        with open(out / "poses.csv", newline="") as file:
            poses = {row["name"]: [float(row[key]) for key in ("tx", "ty", "tz")] for row in csv.DictReader(file)}
        with open(out / "frames.csv", newline="") as file:
            return done.stdout, poses, list(csv.DictReader(file))

    def test_one_image(self):
        apple = self.snapshots / "apple.png"
        said, poses, frames = self.localize(self.map, apple)
        self.assertRegex(said, rf"^{apple}: at \S+ \S+ \S+, turned \S+ \S+ \S+ \S+\n$")
        self.assertLess(math.dist(poses[str(apple)], self.true_position(30)), 0.02)
        self.assertEqual([(frame["name"], frame["timestamp_ns"]) for frame in frames], [(str(apple), "")])
        self.assertFalse((self.folder / "found" / "trajectory.txt").exists())

    def test_several_images(self):
        black = self.snapshots / "black.png"
        write_png(black, 376, 240, grey=0)
        images = [self.snapshots / "zebra, red.png", black, self.snapshots / "apple.png"]
        said, poses, frames = self.localize(self.map, *images)
        self.assertEqual([frame["name"] for frame in frames], list(map(str, images)))
        self.assertIn(f"{black}: not found, no_features\n", said)
        self.assertEqual(list(poses), [str(images[0]), str(images[2])])
        self.assertLess(math.dist(poses[str(images[0])], self.true_position(10)), 0.02)
        self.assertEqual(waymark("report", self.folder / "found").returncode, 0)

    def test_a_folder_of_unordered_images(self):
        self.localize(self.map, self.snapshots, "--unordered")
        (self.snapshots / "times.txt").write_text("5\n7\n")
        _, poses, frames = self.localize(self.map, self.snapshots, "--unordered")
        self.assertEqual(sorted(poses), ["apple.png", "zebra, red.png"])
        self.assertEqual([frame["timestamp_ns"] for frame in frames], ["5000000000", "7000000000"])
        self.assertTrue((self.folder / "found" / "trajectory.txt").exists())  # The times are theirs.

    def test_images_and_others_do_not_mix(self):
        done = waymark("localize", self.map, self.snapshots, self.snapshots / "apple.png", self.snapshots)
        self.assertEqual(done.returncode, 2)
        self.assertIn("expected one, a pair, or image files", done.stderr)

    def test_what_takes_a_map_takes_an_atlas(self):
        atlas = self.folder / "atlas"
        self.assertEqual(waymark("map", "tile", self.map, "-o", atlas, "--keyframes", 8).returncode, 0)
        apple = self.snapshots / "apple.png"
        _, poses, _ = self.localize(atlas, apple)
        self.assertLess(math.dist(poses[str(apple)], self.true_position(30)), 0.05)
        self.assertEqual(waymark("map", "info", atlas).stdout, waymark("atlas", "info", atlas).stdout)
        self.assertIn("sound", waymark("map", "check", atlas).stdout)
        for kind in ("ply", "nerfstudio"):
            done = waymark("export", atlas, "--format", kind, "-o", self.folder / kind)
            self.assertEqual(done.returncode, 0, done.stderr)
        views = json.loads((self.folder / "nerfstudio" / "transforms.json").read_text())["frames"]
        self.assertEqual(len(views), len((self.out / "keyframes.txt").read_text().splitlines()))
        page = self.folder / "page.html"
        self.assertEqual(waymark("report", atlas, "-o", page).stdout, f"{page}\n")
        self.assertIn("<svg", page.read_text())
        self.assertIn("</svg>m</td>", page.read_text())
        with subprocess.Popen([PROGRAM, "view", atlas, "--port", "0"], stdout=subprocess.PIPE, text=True) as view:
            self.assertIn(f"{len(views)} keyframes", view.stdout.readline())
            view.send_signal(signal.SIGINT)
            self.assertEqual(view.wait(60), 0)


if __name__ == "__main__":
    unittest.main()
