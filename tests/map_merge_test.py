#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps that are joined, scaled, levelled and put where a trajectory is. The longer ones need the
sequences that WAYMARK_DATA names."""
import json
import os
import pathlib
import re
import unittest

import map_records
from cli_support import CAMERA, NUM_FRAMES, CliTest, waymark

HOUSE = pathlib.Path(os.environ.get("WAYMARK_DATA", "/nowhere")) / "sim_house_rgbd"


class MapTask(CliTest):
    def path(self, name):
        return self.folder / f"{name}.wmap"

    def make_map(self, name, source, *arguments):
        done = waymark("run", source, *arguments, "-o", self.folder / "run", "--map-out",
                       self.path(name))
        self.assertEqual(done.returncode, 0, done.stderr)

    def simulate(self, *arguments):
        """A simulated sequence with the camera of the others."""
        camera, out = self.folder / "camera.yaml", self.folder / "simulated"
        camera.write_text(CAMERA)
        done = waymark("simulate", *arguments, "--camera", camera, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        return out

    def task(self, *arguments):
        done = waymark("map", *arguments)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout

    def check(self, name):
        self.assertIn("sound", self.task("check", self.path(name)))

    def poses(self, name):
        """Camera 0 of the keyframes of the largest sub-map: time and position."""
        out = self.folder / "poses.txt"
        done = waymark("export", self.path(name), "--format", "tum", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        return [[float(word) for word in line.split()[:4]] for line in out.read_text().splitlines()]

    def error_m(self, name, groundtruth, align="none"):
        self.poses(name)
        done = waymark("eval", self.folder / "poses.txt", groundtruth, "--align", align, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)["ate_rmse_m"]


class Merge(MapTask):
    def merge(self, a, b, name):
        text = self.task("merge", self.path(a), self.path(b), "-o", self.path(name))
        self.check(name)
        return text

    def test_halves_that_overlap_are_joined(self):
        source = self.sequence("stereo")
        self.make_map("a", source, "--frames", 26, "--keep-images")
        first_pose = self.poses("a")[0]
        self.make_map("b", source, "--first", 14, "--keep-images")
        self.assertIn("joined: 2 sub-maps are 1 now", self.merge("a", "b", "both"))
        self.assertEqual(self.poses("both")[0], first_pose)
        num_images = len(self.poses("both"))  # One per keyframe.
        self.assertIn(f", {num_images} images", self.task("info", self.path("both")))
        self.assertLess(self.error_m("both", source / "groundtruth.txt", "se3"), 0.01)
        # The same again, and the result is a map like any other.
        self.merge("a", "b", "again")
        self.assertEqual(self.path("both").read_bytes(), self.path("again").read_bytes())
        done = waymark("localize", self.path("both"), source, "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.summary()["localized"], NUM_FRAMES)
        done = self.run_on(source, "--map-in", self.path("both"), "--map-out", self.path("more"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.check("more")

    def test_maps_of_different_places_are_kept_apart(self):
        other = self.simulate("hall", "--motion", "slide", "--setup", "stereo", "--frames", 20)
        self.make_map("a", self.sequence("stereo"), "--frames", 20)
        self.make_map("b", other)
        text = self.merge("a", "b", "both")
        self.assertIn("no overlap found, kept as 2 separate sub-maps", text)
        self.assertNotIn("map align", text)
        self.make_map("mono", self.sequence("mono"))
        self.assertIn("map align makes it metres", self.merge("a", "mono", "mixed"))
        self.assertIn("2 sub-maps", self.merge("mono", "a", "mixed"))

    def test_wrong_input(self):
        self.make_map("a", self.sequence("mono"))
        missing = waymark("map", "merge", self.path("a"), self.path("b"), "-o", self.path("c"))
        self.assert_fails(missing, 2, "b.wmap")
        self.assertFalse(self.path("c").exists())
        self.assert_fails(waymark("map", "merge", self.path("a"), self.path("a")), 2, "--out")
        elsewhere = self.folder / "no" / "c.wmap"
        self.assert_fails(waymark("map", "merge", self.path("a"), self.path("a"), "-o", elsewhere), 1)
        records = map_records.split(self.path("a").read_bytes())
        records[1]["end_landmark"] = 2**28  # As far as any map may go, but not twice that.
        far = map_records.join(records)
        self.path("a").write_bytes(far)
        self.check("a")
        self.path("c").write_bytes(b"as it was")
        done = waymark("map", "merge", self.path("a"), self.path("a"), "-o", self.path("c"))
        self.assert_fails(done, 1, "would have ids of landmarks up to")
        self.assertEqual(self.path("c").read_bytes(), b"as it was")


class Align(MapTask):
    def align(self, name, *arguments):
        text = self.task("align", self.path("map"), *arguments, "-o", self.path(name))
        self.check(name)
        return text

    def fails(self, *arguments):
        done = waymark("map", "align", self.path("map"), *arguments, "-o", self.path("no"))
        self.assertFalse(self.path("no").exists())
        return done

    def test_scales_by_distances(self):
        source = self.sequence("mono")
        self.make_map("map", source)
        self.assertIn("now in metres", self.align("scaled", "--distance", 0, 1, 2.5))
        self.assertIn("scale free", self.task("info", self.path("map")))
        self.assertIn("in metres", self.task("info", self.path("scaled")))
        by_time = self.poses("scaled")
        length = sum((x - y) ** 2 for x, y in zip(by_time[0][1:], by_time[1][1:])) ** 0.5
        self.assertAlmostEqual(length, 2.5, places=6)
        self.align("scaled", "--distance", 0, 1, 2.4, "--distance", 0, 1, 2.6)
        done = waymark("localize", self.path("scaled"), source, "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.summary()["localized"], NUM_FRAMES)

    def test_fits_a_trajectory(self):
        source = self.simulate("room", "--motion", "inspect", "--setup", "mono", "--frames", 120)
        truth = source / "groundtruth.txt"
        self.make_map("map", source)
        self.assertGreater(self.error_m("map", truth), 0.1)
        self.assertIn("keyframes with a pose", self.align("placed", "--trajectory", truth))
        self.assertLess(self.error_m("placed", truth), 0.02)
        self.assertIn("in metres", self.task("info", self.path("placed")))
        late = self.folder / "late.txt"
        late.write_text("1e6 0 0 0 0 0 0 1\n1000001 1 0 0 0 0 0 1\n1000002 1 1 0 0 0 0 1\n")
        self.assert_fails(self.fails("--trajectory", late), 2, "late.txt", "expected three or more")

    def test_levels_by_an_up_direction(self):
        self.make_map("map", self.sequence("stereo"))
        self.align("level", "--up", "0,-1,0")
        for (_, *before), (_, *after) in zip(self.poses("map"), self.poses("level")):
            for value, expected in zip(after, (before[0], before[2], -before[1])):
                self.assertAlmostEqual(value, expected, places=9)

    def test_wrong_usage(self):
        self.make_map("map", self.sequence("stereo"))
        self.assert_fails(self.fails(), 2, "expected one of --distance")
        self.assert_fails(self.fails("--up", "0,0,1", "--distance", 0, 1, 2), 2, "expected one of")
        self.assert_fails(self.fails("--up", "0,0,0"), 2, "--up", "expected three numbers")
        self.assert_fails(self.fails("--up", "0,1"), 2, "--up")
        self.assert_fails(self.fails("--distance", 0, 1), 2, "--distance")
        self.assert_fails(self.fails("--distance", 0, 1, 2), 2, "stereo or depth measured lengths")
        self.make_map("map", self.sequence("mono"))
        self.assert_fails(self.fails("--distance", 0, 999, 2), 2, "keyframe 999", "expected the id")
        self.assert_fails(self.fails("--distance", 0, 1, -2), 2, "expected more than 0")
        self.assert_fails(self.fails("--distance", 0, 1, "nan"), 2, "--distance")
        self.assert_fails(self.fails("--distance", 0, 0, 2), 2, "expected two")

    def test_leaves_the_file_where_no_map_would_be_left(self):
        self.make_map("map", self.sequence("mono"))
        aligned, before = self.path("aligned"), b"as it was"
        aligned.write_bytes(before)
        far = self.folder / "far.txt"
        for unit, expected in ((1e200, "at most 1e+09"), (1e-9, "would scale the map by"),
                               (1e8, "would scale the map by")):
            far.write_text("".join(f"{time_s:.9f} {unit * (i % 3)} {unit * (i % 2)} 0 0 0 0 1\n"
                                   for i, (time_s, *_) in enumerate(self.poses("map"))))
            done = waymark("map", "align", self.path("map"), "--trajectory", far, "-o", aligned)
            self.assert_fails(done, 2, far, expected)
        for arguments in (("--distance", 0, 1, 1e308), ("--distance", 0, 1, 1e-300),
                          ("--distance", 0, 1, 9e5), ("--up", "1e308,1e308,0"), ("--up", "inf,0,1"),
                          ("--up", "nan,0,1")):
            done = waymark("map", "align", self.path("map"), *arguments, "-o", aligned)
            self.assert_fails(done, 2, arguments[0])
        self.assertEqual(aligned.read_bytes(), before)


@unittest.skipUnless(HOUSE.is_dir(), f"needs {HOUSE}; set WAYMARK_DATA")
class House(MapTask):
    def test_two_sessions_of_one_flat(self):
        """No worse than the worse of the two, although what they share is only a sixth."""
        source, truth = HOUSE, HOUSE / "groundtruth.txt"
        errors = []
        for name, part in (("a", ("--frames", 280)), ("b", ("--first", 230))):
            self.make_map(name, source, "-c", source / "camchain.yaml", *part)
            errors.append(self.error_m(name, truth, "se3"))
        text = self.task("merge", self.path("a"), self.path("b"), "-o", self.path("both"))
        self.assertIn("joined: 2 sub-maps are 1 now", text)
        self.check("both")
        self.assertLess(self.error_m("both", truth, "se3"), 1.2 * max(errors))
        self.task("align", self.path("both"), "--trajectory", truth, "-o", self.path("placed"))
        self.assertLess(self.error_m("placed", truth), 1.2 * max(errors))


if __name__ == "__main__":
    unittest.main()
