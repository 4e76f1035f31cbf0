#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""No command writes to what it reads, or over what it did not make."""
import os
import unittest

from cli_support import CliTest, waymark, write_png

# Commands that read IN, or what is in it, and would write OUT. Nothing is opened before that is refused: any file does.
SAME = (
    "run IN -c camera.yaml --map-out camera.yaml",
    "run IN -c camera.yaml --log camera.yaml",
    "run IN --map-in m.wmap --log m.wmap",
    "run IN --map-in m.wmap --overlay m.wmap",
    "run IN --depth m.wmap --map-out m.wmap",
    "run IN images --map-out images",
    "run IN --mask link.wmap --map-out m.wmap",
    "run IN --mask m.wmap --map-out hard.wmap",
    "run IN --mask m.wmap --map-out folder/../m.wmap",
    "run IN images --map-out images/0.png",
    "run IN --map-out IN/times.txt",
    "run IN -o IN",
    "run IN -c calibration.yaml -o .",
    "run IN -c waymark-out/calibration.yaml",
    "run IN -c waymark-out/link.yaml",
    "run IN --log x --map-out x",
    "run IN --log x --overlay folder/../x",
    "run IN --log waymark-out/summary.json",
    "run IN --map-out waymark-out/trajectory_3.txt",
    "localize m.wmap IN --log m.wmap",
    "localize m.wmap IN --mask waymark-out/view_mask.png",
    "localize atlas IN --log atlas/tiles/1.wmap",
    "calibrate IN -o IN/times.txt",
    "calibrate images -o images/0.png",
    "calibrate walk.mp4 -o walk.mp4",
    "calibrate images --mask camera.yaml -o camera.yaml",
    "eval m.wmap camera.yaml --plot camera.yaml",
    "eval m.wmap camera.yaml --plot m.wmap",
    "map merge m.wmap walk.mp4 -o walk.mp4",
    "map merge walk.mp4 m.wmap -o walk.mp4",
    "map align m.wmap --up 0,0,1 -o m.wmap",
    "map align walk.mp4 --trajectory m.wmap -o m.wmap",
    "map tile m.wmap -o m.wmap",
    "export m.wmap -o m.wmap",
    "export m.wmap -o link.wmap",
    "export m.wmap --format colmap --input images -o images",
    "export m.wmap --format colmap --input images -o .",
    "export m.wmap --format colmap --trajectory folder/t.txt -o folder",
    "import m.wmap -o m.wmap",
    "import m.wmap --settings camera.yaml -o camera.yaml",
    "simulate room --camera camera.yaml -o camera.yaml",
    "simulate room --camera folder/t.txt -o folder",
    "report waymark-out -o waymark-out/trajectory.txt",
    "report waymark-out --ground-truth camera.yaml -o camera.yaml",
    "atlas add m.wmap m.wmap",
    "atlas export atlas -o atlas/tiles/1.wmap",
    "fleet IN -c camera.yaml --report camera.yaml -o new",
    "fleet m.wmap -o m.wmap",
    "view m.wmap -o m.wmap",
)


class Paths(CliTest):
    def setUp(self):
        super().setUp()
        for name in ("IN", "images", "folder", "atlas/tiles", "waymark-out"):
            (self.folder / name).mkdir(parents=True)
        for name in ("m.wmap", "camera.yaml", "calibration.yaml", "walk.mp4", "IN/times.txt", "folder/t.txt", "atlas/atlas.db",
                     "atlas/tiles/1.wmap", "waymark-out/calibration.yaml", "waymark-out/trajectory.txt", "waymark-out/view_mask.png"):
            (self.folder / name).write_text(name)
        write_png(self.folder / "images" / "0.png", 64, 48)
        (self.folder / "link.wmap").symlink_to("m.wmap")
        os.link(self.folder / "m.wmap", self.folder / "hard.wmap")
        os.link(self.folder / "waymark-out" / "calibration.yaml", self.folder / "waymark-out" / "link.yaml")

    def contents(self):
        return {path: path.read_bytes() for path in self.folder.rglob("*") if path.is_file()}

    def test_no_input_is_an_output(self):
        before = self.contents()
        for command in SAME:
            with self.subTest(command):
                self.assert_fails(waymark(*command.split(), cwd=self.folder), 2, "expected another name")
                self.assertEqual(self.contents(), before)

    def test_what_is_no_input_may_be_written(self):
        """It fails later, over what it reads."""
        for command in ("run IN --map-in m.wmap --map-out m.wmap", "run IN --log IN/new.txt", "run IN -o IN/out",
                        "calibrate IN -o IN/new.yaml"):
            done = waymark(*command.split(), cwd=self.folder)
            self.assertNotIn("expected another name", done.stderr)


class Results(CliTest):
    def test_results_of_an_earlier_run_are_replaced_as_a_whole(self):
        source = self.image_folder()
        done = self.run_on(source, "-c", self.folder / "camchain.yaml", "--frames", 3)
        self.assertNotIn("replaced", done.stderr)
        for name in ("report.html", "calibration.yaml", "trajectory_1.txt", "view_mask.png"):
            (self.out / name).write_text("of the earlier run")
        (self.out / "notes.txt").write_text("my own")
        done = self.run_on(source, "-c", self.folder / "camchain.yaml", "--frames", 3)
        self.assertIn(f"{self.out}: the results of an earlier run are replaced", done.stderr)
        self.assertEqual({path.name for path in self.out.iterdir()},
                         {"trajectory.txt", "keyframes.txt", "points.ply", "summary.json", "frames.csv", "notes.txt"})

    def test_files_that_no_run_made_are_left_alone(self):
        source = self.image_folder()
        for name in ("trajectory.txt", "calibration.yaml", "view_mask.png"):
            own = self.folder / f"own_{name}"
            own.mkdir()
            (own / name).write_text("my own")
            done = waymark("run", source, "-c", self.folder / "camchain.yaml", "-o", own)
            self.assert_fails(done, 2, f"holds {name}, which no run left there")
            self.assertEqual([path.read_text() for path in own.iterdir()], ["my own"])

    def test_a_data_set_is_replaced_where_it_was_simulated(self):
        arguments = ("simulate", "room", "--setup", "mono", "-o", self.out, "--frames")
        self.assertEqual(waymark(*arguments, 3).returncode, 0)
        done = waymark(*arguments, 2)
        self.assertIn("the earlier one is replaced", done.stderr)
        self.assertEqual(len(list(self.out.rglob("*.png"))), 2)
        mine = next(self.out.rglob("*.png")).with_name("mine.png")
        write_png(mine, 64, 48)
        self.assertIn("mine.png", waymark(*arguments, 2).stderr)
        self.assertTrue(mine.exists())


if __name__ == "__main__":
    unittest.main()
