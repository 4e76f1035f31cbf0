#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Sequences made worse are worse in the way they should be, and rows of the table judge them."""
import pathlib
import sys
import tempfile
import types
import unittest

import cv2
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "script"))
from evaluation.degrade import FLAWS, IMAGE_FLAWS, LEVELS, degrade  # noqa: E402
from evaluation.hard import Frames, figures_of, is_chosen, median_figures, row_of  # noqa: E402
from evaluation.splice import Sequence  # noqa: E402

STEP_NS = 50_000_000
FIRST_NS = 1000 * 10**9
NUM_FRAMES = 70


def textured(seed, shape=(96, 128)):
    values = np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)
    return cv2.GaussianBlur(values, (0, 0), 1.5)


def seconds(stamp):
    return f"{stamp // 10**9}.{stamp % 10**9:09d}"


class SequenceTest(unittest.TestCase):
    """With a sequence with depth, a metre forward per frame."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="waymark_hard_")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        recorded = self.folder / "walk"
        stamps = [FIRST_NS + i * STEP_NS for i in range(NUM_FRAMES)]
        for stream in ("rgb", "depth"):
            (recorded / stream).mkdir(parents=True)
            (recorded / f"{stream}.txt").write_text(
                "".join(f"{seconds(s)} {stream}/{i}.png\n" for i, s in enumerate(stamps)))
            for i in range(NUM_FRAMES):
                cv2.imwrite(str(recorded / f"{stream}/{i}.png"), textured(i))
        (recorded / "camchain.yaml").write_text("cam0:\n")
        (recorded / "groundtruth.txt").write_text(
            "".join(f"{seconds(s)} {i} 0 0 0 0 0 1\n" for i, s in enumerate(stamps)))
        self.sequence = Sequence(recorded, "rgbd")

    def written(self, flaw, level):
        out = self.folder / f"{flaw}_{level}"
        frames = degrade(flaw, self.sequence, level, out)
        return frames, {stream: sorted((out / stream).iterdir()) for stream in ("rgb", "depth")}

    def test_all_flaws_leave_depth_and_are_the_same_each_time(self):
        for flaw in FLAWS:
            frames, files = self.written(flaw, 2)
            self.assertEqual(len(files["rgb"]), len(frames))
            for frame, depth in zip(frames, files["depth"]):
                self.assertEqual(depth.resolve(), self.sequence.files[frame.index][1].resolve())
            images = [f.read_bytes() for f in files["rgb"]]
            _, again = self.written(flaw, 2)
            self.assertEqual(images, [f.read_bytes() for f in again["rgb"]])

    def test_skipping_keeps_every_third_frame_at_its_time(self):
        frames, files = self.written("skip", 2)
        self.assertEqual([f.index for f in frames[:3]], [0, 3, 6])
        self.assertEqual(frames[2].stamp - frames[1].stamp, 3 * STEP_NS)
        self.assertEqual(frames[2].true_pose().position[0], 6.0)
        listed = (self.folder / "skip_2/rgb.txt").read_text().split("\n")
        self.assertEqual(len([line for line in listed if line]), len(files["rgb"]))

    def test_black_frames_end_each_sixty_and_need_no_pose(self):
        frames, files = self.written("black", 2)
        dark = [i for i, f in enumerate(files["rgb"]) if cv2.imread(str(f)).max() == 0]
        self.assertEqual(dark, list(range(52, 60)))
        poses = {f.stamp: f.true_pose() for f in frames if not f.part.is_black and f.index < 65}
        times = {"mean": 4.0, "p95": 8.0}
        run = types.SimpleNamespace(trajectories=[poses], summary={"tracking_ms": times})
        figures = figures_of(run, Frames.of_spliced(frames), "rgbd")
        self.assertAlmostEqual(figures["coverage"], 57 / 62)
        self.assertAlmostEqual(figures["ate_m"], 0.0)


class ImageFlawTest(unittest.TestCase):
    def levels(self, flaw, image, frame=0):
        return [IMAGE_FLAWS[flaw](image, frame, 0, level) for level in LEVELS]

    def test_cameras_are_treated_alike(self):
        for image in (textured(3), np.dstack([textured(3 + i) for i in range(3)])):
            for name, flaw in IMAGE_FLAWS.items():
                left, right = (flaw(image, 40, camera, 2).astype(int) for camera in (0, 1))
                self.assertEqual(left.shape, image.shape)
                # Of each only its noise is its own.
                self.assertEqual(np.array_equal(left, right), name != "dark", name)
                self.assertLess(abs(left.mean() - right.mean()), 0.2, name)

    def test_dark_images_lose_contrast_and_get_noise(self):
        step = np.full((200, 200), 50, np.uint8)
        step[:, 100:] = 150
        for image, contrast, noise in zip(self.levels("dark", step), (0.4, 0.2, 0.1), (3, 4, 5)):
            left, right = image[:, :100].astype(float), image[:, 100:].astype(float)
            self.assertAlmostEqual(right.mean() - left.mean(), 100.0 * contrast, delta=0.3)
            self.assertAlmostEqual(right.std(), noise, delta=0.2)

    def test_flicker_jumps_every_fifteen_frames(self):
        grey = np.full((4, 4), 60, np.uint8)
        for level, widest in zip(LEVELS, (1.5, 2.5, 4.0)):
            means = [IMAGE_FLAWS["flicker"](grey, i, 0, level).mean() for i in range(300)]
            self.assertEqual({i % 15 for i in range(1, 300) if means[i] != means[i - 1]}, {0})
            self.assertLessEqual(max(means), 60 * widest + 0.5)
            self.assertGreaterEqual(min(means), 60 / widest - 0.5)
            self.assertGreater(max(means) / min(means), widest)

    def test_blur_is_along_a_line(self):
        point = np.zeros((41, 41), np.uint8)
        point[20, 20] = 255
        for frame in (0, 10, 20):
            for image, length in zip(self.levels("blur", point, frame), (5, 9, 15)):
                rows, columns = np.nonzero(image)
                reach = max(np.ptp(rows), np.ptp(columns))
                self.assertLessEqual(reach, length - 1)
                self.assertGreaterEqual(reach, 0.5 * (length - 1))
                self.assertLessEqual(len(rows), length)

    def test_flat_images_lose_detail(self):
        image = textured(1)
        slopes = [np.abs(np.diff(i.astype(int))).mean() for i in (image, *self.levels("flat", image))]
        self.assertEqual(slopes, sorted(slopes, reverse=True))
        self.assertLess(slopes[3], 0.3 * slopes[0])

    def test_things_cross_the_view(self):
        grey = np.full((96, 128), 7, np.uint8)
        for level, share in zip(LEVELS, (0.15, 0.3, 0.45)):
            hidden = [(IMAGE_FLAWS["occlude"](grey, i, 0, level) != 7).mean() for i in range(0, 400, 5)]
            self.assertLess(max(hidden), share + 0.02)
            self.assertGreater(np.mean(hidden), 0.3 * share)
            self.assertGreater(np.std(hidden), 0.01)

    def test_compression_leaves_less_and_less(self):
        image = textured(2)
        errors = [np.abs(i.astype(int) - image).mean() for i in self.levels("compress", image)]
        self.assertGreater(errors[0], 1.0)
        self.assertEqual(errors, sorted(errors))


class RowTest(unittest.TestCase):
    def figures(self, ate_m, coverage=1.0, p95_ms=8.0):
        return {"coverage": coverage, "parts": 1, "ate_m": ate_m, "mean_ms": 4.0, "p95_ms": p95_ms}

    def short_of(self, figures, flaw="dark", level=2):
        return row_of("x", "mono", figures, self.figures(0.1), flaw, level)[-1]

    def test_rows_tell_the_median_and_the_ratio(self):
        middle = median_figures([self.figures(a) for a in (0.3, 0.1, 0.2)])
        self.assertEqual(row_of("x", "mono", middle, self.figures(0.1), "dark", 3),
                         ["x dark 3", "mono", "1.000", "1", "0.2000", "2.00", "4.0", "2.0", ""])
        without = median_figures([self.figures(0.1), self.figures(None)])
        self.assertEqual(row_of("x", "mono", without, self.figures(0.1))[4:6], ["-", "-"])

    def test_words_choose_rows(self):
        def chosen(only):
            return [(flaw, level) for flaw in ("dark", "blur") for level in LEVELS
                    if is_chosen(f"walk {flaw} {level}", only, level)]
        self.assertEqual(chosen(None), [("dark", 2), ("dark", 3), ("blur", 2), ("blur", 3)])
        self.assertEqual(chosen(["dark"]), [("dark", 2), ("dark", 3)])
        self.assertEqual(chosen(["dark 1", "blur 3"]), [("dark", 1), ("blur", 3)])
        self.assertEqual(chosen(["street"]), [])
        self.assertTrue(is_chosen("corridor", ["corr"]))

    def test_rows_name_the_targets_they_miss(self):
        self.assertEqual(self.short_of(self.figures(0.129, 0.99)), "")
        self.assertEqual(self.short_of(self.figures(0.131, 0.98)), "coverage 0.99, ATE x 1.3")
        self.assertEqual(self.short_of(self.figures(None)), "ATE x 1.3")
        self.assertEqual(self.short_of(self.figures(0.19), "skip"), "")
        self.assertEqual(self.short_of(self.figures(0.21), "skip"), "ATE x 2.0")
        self.assertEqual(self.short_of(self.figures(0.9, 0.95), "dark", 3), "")
        self.assertEqual(self.short_of(self.figures(0.1, 0.94, 8.1), "dark", 3),
                         "coverage 0.95, p95 by mean 2.0")


if __name__ == "__main__":
    unittest.main()
