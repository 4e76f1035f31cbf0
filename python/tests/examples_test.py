#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The programs of examples/python."""
import pathlib
import subprocess
import sys
import unittest

from support import DATA, Test, camchain, frames

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples/python"


class Examples(Test):
    def run_example(self, name, *arguments):
        return subprocess.run([sys.executable, "-B", FOLDER / name, *map(str, arguments)],
                              capture_output=True, text=True, timeout=120)

    def test_map_images(self):
        map_file = self.folder / "room.wmap"
        done = self.run_example("map_images.py", DATA / "stereo", camchain(), map_file)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(done.stdout.splitlines()), len(frames()))
        self.assertTrue(map_file.exists())
        done = self.run_example("map_images.py", "none", camchain(), map_file)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))

    def test_localize_images(self):
        images = sorted((DATA / "stereo/mav0/cam0/data").iterdir())[:3]
        done = self.run_example("localize_images.py", DATA / "stereo_out/map.wmap", camchain(), *images)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.count("landmarks agree"), len(images))


if __name__ == "__main__":
    unittest.main()
