#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Every program of examples/ on a simulated sequence.

WAYMARK_EXAMPLES is the folder they were built in, here or against an installed Waymark (install_test.py).
"""
import os
import pathlib
import subprocess
import unittest

from cli_support import NUM_FRAMES, CliTest

FOLDER = pathlib.Path(os.environ["WAYMARK_EXAMPLES"])


def run(example, *arguments):
    return subprocess.run([FOLDER / f"waymark_example_{example}", *map(str, arguments)],
                          capture_output=True, text=True, timeout=240)


class Examples(CliTest):
    def test_maps_a_folder_of_images(self):
        done = run("map_images", self.image_folder(), self.folder / "camchain.yaml")
        self.assertEqual(done.returncode, 0, done.stderr)
        poses = [line.split() for line in done.stdout.strip().split("\n")]
        self.assertGreater(len(poses), NUM_FRAMES // 2)
        self.assertEqual({len(pose) for pose in poses}, {4})

    def test_no_program_is_left_out(self):
        programs = {p.name.removeprefix("waymark_example_") for p in FOLDER.glob("waymark_example_*") if p.is_file()}
        tested = pathlib.Path(__file__).read_text()
        self.assertEqual({p for p in programs if f'run("{p}"' not in tested}, set())


if __name__ == "__main__":
    unittest.main()
