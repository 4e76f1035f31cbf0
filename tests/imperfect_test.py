#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A recorded stereo sequence of which images are missing or damaged and stamps are double is mapped almost as if it
were whole, and what was made the best of is counted; with few images per second no pose is plainly wrong. Needs
WAYMARK_DATA."""
import json
import os
import pathlib
import random
import shutil
import unittest

from cli_support import CliTest, truncate, waymark

DATA = pathlib.Path(os.environ.get("WAYMARK_DATA", ""))
SEQUENCE, HOUSE = DATA / "kitti_00_stereo", DATA / "sim_house_rgbd"
NUM_MISSING, NUM_DOUBLE = 20, 10


@unittest.skipUnless(os.environ.get("WAYMARK_DATA") and SEQUENCE.is_dir(), "needs kitti_00_stereo in WAYMARK_DATA")
class Imperfect(CliTest):
    def mapped(self, source, *options):
        """The error of the path, and what summary.json says."""
        done = self.run_on(source, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        judged = waymark("eval", self.out / "trajectory.txt", SEQUENCE / "groundtruth.txt", "--json")
        self.assertEqual(judged.returncode, 0, judged.stderr)
        return json.loads(judged.stdout)["ate_rmse_m"], self.summary(), done.stderr

    def damaged(self, rng):
        """A copy of the sequence, and its left images that lack a partner, among those that have a time."""
        copy = self.folder / "damaged"
        shutil.copytree(SEQUENCE, copy)
        times = (copy / "times.txt").read_text().split("\n")[:-1]
        double = rng.sample(range(1, len(times)), NUM_DOUBLE)
        for i in sorted(double):
            times[i] = times[i - 1]
        (copy / "times.txt").write_text("\n".join(times) + "\n")
        right = sorted((copy / "image_1").iterdir())
        self.assertEqual(len(right), len(times))
        # The first pair begins the map.
        missing = rng.sample(range(1, len(right)), NUM_MISSING + 1)
        for i in missing[1:]:
            right[i].unlink()
        truncate(right[missing[0]])
        return copy, right[missing[0]], len(times), times, missing

    def test_kitti(self):
        """Pairs of runs with as many features: the scale of a road scatters by half a percent from number to number."""
        whole_errors, errors = [], []
        for seed, num_features in ((1, 960), (2, 1000), (3, 1040)):
            with self.subTest(seed=seed):
                options = ("--set", f"features.count={num_features}")
                error, summary, _ = self.mapped(SEQUENCE, *options)
                self.assertEqual(summary["coverage"], 1.0)
                whole_errors.append(error)
                source, bad, count, times, missing = self.damaged(random.Random(seed))
                damaged_error, summary, messages = self.mapped(source, *options)
                shutil.rmtree(source)
                errors.append(damaged_error)
                self.assertEqual(summary["out_of_order"], NUM_DOUBLE)
                self.assertEqual(summary["frames"], count - NUM_DOUBLE)
                # Of frames with the same time the first is used.
                used = [i for i in range(count) if i == 0 or times[i] != times[i - 1]]
                self.assertEqual(summary["without_partner"], sum(i in used for i in missing))
                self.assertEqual(summary["unreadable"], 0)
                self.assertEqual(summary["coverage"], 1.0)
                if missing[0] in used:
                    self.assertIn(f"{bad} (camera 1): unreadable", messages)
        self.assertLessEqual(sum(errors), 1.2 * sum(whole_errors), (errors, whole_errors))

    def test_kitti_without_an_image_of_camera_0(self):
        source = self.folder / "damaged"
        shutil.copytree(SEQUENCE, source)
        bad = sorted((source / "image_0").iterdir())[40]
        truncate(bad)
        _, summary, messages = self.mapped(source)
        self.assertEqual((summary["unreadable"], summary["tracked"]), (1, summary["frames"] - 1))
        self.assertIn(f"{bad} (camera 0): unreadable", messages)


@unittest.skipUnless(os.environ.get("WAYMARK_DATA") and HOUSE.is_dir(), "needs sim_house_rgbd in WAYMARK_DATA")
class FewImages(CliTest):
    def test_no_pose_is_plainly_wrong(self):
        """At 1.5 images per second a narrow search finds the wrong ones of things that repeat."""
        done = self.run_on(HOUSE, "-c", HOUSE / "camchain.yaml", "--every", "10")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreaterEqual(self.summary()["coverage"], 0.6)
        judged = waymark("eval", self.out / "trajectory.txt", HOUSE / "groundtruth.txt", "--json")
        self.assertEqual(judged.returncode, 0, judged.stderr)
        self.assertLess(json.loads(judged.stdout)["ate_rmse_m"], 0.05)


if __name__ == "__main__":
    unittest.main()
