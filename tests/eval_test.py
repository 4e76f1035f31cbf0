#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Trajectories compared as files of other programs have them: stamps of other units and of other clocks, none at all,
and a scale of their own."""
import json
import math
import unittest

from cli_support import CliTest, waymark


def positions(count, period_s=0.025, begin_s=0.0):
    """A walk by time; no two seconds of it have the same speeds."""
    for i in range(count):
        t = begin_s + period_s * i
        yield t, (1.2 * t + 0.3 * math.sin(1.7 * t), 0.4 * math.sin(0.8 * t), 0.2 * math.cos(2.3 * t)), 0.5 * math.sin(0.9 * t)


def quaternion(angle):
    return 0.0, math.sin(angle / 2), 0.0, math.cos(angle / 2)


def numbers(values):
    return " ".join(f"{value:.9f}" for value in values)


def tum(poses, stamp=lambda t: f"{t:.6f}", scale=1.0):
    return "".join(f"{stamp(t)} {numbers([scale * x for x in at])} {numbers(quaternion(angle))}\n" for t, at, angle in poses)


def kitti(poses, offset=0.0):
    lines = ""
    for _, (x, y, z), angle in poses:
        c, s = math.cos(angle), math.sin(angle)
        lines += numbers([c, 0, s, x + offset * math.sin(40 * x), 0, 1, 0, y, -s, 0, c, z]) + "\n"
    return lines


class Eval(CliTest):
    def compare(self, estimate, truth, *options):
        (self.folder / "estimate.txt").write_text(estimate)
        (self.folder / "truth.txt").write_text(truth)
        return waymark("eval", self.folder / "estimate.txt", self.folder / "truth.txt", *options)

    def figures(self, estimate, truth, *options):
        done = self.compare(estimate, truth, *options, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_stamps_of_every_unit(self):
        begin_s = 1403636579
        truth = tum(positions(100), lambda t: f"{begin_s + t:.6f}")
        for unit, stamp in {
                "nanoseconds with decimals": lambda t: f"{round((begin_s + t) * 1e6)}000.000000",
                "nanoseconds": lambda t: f"{round((begin_s + t) * 1e6)}000",
                "microseconds": lambda t: f"{round((begin_s + t) * 1e6)}",
                "milliseconds": lambda t: f"{round((begin_s + t) * 1e3)}"}.items():
            with self.subTest(unit):
                found = self.figures(tum(positions(100), stamp), truth)
                self.assertEqual((found["pairs"], found["ate_rmse_m"], found["notes"]), (100, 0, []))

    def test_clocks_that_differ_by_a_second(self):
        estimate, truth = tum(positions(240), lambda t: f"{t + 1:.3f}"), tum(positions(240))
        found = self.figures(estimate, truth)
        self.assertGreater(found["ate_rmse_m"], 0.1)
        self.assertIn("the clocks seem to be 1 s apart", found["notes"][0])
        self.assertIn("--time-offset -1:", self.compare(estimate, truth).stderr)
        for offset in ("auto", "-1"):
            found = self.figures(estimate, truth, "--time-offset", offset)
            self.assertLess(found["ate_rmse_m"], 1e-4)
            self.assertEqual((found["pairs"], found["time_offset_s"], found["notes"]), (240, -1, []))

    def test_clocks_of_different_epochs(self):
        estimate, truth = tum(positions(240), lambda t: f"{t + 1.4e9:.3f}"), tum(positions(240))
        done = self.compare(estimate, truth)
        self.assert_fails(done, 2, "evaluation", "--time-offset -1400000000")
        self.assertLess(self.figures(estimate, truth, "--time-offset", "auto")["ate_rmse_m"], 1e-4)

    def test_an_offset_that_is_none(self):
        walk = tum(positions(240))
        for offset in ("soon", "nan", "1e10", ""):
            self.assert_fails(self.compare(walk, walk, "--time-offset", offset), 2, "--time-offset", "seconds or auto")
        still = tum((t, (0, 0, 0), 0) for t, _, _ in positions(240))
        self.assert_fails(self.compare(still, walk, "--time-offset", "auto"), 2, "auto found no shift")

    def test_two_files_of_kitti_without_times(self):
        found = self.figures(kitti(positions(60), 0.01), kitti(positions(60)))
        self.assertEqual((found["pairs"], found["coverage"]), (60, 1))
        self.assertTrue(0.003 < found["ate_rmse_m"] < 0.01, found)
        self.assertIn("line by line", found["notes"][0])
        done = self.compare(kitti(positions(59)), kitti(positions(60)))
        self.assert_fails(done, 2, "estimate.txt", "59 poses without times, expected 60 as in")

    def test_a_scale_of_its_own(self):
        estimate, truth = tum(positions(240), scale=0.25), tum(positions(240))
        done = self.compare(estimate, truth)
        self.assertIn("note: the scale is off: 4 times as large", done.stderr)
        self.assertIn("alignment  se3", done.stdout)
        (self.folder / "summary.json").write_text(json.dumps({
            "frames": 240, "setup": "mono",
            "quality": {"reprojection_px": 0.5, "matches_kept": 0.9, "length": 3, "is_metric": False}}))
        found = self.figures(estimate, truth)
        self.assertEqual(found["align"], "sim3")
        self.assertLess(found["ate_rmse_m"], 1e-6)
        self.assertEqual(self.figures(estimate, truth, "--align", "se3")["align"], "se3")


if __name__ == "__main__":
    unittest.main()
