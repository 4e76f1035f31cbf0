#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What judges interrupted sequences sees each kind of failure."""
import json
import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "script"))
from cli_support import CliTest, waymark  # noqa: E402
from evaluation.drift import drift  # noqa: E402
from evaluation.kidnapped import Case, Verdict  # noqa: E402
from evaluation.rotations import rotation_of  # noqa: E402
from evaluation.splice import Part, SplicedFrame  # noqa: E402
from evaluation.trajectories import (Pose, Truth, align, ate, end_to_end_error,  # noqa: E402
                                     read_trajectory)

STEP_NS = 50_000_000
NUM_FRAMES = 100


def format_pose(stamp, position, angle):
    x, y, z = position
    return (f"{stamp // 10**9}.{stamp % 10**9:09d} {x:.9f} {y:.9f} {z:.9f} 0 0 "
            f"{math.sin(angle / 2):.9f} {math.cos(angle / 2):.9f}\n")


class Walk:
    """In place of a recorded sequence: along an arc of 10 m."""

    def __init__(self, name="walk", length=NUM_FRAMES):
        self.name = name
        self.stamps = [1000 * 10**9 + i * STEP_NS for i in range(length)]
        self.truth = self

    def calibration(self):
        return "the same"

    def true_pose(self, index):
        angle = 0.01 * index
        return Pose(rotation_of(0, 0, math.sin(angle / 2), math.cos(angle / 2)),
                    (10 * math.sin(angle), 10 - 10 * math.cos(angle), 0.1 * math.sin(3 * angle)))

    def pairs_with(self, trajectory):
        return [(pose, self.true_pose(self.stamps.index(s))) for s, pose in trajectory.items()]

    def whole(self):
        return {s: self.true_pose(i) for i, s in enumerate(self.stamps)}


class FakeRun:
    """Every frame tracked, in the sub-maps and with the poses that are given."""

    def __init__(self, submaps, poses, live=None):
        self.live_submap = dict(enumerate(live or submaps))
        self.frames = [{"index": i, "state": "tracked", "reason": "none", "submap": str(m)}
                       for i, m in enumerate(submaps)]
        self.trajectories = [{s: p for (s, p), m in zip(poses, submaps) if m == number}
                             for number in sorted(set(submaps))]


class Judging(unittest.TestCase):
    def setUp(self):
        self.walk, self.other = Walk(), Walk("other")

    def frames(self, *parts):
        pieces = [(part, i) for part in parts for i in range(part.first, part.end)]
        return [SplicedFrame(k * STEP_NS, part, i) for k, (part, i) in enumerate(pieces)]

    def failures(self, frames, submaps, num_submaps=1, live=None, wrong=()):
        poses = []
        for k, frame in enumerate(frames):
            pose = frame.true_pose()
            if k in wrong:
                pose = Pose(pose.rotation, (pose.position[0] + 3.0, *pose.position[1:]))
            poses.append((frame.stamp, pose))
        run = FakeRun(submaps, poses, live)
        verdict = Verdict(Case("case", "stereo", (), num_submaps), frames, run,
                          lambda sequence: sequence.whole())
        return verdict.report().failures

    def assert_says(self, failures, words):
        self.assertTrue(any(words in f for f in failures), failures)

    def test_nothing_is_wrong(self):
        frames = self.frames(Part(self.walk, 0, 60), Part(self.walk, 20, 80))
        self.assertEqual(self.failures(frames, [0] * 120), [])

    def test_places_not_found_again(self):
        frames = self.frames(Part(self.walk, 0, 60), Part(self.walk, 20, 80))
        failures = self.failures(frames, [0] * 60 + [1] * 60)
        self.assert_says(failures, "never found")
        self.assert_says(failures, "expected 1")

    def test_places_found_late(self):
        frames = self.frames(Part(self.walk, 0, 60), Part(self.walk, 20, 80))
        failures = self.failures(frames, [0] * 120, live=[0] * 60 + [1] * 30 + [0] * 30)
        self.assert_says(failures, "found after 1.50 s")

    def test_poses_in_wrong_places(self):
        frames = self.frames(Part(self.walk, 0, 100))
        failures = self.failures(frames, [0] * 100, wrong=range(50, 58))
        self.assert_says(failures, "8 frames of walk in a wrong place, from frame 50 on")
        self.assert_says(failures, "ATE")

    def test_places_taken_for_others(self):
        frames = self.frames(Part(self.walk, 0, 60), Part(self.other, 0, 60))
        self.assert_says(self.failures(frames, [0] * 120, 2), "holds other and walk")
        self.assertEqual(self.failures(frames, [0] * 60 + [1] * 60, 2), [])


