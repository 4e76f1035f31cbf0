#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The journeys of docs/journeys.md, their commands as they stand there, with small simulated inputs in the place of the user's.

WAYMARK_BUILD is the folder of the build, CXX the compiler.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

from cli_support import CAMERA, CliTest, made_once, shared_sequence
from viewer_client import ViewerClient

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = pathlib.Path(os.environ["WAYMARK_BUILD"])
sys.path.insert(0, str(ROOT / "script"))
from documentation.pages import Page  # noqa: E402

PAGE = ROOT / "docs" / "journeys.md"


def sections():
    """The blocks below each heading of the second level; those above the first are under ""."""
    lines = PAGE.read_text().split("\n")
    found = {}
    for block in Page(PAGE).blocks:
        above = [line[3:] for line in lines[:block.line] if line.startswith("## ")]
        found.setdefault(above[-1] if above else "", []).append(block)
    return found


class Journeys(CliTest):
    def setUp(self):
        super().setUp()
        (self.folder / "build").mkdir()
        (self.folder / "build" / "release").symlink_to(BUILD)
        (self.folder / "examples").symlink_to(ROOT / "examples")
        (self.folder / "phone.yaml").write_text(CAMERA.split("cam1")[0])

    def walk(self, heading):
        """Runs what a journey shows; what it printed."""
        blocks = sections()
        commands = "".join(block.text for block in blocks[""] + blocks[heading] if block.kind != "not run")
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", commands], cwd=self.folder, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=280)
        self.assertEqual(done.returncode, 0, done.stdout[-3000:])
        return done.stdout

    def left_out(self, heading, word):
        """The command with this word that the page says is not run."""
        found, = (line for block in sections()[heading] if block.kind == "not run" for line in block.lines if word in line)
        return found

    @staticmethod
    def room(motion):
        return made_once(f"journey_{motion}", "room", "--motion", motion, "--camera", "camera.yaml", "--setup", "stereo",
                         "--frames", 40, files=(("camera.yaml", CAMERA),))

    def film(self, source):
        """The video that the left camera took."""
        pattern = source / "mav0/cam0/data/*.png"
        subprocess.run(["ffmpeg", "-v", "error", "-framerate", "20", "-pattern_type", "glob", "-i", pattern,
                        "-c:v", "mpeg4", "-q:v", "1", self.folder / "walk.mp4"], check=True)

    def test_every_journey_is_walked(self):
        walked = set(re.findall(r'self\.walk\("([^"]+)"\)', pathlib.Path(__file__).read_text()))
        self.assertEqual(walked, set(sections()) - {""})

    def test_a_program_with_a_live_view(self):
        self.walk("A C++ program with a live view")
        self.film(self.room("inspect"))
        command = self.left_out("A C++ program with a live view", "8080").replace("8080", "0").split()
        with subprocess.Popen(command, cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as program:
            client = ViewerClient(re.fullmatch(r"open (http://\S+) in a browser\n", program.stdout.readline())[1])
            client.wait_for(lambda c: c.status and c.status["phase"] == "done" and c.holds_what_status_says())
            self.assertGreater(client.status["tracked"], 30)
            client.close()
            program.stdin.close()
            self.assertEqual(program.wait(60), 0)

    def test_from_a_video_to_splats(self):
        self.film(self.room("inspect"))
        printed = self.walk("From the video of a phone to splats")
        self.assertIn("calibration estimated", printed)
        self.assertRegex(printed, r"\b(3[5-9]|40) of 40 frames have a pose")
        transforms = json.loads((self.folder / "splats/transforms.json").read_text())
        self.assertGreaterEqual(len(transforms["frames"]), 10)
        for frame in transforms["frames"]:
            self.assertTrue((self.folder / "splats" / frame["file_path"]).is_file())
        self.assertTrue((self.folder / "splats/points.ply").is_file())

    def test_map_once_find_images_later(self):
        office = shared_sequence("stereo")
        (self.folder / "office").symlink_to(office)
        images = self.images(office)
        (self.folder / "snapshots").mkdir()
        for name in ("snapshots/a.jpg", "snapshots/b.jpg"):
            subprocess.run(["ffmpeg", "-v", "error", "-i", images[13], "-q:v", "2", self.folder / name], check=True)
        self.walk("Map once, find images later")
        mapped = (self.folder / "mapped/trajectory.txt").read_text().splitlines()[13].split()[1:4]
        found = [row.split(",") for row in (self.folder / "found/poses.csv").read_text().splitlines()[1:]]
        self.assertEqual([name for name, *_ in found], ["a.jpg", "b.jpg"])
        for _, _, *pose in found:
            for here, there in zip(pose, mapped):
                self.assertAlmostEqual(float(here), float(there), delta=0.02)

    def test_a_fleet_and_its_atlas(self):
        if subprocess.run(["/usr/bin/python3", "-c", "import distributed, fsspec"], capture_output=True).returncode:
            self.skipTest("python3-distributed and python3-fsspec are not installed")
        (self.folder / "recordings").mkdir()
        for motion in ("inspect", "slide"):
            shutil.copytree(self.room(motion), self.folder / "recordings" / motion)
        self.film(self.room("inspect"))
        printed = self.walk("A fleet and its atlas")
        for motion in ("inspect", "slide"):
            self.assertIn(motion, (self.folder / "fleet.html").read_text())
        self.assertIn("1 connected part", printed)
        self.assertGreater(len((self.folder / "found-there/trajectory.txt").read_text().split("\n")), 30)
        self.assertEqual((self.folder / "campus.ply").read_bytes()[:4], b"ply\n")


if __name__ == "__main__":
    unittest.main()
