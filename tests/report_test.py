#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The report of runs that went well, in part and badly, the advice at their end, and of folders that are none."""
import html
import html.parser
import json
import pathlib
import re
import shutil
import sys
import tempfile
import unittest

import cv2
import numpy as np

from cli_support import CAMERA, CliTest, truncate, waymark

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "script"))
from evaluation.degrade import blur, dark, flat  # noqa: E402

SEVERE = 3


class Elements(html.parser.HTMLParser):
    """Names and attributes of all elements; those that are left open at the end."""

    VOID = {"meta", "br", "path", "rect", "circle"}

    def __init__(self, text):
        super().__init__()
        self.found, self.open = [], []
        self.feed(text)

    def handle_starttag(self, name, attributes):
        self.found.append((name, dict(attributes)))
        if name not in self.VOID:
            self.open.append(name)

    def handle_endtag(self, name):
        if name not in self.VOID:
            assert self.open.pop() == name, name

    def handle_startendtag(self, name, attributes):
        self.found.append((name, dict(attributes)))


class ReportTest(CliTest):
    def page(self, path=None):
        text = (path or self.out / "report.html").read_text()
        elements = Elements(text)
        self.assertEqual(elements.open, [])
        for _, attributes in elements.found:
            self.assertFalse({"src", "href", "onclick", "onload"} & set(attributes))
        return text

    def grade(self, path=None):
        return re.search(r"<h1>.*badge (\w+)\"", self.page(path))[1]

    def advised(self):
        return [advice["cause"] for advice in self.summary()["advice"]]

    def spoil(self, folder, change, first=0):
        """Changes images of camera 0 in place, from one on."""
        for frame, path in enumerate(self.images(folder)[first:]):
            image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            cv2.imwrite(str(path), change(image, frame))

    def run_reported(self, source, *options, status=0):
        done = self.run_on(source, "--report", *options)
        self.assertIn(done.returncode, status if isinstance(status, tuple) else (status,), done.stderr)
        return done


