#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Every program of examples/ on a simulated sequence.

WAYMARK_EXAMPLES is the folder they were built in, here or against an installed Waymark (install_test.py).
"""
import os
import pathlib
import re
import subprocess
import unittest

from cli_support import NUM_FRAMES, CliTest, write_png
from viewer_client import ViewerClient

FOLDER = pathlib.Path(os.environ["WAYMARK_EXAMPLES"])


def run(example, *arguments, **options):
    return subprocess.run([FOLDER / f"waymark_example_{example}", *map(str, arguments)],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=240, **options)


class Examples(CliTest):
    def test_maps_a_folder_of_images(self):
        done = run("map_images", self.image_folder(), self.folder / "camchain.yaml")
        self.assertEqual(done.returncode, 0, done.stderr)
        poses = [line.split() for line in done.stdout.strip().split("\n")]
        self.assertGreater(len(poses), NUM_FRAMES // 2)
        self.assertEqual({len(pose) for pose in poses}, {4})

    def mapped(self, setup):
        """A sequence, the map of it, and what was found of its frames."""
        source, saved = self.sequence(setup), self.folder / "map.wmap"
        self.assertEqual(self.run_on(source, "--map-out", saved).returncode, 0)
        return source, saved

    def test_maps_images_from_memory(self):
        folder, raw = self.image_folder(), self.folder / "frames.raw"
        subprocess.run(["ffmpeg", "-v", "error", "-i", folder / "%06d.png", "-f", "rawvideo", "-pix_fmt", "gray",
                        raw], check=True)
        with open(raw, "rb") as frames:
            done = run("images_from_memory", self.folder / "camchain.yaml", 20, stdin=frames)
        self.assertEqual(done.returncode, 0, done.stderr)
        *lines, last = done.stdout.strip().split("\n")
        self.assertEqual(len(lines), NUM_FRAMES)
        self.assertEqual(lines[1].split()[:2], ["0.100", "initializing"])
        self.assertIn(lines[1].split()[2], ("too_little_parallax", "too_few_matches"))
        self.assertRegex(lines[-1], r"^2\.000 tracked( -?\d+\.\d{4}){3} \+- 0\.0\d{3}, \d+ landmarks$")
        self.assertEqual(last, f"{NUM_FRAMES} frames have a pose")

    def test_describes_a_pair_in_code(self):
        done = run("stereo_in_code", NUM_FRAMES)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = re.fullmatch(r"40 of 40 frames, (\d+\.\d) mm off over (\d\.\d\d) m\n", done.stdout)
        self.assertIsNotNone(found, done.stdout)
        self.assertLess(float(found[1]), 20.0)

    def test_localizes_images(self):
        source, saved = self.mapped("stereo")
        images = self.images(source)[::10]
        blank = self.folder / "blank.png"
        write_png(blank, 376, 240)
        done = run("localize_images", saved, source / "camchain.yaml", *images, blank)
        self.assertEqual(done.returncode, 0, done.stderr)
        *lines, last = done.stdout.strip().split("\n")
        self.assertEqual(last, "4 of 5 found")
        self.assertIn("no_features", lines[4])
        truth = {line.split()[0]: line.split()[1:4]
                 for line in (self.out / "trajectory.txt").read_text().strip().split("\n")}
        for line, image in zip(lines, images):
            seconds = f"{image.stem[:-9] or 0}.{image.stem[-9:]}"
            found = line.split(" at ")[1].split()[:3]
            for a, b in zip(found, truth[seconds]):
                self.assertAlmostEqual(float(a), float(b), delta=0.01)

    def test_follows_a_map(self):
        done = run("follow_map", self.sequence("stereo"))
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = done.stdout.strip().split("\n")
        self.assertEqual(sum(line.startswith("frame ") for line in lines), NUM_FRAMES)
        changes = [re.match(r"map: (\d+) keyframes \((\d+) new, \d+ moved, (\d+) gone\)", line)
                   for line in lines if line.startswith("map: ")]
        self.assertTrue(all(changes), lines)
        count = 0
        for change in changes:
            count += int(change[2]) - int(change[3])
            self.assertEqual(int(change[1]), count)
        self.assertGreater(count, 1)

    def test_shows_a_session(self):
        with subprocess.Popen([FOLDER / "waymark_example_live_view", self.sequence("stereo"), "0"], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, text=True) as program:
            url = re.fullmatch(r"open (http://\S+) in a browser\n", program.stdout.readline())[1]
            client = ViewerClient(url)
            client.wait_for(lambda c: c.status and c.status["phase"] == "done" and c.holds_what_status_says())
            self.assertRegex(program.stdout.readline(), rf"^{client.status['keyframes']} keyframes\n$")
            self.assertEqual((client.hello["setup"], client.status["tracked"]), ("stereo", NUM_FRAMES))
            client.close()
            program.stdin.close()
            self.assertEqual(program.wait(60), 0)
        self.assertEqual(run("live_view").returncode, 2)

    def test_reads_a_map(self):
        saved, points = self.mapped("stereo")[1], self.folder / "points.ply"
        done = run("read_map", saved, points)
        self.assertEqual(done.returncode, 0, done.stderr)
        *lines, last = done.stdout.strip().split("\n")
        self.assertEqual(len(lines), self.summary()["keyframes"])
        self.assertRegex(last, rf"^{self.summary()['landmarks']} landmarks, \d+\.\d\d m away on average$")
        self.assertEqual(points.read_bytes()[:4], b"ply\n")

    def test_errors_are_one_line(self):
        for example, arguments in (("localize_images", ("none.wmap", "none.yaml", "a.png")),
                                   ("read_map", ("none.wmap", "a.ply")), ("follow_map", ("nowhere",)),
                                   ("images_from_memory", ("none.yaml", 20)), ("live_view", ("nowhere", 0)), ("map_images", ("no", "no.yaml"))):
            done = run(example, *arguments, cwd=self.folder)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertRegex(done.stderr, r"^error: [^\n]+\n$")

    def test_no_program_is_left_out(self):
        programs = {p.name.removeprefix("waymark_example_") for p in FOLDER.glob("waymark_example_*") if p.is_file()}
        tested = pathlib.Path(__file__).read_text()
        self.assertEqual({p for p in programs if f'run("{p}"' not in tested}, set())


if __name__ == "__main__":
    unittest.main()
