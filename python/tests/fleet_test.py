#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""waymark.fleet: three short recordings of a room, by local clusters."""
import importlib.util
import os
import pathlib
import shutil
import signal
import subprocess
import unittest

import waymark
from fleet_support import PROGRAM, WHY_NOT, fleet
from support import DATA, Test

NUM_FRAMES = 40


def simulate(folder, seed, motion, setup="stereo"):
    path = folder / f"{motion}_{seed}"
    subprocess.run([str(PROGRAM), "simulate", "room", "--motion", motion, "--camera", str(DATA / "camera.yaml"),
                    "--frames", str(NUM_FRAMES), "--quiet", "--setup", setup, "-o", str(path)], check=True)
    return path


def described(result):
    return {name: result["contents"][name] for name in ("tiles", "links")}


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Fleet(Test):
    @classmethod
    def setUpClass(cls):
        cls.inputs = DATA / "fleet"
        if not cls.inputs.exists():
            making = DATA / "fleet.new"
            making.mkdir(exist_ok=True)
            for motion in ("slide", "loop", "inspect"):
                simulate(making, 0, motion)
            making.rename(cls.inputs)
        cls.recordings = sorted(str(path) for path in cls.inputs.iterdir())

    def run_fleet(self, name, recordings=None, workers=2, **options):
        return fleet.run(recordings or self.recordings, self.folder / name, workers=workers, keyframes=16, **options)

    def test_same_result_for_any_workers_and_order(self):
        first = self.run_fleet("first", report=self.folder / "report.html")
        self.assertEqual(first["failed"], [])
        self.assertEqual({tile["frame"] for tile in first["contents"]["tiles"]}, {0})
        self.assertTrue(any(not link["is_border"] for link in first["contents"]["links"]))
        self.assertEqual(waymark.Atlas(self.folder / "first").check(), [])
        self.assertIn("3 recordings, 0 failed", (self.folder / "report.html").read_text())

        other = self.run_fleet("other", self.recordings[::-1], workers=1)
        self.assertEqual(described(other), described(first))

        again = self.run_fleet("first")
        self.assertEqual(again["num_done"], 0)
        self.assertEqual(described(again), described(first))

    def test_an_index_in_parts_finds_what_the_whole_one_does(self):
        def links(result):
            return {(link["a"], link["b"]) for link in result["contents"]["links"]}

        whole = self.run_fleet("whole")
        parts = self.run_fleet("parts", index_keyframes=24)
        self.assertEqual({tile["frame"] for tile in parts["contents"]["tiles"]}, {0})
        self.assertGreaterEqual(links(parts), links(whole))
        again = self.run_fleet("parts", index_keyframes=24, workers=1)
        self.assertEqual(again["num_done"], 0)

    def test_a_damaged_recording_is_a_line(self):
        damaged = self.folder / "damaged"
        damaged.mkdir()
        (damaged / "image.png").write_text("no image")
        result = self.run_fleet("atlas", [*self.recordings[:1], str(damaged)], report=self.folder / "report.html")
        self.assertEqual([one["recording"] for one in result["failed"]], [str(damaged)])
        self.assertNotIn("\n", result["failed"][0]["error"])
        self.assertEqual(len(result["contents"]["recordings"]), 1)
        self.assertIn("failed", (self.folder / "report.html").read_text())

    def test_the_program_finds_its_module(self):
        """That of its build folder, whatever else is installed; elsewhere it says that there is none."""
        clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        arguments = ["fleet", str(self.recordings[0]), "-o", str(self.folder / "atlas"), "--workers", "1"]
        done = subprocess.run([str(PROGRAM), *arguments], env=clean, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.folder / "atlas" / "atlas.db").exists())
        if importlib.util.find_spec("waymark").origin.startswith("/usr/lib"):
            return
        alone = self.folder / "alone"
        alone.mkdir()
        shutil.copy(PROGRAM, alone / "waymark")
        done = subprocess.run([str(alone / "waymark"), *arguments], env=clean, capture_output=True, text=True)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertRegex(done.stderr, "^error: .*no module waymark, expected .*\n$")

    def test_a_worker_that_is_killed_changes_nothing(self):
        whole = self.run_fleet("whole")

        def kill_one(line):
            """Once the first recording is there, a process that works on another one ends."""
            if not line.startswith("[1/") or killed:
                return
            children = pathlib.Path(f"/proc/{os.getpid()}/task")
            for task in children.iterdir():
                for child in (task / "children").read_text().split():
                    words = pathlib.Path(f"/proc/{child}/cmdline").read_bytes()
                    if b"spawn_main" in words:
                        killed.append(int(child))
                        os.kill(killed[0], signal.SIGKILL)
                        return

        killed = []
        result = self.run_fleet("killed", say=kill_one)
        self.assertEqual(len(killed), 1)
        self.assertEqual(result["failed"], [])
        self.assertEqual(described(result), described(whole))


if __name__ == "__main__":
    unittest.main()
