#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Markers that were moved or that are there twice are named and left out; one marker joins two recordings."""
import json
import shutil
import unittest

import cv2
import numpy as np

from cli_support import CliTest, waymark
from markers_test import MAX_SCALE_ERROR, NUM_MARKERS, SIDE_M, flat, markers_of, read_trajectory, rotation

MARKED = ("--set", "markers.family=tag36h11", "--set", f"markers.size={SIDE_M}")
SIDE_PX = 80
CAMERA = np.array([[420.0, 0, 317], [0, 421, 242], [0, 0, 1]])
DISTORTION = np.array([-0.2, 0.05, 0.0002, -0.0001])
SIZE = (640, 480)
# Pixels of a square that is not partly out of the image or seen from the side.
MIN_AREA_PX = 80


class Painter:
    """Gives markers in simulated images other numbers."""

    def __init__(self, folder):
        self.images = sorted((folder / "mav0/cam0/data").glob("*.png"), key=lambda path: int(path.stem))
        truth = read_trajectory(folder / "groundtruth.txt")
        self.poses = [truth[round(int(path.stem) / 1e9, 3)] for path in self.images]
        self.markers = markers_of(folder)
        self.prints = {number: self._print_of(number) for number in self.markers}

    def _corners(self, frame, number):
        """Of the square in the image; nothing where it is not in view from the front."""
        turn, position = self.markers[number]
        half = SIDE_M / 2
        square = position + np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]]) @ turn.T
        pose = self.poses[frame]
        if turn[:, 2] @ (pose[:3] - position) < 0.1:
            return None
        local = (square - pose[:3]) @ rotation(pose[3:])
        if local[:, 2].min() < 0.3:
            return None
        corners = cv2.projectPoints(local, np.zeros(3), np.zeros(3), CAMERA, DISTORTION)[0].reshape(4, 2)
        inside = (corners > 1).all() and (corners < np.array(SIZE) - 2).all()
        return corners if inside and cv2.contourArea(corners.astype(np.float32)) > MIN_AREA_PX else None

    def _print_of(self, number):
        """The marker as the largest of its images has it, from the front."""
        seen = [(cv2.contourArea(corners.astype(np.float32)), i) for i in range(len(self.images))
                if (corners := self._corners(i, number)) is not None]
        frame = max(seen)[1]
        square = np.array([[0, 0], [SIDE_PX, 0], [SIDE_PX, SIDE_PX], [0, SIDE_PX]], np.float32)
        turn = cv2.getPerspectiveTransform(self._corners(frame, number).astype(np.float32), square)
        return cv2.warpPerspective(cv2.imread(str(self.images[frame]), cv2.IMREAD_GRAYSCALE), turn, (SIDE_PX, SIDE_PX))

    def paint(self, frame, numbers):
        """Gives each marker of the keys the number that is its value."""
        path = str(self.images[frame])
        image = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
        square = np.array([[0, 0], [SIDE_PX, 0], [SIDE_PX, SIDE_PX], [0, SIDE_PX]], np.float32)
        for place, number in numbers.items():
            corners = self._corners(frame, place)
            if corners is None:
                continue
            turn = cv2.getPerspectiveTransform(square, corners.astype(np.float32))
            printed = cv2.warpPerspective(self.prints[number], turn, SIZE, flags=cv2.INTER_AREA)
            inside = cv2.warpPerspective(np.full((SIDE_PX, SIDE_PX), 255, np.uint8), turn, SIZE) > 127
            image[inside] = printed[inside]
        cv2.imwrite(path, image)


class MarkerFaults(CliTest):
    def test_markers_that_were_carried_elsewhere_or_are_there_twice_are_left_out(self):
        copy = self.folder / "painted"
        shutil.copytree(flat(), copy)
        painter = Painter(copy)
        for frame in range(len(painter.images)):
            # Place 4 is in view after place 1, place 5 together with place 3.
            painter.paint(frame, {4: 1, 5: 3})
        done = self.run_on(copy, "-c", copy / "camchain.yaml", "--setup", "mono", *MARKED)
        self.assertEqual(done.returncode, 0, done.stderr)
        verdicts = {marker["id"]: marker["verdict"] for marker in self.summary()["markers"]["markers"]}
        self.assertEqual(verdicts, {0: "used", 1: "moved", 2: "used", 3: "twice"})
        self.assertRegex(done.stderr, r"marker 1: was moved, it is elsewhere from \d+\.\d+ s on")
        self.assertRegex(done.stderr, "marker 3: is there twice")
        judged = waymark("eval", self.out / "trajectory.txt", flat() / "groundtruth.txt", "--align", "sim3", "--json")
        self.assertLess(abs(json.loads(judged.stdout)["scale"] - 1.0), MAX_SCALE_ERROR)


class MarkerJoins(CliTest):
    def keyframes_of(self, saved):
        """Time and position, a row per keyframe."""
        poses = self.folder / "poses.txt"
        done = waymark("export", saved, "--format", "tum", "-o", poses)
        self.assertEqual(done.returncode, 0, done.stderr)
        return np.loadtxt(poses)[:, :4]

    def map_of(self, world):
        """A map in metres, in the frame of marker 0."""
        source, saved = self.folder / world, self.folder / f"{world}.wmap"
        done = waymark("simulate", world, "--setup", "mono", "--frames", 150, "--rate", 12.5, "--markers", 1, "-o", source)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = waymark("run", source, "-c", source / "camchain.yaml", "--setup", "mono", *MARKED, "--map-out", saved,
                       "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        return saved, self.keyframes_of(saved)

    def test_maps_that_share_nothing_but_a_marker(self):
        """Of two worlds, as if marker 0 had been carried from one to the other: its frame is that of both."""
        first, second, merged = self.map_of("apartment"), self.map_of("hall"), self.folder / "merged.wmap"
        done = waymark("map", "merge", first[0], second[0], "-o", merged)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("joined: 2 sub-maps are 1 now", done.stdout)
        together = self.keyframes_of(merged)
        self.assertEqual(len(together), len(first[1]) + len(second[1]))
        for keyframes in (first[1], second[1]):
            apart = np.abs(keyframes[:, None] - together[None]).max(axis=2).min(axis=1)
            print(apart.max())
            self.assertLess(apart.max(), 0.02)


if __name__ == "__main__":
    unittest.main()