class Runs(ReportTest):
    def test_a_good_run(self):
        source = self.sequence("stereo")
        done = self.run_reported(source)
        self.assertEqual(self.grade(), "good")
        self.assertEqual(self.advised(), [])
        self.assertNotIn("; try: ", done.stderr)
        self.assertNotIn("What to try", self.page())
        again = waymark("report", self.out, "--ground-truth", source / "groundtruth.txt")
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(again.stdout.strip(), str(self.out / "report.html"))
        self.assertIn("Position error [m] over the path", self.page())
        self.assertEqual(self.grade(), "good")

    def test_what_is_recorded(self):
        self.run_reported(self.sequence("stereo"), "--set", "features.count=900")
        frames = self.frames()
        self.assertTrue(all(0 < int(frame["features"]) <= 900 for frame in frames))
        self.assertTrue(all(60 < int(frame["brightness"]) < 200 for frame in frames))
        self.assertEqual(self.summary()["settings"], ["features.count: 900"])
        self.assertIn("features.count: 900", self.page())
        points = (self.out / "points.ply").read_text().split("\n")
        self.assertEqual(len(points), 8 + min(self.summary()["landmarks"], 10000))

    def test_a_focal_length_that_is_off(self):
        told = self.folder / "told"
        made = waymark("simulate", "room", "--motion", "inspect", "--setup", "mono", "--frames", 205, "--told",
                       "focal=1.10", "-o", told)
        self.assertEqual(made.returncode, 0, made.stderr)
        self.run_reported(told, "-c", told / "camchain.yaml")
        self.assertEqual(self.grade(), "check")
        self.assertIn("To check: Calibration.", self.page())
        self.assertRegex(self.page(), "off by [0-9.]+ %")

    def test_dark_and_blurred(self):
        source = self.sequence("mono")
        self.spoil(source, lambda image, frame: dark(blur(image, frame, 0, SEVERE), frame, 0, SEVERE))
        done = self.run_reported(source, status=3)
        self.assertEqual(self.grade(), "bad")
        self.assertEqual(self.advised()[0], "dark")
        self.assertIn("; try: more light", done.stderr)
        self.assertIn("(docs/troubleshooting.md#the-images-are-dark)", done.stderr)
        self.assertIn("the images are dark", self.page())

    def test_blurred(self):
        source = self.sequence("mono")
        self.spoil(source, lambda image, _: cv2.blur(image, (61, 9)), first=15)
        self.run_reported(source)
        self.assertEqual(self.grade(), "bad")
        self.assertIn("blur", self.advised())
        self.assertNotIn("dark", self.advised())

    def test_flat(self):
        source = self.sequence("mono")
        self.spoil(source, lambda image, frame: cv2.GaussianBlur(flat(image // 4 + 90, frame, 0, SEVERE), (0, 0), 4))
        self.run_reported(source, status=3)
        self.assertIn("flat", self.advised())

    def test_turning_on_the_spot(self):
        source = self.folder / "turning"
        made = waymark("simulate", "room", "--motion", "rotate", "--setup", "mono", "--frames", 40, "-o", source)
        self.assertEqual(made.returncode, 0, made.stderr)
        self.run_reported(source, "-c", source / "camchain.yaml", status=3)
        self.assertIn("no_parallax", self.advised())
        self.assertEqual(self.grade(), "bad")
        self.assertIn("No frame got a pose", self.page())

    def test_a_pair_that_does_not_start(self):
        source = self.sequence("stereo")
        right = sorted((source / "mav0" / "cam1" / "data").glob("*.png"))
        for path in right:
            cv2.imwrite(str(path), cv2.rotate(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), cv2.ROTATE_180))
        self.run_reported(source, status=3)
        summary = self.summary()
        self.assertTrue("pair" in self.advised() or summary["mistakes"], summary)

    def test_damaged_images(self):
        source = self.sequence("mono")
        for path in self.images(source)[10:14]:
            truncate(path)
        self.run_reported(source)
        self.assertIn("unreadable", self.advised())

    def test_images_that_are_not_in_the_map(self):
        map_file = self.folder / "room.wmap"
        self.assertEqual(self.run_on(self.sequence("stereo"), "--map-out", map_file).returncode, 0)
        other = self.folder / "other"
        made = waymark("simulate", "hall", "--setup", "mono", "--frames", 15, "-o", other)
        self.assertEqual(made.returncode, 0, made.stderr)
        done = waymark("localize", map_file, other, "-o", self.out)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("not_in_map", self.advised())
        self.assertEqual(waymark("report", self.out).returncode, 0)


class Causes(ReportTest):
    """What is advised where the cause is there; those of images, pairs and localizing are above."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="waymark_test_")
        cls.addClassCleanup(folder.cleanup)
        cls.made = {}
        camera = pathlib.Path(folder.name) / "camera.yaml"
        camera.write_text(CAMERA.split("cam1:")[0])
        for motion, count in (("inspect", 120), ("fast_turn", 70)):
            cls.made[motion] = pathlib.Path(folder.name) / motion
            done = waymark("simulate", "room", "--motion", motion, "--camera", camera, "--setup", "mono", "--frames",
                           count, "--quiet", "-o", cls.made[motion])
            assert done.returncode == 0, done.stderr

    def copied(self, motion="inspect"):
        copy = self.folder / "input"
        shutil.copytree(self.made[motion], copy)
        return copy

    def advised_after(self, source, *options, status=0):
        self.run_reported(source, "-c", source / "camchain.yaml", *options, status=status)
        causes = self.advised()
        for advice in self.summary()["advice"]:
            self.assertIn(advice["remedy"].split(";")[0][:30], html.unescape(self.page()))
        return causes

    def test_few_features(self):
        source = self.copied()
        wall = np.full((240, 376), 60, np.uint8)
        wall[:, 188:] = 190
        cv2.circle(wall, (90, 120), 50, 140, -1)
        self.spoil(source, lambda image, frame: wall, first=60)
        self.assertEqual(self.advised_after(source), ["few_features"])

    def test_losses(self):
        source = self.copied()
        somebody = np.full((240, 376), 90, np.uint8)
        self.spoil(source, lambda image, frame: somebody if frame in range(40, 44) or frame in range(65, 69) or
                   frame in range(90, 94) else image)
        self.assertIn("losses", self.advised_after(source))

    def test_fast_motion(self):
        self.assertIn("fast_motion", self.advised_after(self.copied(), "--every", 20))

    def test_parts(self):
        source = self.copied()
        other = self.folder / "other"
        shutil.copytree(self.made["fast_turn"], other)
        for path, image in zip(self.images(source)[50:], self.images(other)):
            # Upside down no place of the first part is in it.
            cv2.imwrite(str(path), cv2.rotate(cv2.imread(str(image), cv2.IMREAD_GRAYSCALE), cv2.ROTATE_180))
        self.assertIn("parts", self.advised_after(source))

    def test_late(self):
        # How many frames are left, and whether a map starts of them, depends on what else the machine does.
        self.assertIn("late", self.advised_after(self.copied(), "--timing", "realtime", "--pace", 40, status=(0, 3)))

    def test_jumps(self):
        source = self.copied("fast_turn")
        rows = (source / "mav0/cam0/data.csv").read_text().split("\n")
        (source / "mav0/cam0/data.csv").write_text("\n".join(rows[:51] + rows[63:66]) + "\n")
        self.assertIn("jumps", self.advised_after(source))

    def test_calibration(self):
        source = self.copied()
        rng = np.random.default_rng(1)
        rows, columns = np.mgrid[0:240, 0:376].astype(np.float32)

        def warped(image, frame):
            """As no camera sees it, another way in each image."""
            field = cv2.resize(rng.normal(0, 7, (4, 6, 2)).astype(np.float32), (376, 240), interpolation=cv2.INTER_CUBIC)
            return cv2.remap(image, columns + field[..., 0], rows + field[..., 1], cv2.INTER_LINEAR)
        self.spoil(source, warped)
        causes = self.advised_after(source, "--frames", 60, "--set", "calibration.refine=off")
        self.assertTrue("calibration" in causes or self.summary()["mistakes"], causes)


class Overlay(ReportTest):
    def test_features_are_drawn_into_the_video(self):
        video = self.folder / "seen.mp4"
        self.assertEqual(self.run_on(self.sequence("stereo"), "--overlay", video).returncode, 0)
        frames = cv2.VideoCapture(str(video))
        self.assertAlmostEqual(frames.get(cv2.CAP_PROP_FPS), 20.0, delta=0.1)
        self.assertEqual(int(frames.get(cv2.CAP_PROP_FRAME_COUNT)), len(self.frames()))
        readable, image = frames.read()
        self.assertTrue(readable)
        self.assertEqual(image.shape, (240, 376, 3))
        blue, green, _ = (image[30:, :, i].astype(int) for i in range(3))
        self.assertGreater((green - blue > 60).sum(), 500)  # Images are grey.
        self.assertEqual([path.name for path in self.folder.glob(".seen*")], [])

    def test_browsers_play_it(self):
        """Odd sizes are cut to even ones."""
        source, video = self.image_folder(), self.folder / "seen.mp4"
        for path in source.glob("*.png"):
            cv2.imwrite(str(path), cv2.imread(str(path))[:239, :375])
        camera = self.config((self.folder / "camchain.yaml").read_text().replace("[376, 240]", "[375, 239]"))
        self.run_on(source, "-c", camera, "--frames", 5, "--overlay", video)
        frames = cv2.VideoCapture(str(video))
        self.assertEqual(int(frames.get(cv2.CAP_PROP_FOURCC)).to_bytes(4, "little"), b"avc1")  # H.264 in MP4.
        self.assertEqual(int(frames.get(cv2.CAP_PROP_CODEC_PIXEL_FORMAT)).to_bytes(4, "little"), b"I420")
        self.assertEqual(frames.read()[1].shape, (238, 374, 3))

    def test_names_that_are_none(self):
        for name, word in (("seen.txt", ".mp4"), ("no/such/seen.mp4", "seen.part.mp4")):
            done = self.run_on(self.sequence("mono") if name == "seen.txt" else self.folder / "input_mono",
                               "--overlay", self.folder / name)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(word, done.stderr)


class Folders(ReportTest):
    def setUp(self):
        super().setUp()
        self.assertEqual(self.run_on(self.sequence("stereo"), "--frames", 20, "--quiet").returncode, 0)

    def assert_refused(self, *words, arguments=()):
        before = {path.name for path in self.out.iterdir()}
        done = waymark("report", self.out, *arguments)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.strip().split("\n")), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("error: "), done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)
        self.assertEqual({path.name for path in self.out.iterdir()}, before)

    def test_missing_folders_and_files(self):
        done = waymark("report", self.folder / "gone")
        self.assertEqual(done.returncode, 2)
        self.assertIn("is no folder, expected a folder that waymark run wrote", done.stderr)
        (self.out / "summary.json").unlink()
        self.assert_refused("summary.json")

    def test_damaged_files(self):
        for name in ("summary.json", "frames.csv", "points.ply"):
            whole = (self.out / name).read_bytes()
            truncate(self.out / name)
            self.assert_refused(name)
            (self.out / name).write_bytes(b"\0\xff<script>" + whole)
            self.assert_refused(name)
            (self.out / name).write_bytes(whole)
        self.assertEqual(waymark("report", self.out).returncode, 0)

    def test_hostile_texts(self):
        summary = self.summary()
        evil = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
        for key in ("setup", "timing", "version"):
            summary[key] = evil
        for key in ("input", "settings", "mistakes"):
            summary[key] = [evil]
        summary["stages_ms"] = {evil: {"mean": 1e308, "median": -1, "p95": 0}}
        (self.out / "summary.json").write_text(json.dumps(summary))
        named = self.folder / "<script>alert(3)<script>"
        shutil.copytree(self.out, named)
        for arguments in ((self.out,), (named,), (self.out, named, "-o", self.out / "report.html")):
            self.assertEqual(waymark("report", *arguments).returncode, 0)
            text = self.page(named / "report.html" if arguments == (named,) else None)
            self.assertNotIn("<script>alert", text)
            self.assertNotIn("<img", text)

    def test_a_truth_that_does_not_belong_to_it(self):
        truth = self.folder / "truth.txt"
        truth.write_text("".join(f"{9000 + i} {i} 0 0 0 0 0 1\n" for i in range(9)))
        self.assert_refused("expected", arguments=("--ground-truth", truth))

    def test_runs_compared(self):
        other = self.folder / "other"
        shutil.copytree(self.out, other)
        page = self.folder / "both.html"
        done = waymark("report", self.out, other, "-o", page)
        self.assertEqual((done.returncode, done.stdout.strip()), (0, str(page)), done.stderr)
        self.assertIn("2 runs compared", self.page(page))

    def test_a_page_that_cannot_be_written(self):
        done = waymark("report", self.out, "-o", self.folder / "no" / "such" / "folder.html")
        self.assertEqual(done.returncode, 1, done.stderr)


if __name__ == "__main__":
    unittest.main()