class Comparing(CliTest):
    def test_errors_are_those_of_the_program(self):
        walk = Walk()
        truth, estimate = self.folder / "truth.txt", self.folder / "estimate.txt"
        true = [(s, walk.true_pose(i).position, 0.01 * i) for i, s in enumerate(walk.stamps)]
        truth.write_text("".join(format_pose(*row) for row in true))
        # Half as large, with errors, and turned by a quarter.
        def moved(i, p):
            return (-0.5 * p[1] + 0.02 * math.sin(i), 0.5 * p[0], 0.5 * p[2] + 0.01 * math.cos(2 * i))
        estimate.write_text("".join(format_pose(s, moved(i, p), a + math.pi / 2)
                                    for i, (s, p, a) in enumerate(true)))
        pairs = Truth(truth).pairs_with(read_trajectory(estimate))
        for alignment in ("se3", "sim3"):
            done = waymark("eval", estimate, truth, "--align", alignment, "--json")
            expected = json.loads(done.stdout)
            with_scale = alignment == "sim3"
            self.assertAlmostEqual(ate(pairs, with_scale), expected["ate_rmse_m"], places=5)
            self.assertAlmostEqual(align(pairs, with_scale).scale, expected["scale"], places=5)
        metres, degrees = end_to_end_error(pairs, True)
        self.assertLess(metres, 0.1)
        self.assertGreater(metres, 0.005)
        self.assertLess(degrees, 1e-3)

    def test_drift_is_that_of_stretches(self):
        straight = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        true = [Pose(straight, (0.5 * i, 0.0, 0.0)) for i in range(801)]

        def estimate(metres, angle=lambda way: 0.0):
            return [Pose(rotation_of(0, 0, math.sin(angle(p.position[0]) / 2), math.cos(angle(p.position[0]) / 2)),
                         (metres(p.position[0]), 0.0, 0.0)) for p in true]

        def found(poses, with_scale=False):
            return drift(list(zip(poses, true)), with_scale)

        exact = found(estimate(lambda way: 3.0 * way), True)
        self.assertEqual(exact["stretch_m"], 100.0)
        for key in ("translation_m", "rotation_deg", "scale_percent"):
            self.assertAlmostEqual(exact[key], 0.0, places=6)
        self.assertAlmostEqual(found(estimate(lambda way: 1.02 * way))["translation_m"], 2.0, places=6)
        # The scale grows by 1 % of that at the start in each 100 m.
        growing = found(estimate(lambda way: way + 0.5e-4 * way * way))
        self.assertAlmostEqual(growing["scale_percent"], 1.0, delta=0.03)
        turning = found(estimate(lambda way: way, lambda way: 1e-4 * way))
        self.assertAlmostEqual(turning["rotation_deg"], math.degrees(0.01), places=6)
        # 60 m: stretches of 30 m, figures still per 100 m.
        short = drift(list(zip(estimate(lambda way: 1.02 * way), true))[:121], False)
        self.assertAlmostEqual(short["stretch_m"], 30.0)
        self.assertAlmostEqual(short["translation_m"], 2.0, places=6)
        self.assertIsNone(drift(list(zip(true, true))[:90], False))


if __name__ == "__main__":
    unittest.main()
