# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A camera that rests while somebody moves a box before it: what it sees of that is no motion of
its own. Drawn into the images of recorded sequences, by which it has moved before, or not at all."""
import itertools
import shutil

import cv2
import numpy as np

from .program import NoPose, map_sequence
from .splice import Sequence
from .tables import table

RATE_HZ = 20
NUM_RESTING = 120
NUM_MOVING = 60
SIZES = (0.3, 0.5, 0.65)  # Of a side of the box, by its distance.
# Corners of the unit cube, as they are seen from outside, clockwise from the top left.
FACES = [[c - 0.5 for c in map(np.array, face)] for face in (
    ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), ((1, 0, 1), (0, 0, 1), (0, 1, 1), (1, 1, 1)),
    ((0, 0, 1), (0, 0, 0), (0, 1, 0), (0, 1, 1)), ((1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0)),
    ((0, 0, 1), (1, 0, 1), (1, 0, 0), (0, 0, 0)), ((0, 1, 0), (1, 1, 0), (1, 1, 1), (0, 1, 1)))]


class Box:
    """With patches of an image on its faces, turned and shifted by hand at a metre's distance."""

    def __init__(self, texture, size_m, seed):
        self.rng = np.random.default_rng(seed)
        self.textures = [self._patch(texture) for _ in FACES]
        self.size_m = size_m * np.array([1.0, *self.rng.uniform([0.6, 0.3], [1.2, 1.0])])
        self.rates_hz, self.phases = self.rng.uniform(0.1, 0.35, 6), self.rng.uniform(0.0, 6.3, 6)
        self.turn_rad, self.shift_m = self.rng.uniform([0.2, 0.1], [0.9, 0.3])

    def _patch(self, texture):
        side = min(300, *texture.shape)
        y, x = (self.rng.integers(0, n - side + 1) for n in texture.shape)
        return cv2.equalizeHist(np.ascontiguousarray(texture[y:y + side, x:x + side]))

    def draw(self, image, focal_px, seconds, has_hand):
        """Into a grey image. Which of its pixels show it."""
        wave = np.sin(2.0 * np.pi * self.rates_hz * seconds + self.phases)
        turn = cv2.Rodrigues(self.turn_rad * wave[:3])[0]
        place = np.array([0.0, 0.0, 1.0]) + self.shift_m * wave[3:] * [1.0, 0.7, 0.6]
        height, width = image.shape
        shown = np.zeros(image.shape, np.uint8)
        for face, texture in zip(FACES, self.textures):
            corners = (self.size_m * face) @ turn.T + place
            if np.cross(corners[1] - corners[0], corners[3] - corners[0]) @ corners[0] <= 0.0:
                continue
            pixels = focal_px * corners[:, :2] / corners[:, 2:] + [width / 2, height / 2]
            far = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]]) * len(texture)
            warp = cv2.getPerspectiveTransform(far, pixels.astype(np.float32))
            on_face = cv2.warpPerspective(np.full_like(texture, 255), warp, (width, height)) > 127
            image[on_face] = cv2.warpPerspective(texture, warp, (width, height))[on_face]
            shown |= on_face
        if has_hand:
            corner = focal_px * place[:2] / place[2] + [width / 2, height / 2]
            unit = focal_px * self.size_m[0] / 2
            elbow = corner + unit * np.array([2.5 + 0.3 * np.sin(3.0 * seconds), 2.5])
            cv2.line(image, corner.astype(int).tolist(), elbow.astype(int).tolist(), 150,
                     max(2, int(unit / 3)))
        return shown > 0


def write_scene(out, images, texture, focal_px, size_m, seed=0, has_hand=False,
                num_resting=NUM_RESTING):
    """A folder of images: those given, then the last one with a box before it, all with noise; with
    its camera. Which part of the image the box hides, in the mean."""
    shutil.rmtree(out, ignore_errors=True)
    (out / "images").mkdir(parents=True)
    box, rng, hidden = Box(texture, size_m, seed), np.random.default_rng(seed), []
    for i in range(len(images) - 1 + num_resting):
        image = images[min(i, len(images) - 1)].copy()
        if i >= len(images) - 1:
            hidden.append(box.draw(image, focal_px, (i - len(images) + 1) / RATE_HZ, has_hand).mean())
        noisy = np.clip(image + rng.normal(0.0, 2.0, image.shape), 0, 255)
        cv2.imwrite(str(out / f"images/{i:05}.png"), noisy.astype(np.uint8))
    height, width = images[0].shape
    (out / "times.txt").write_text(
        "".join(f"{1 + i / RATE_HZ:.3f}\n" for i in range(len(images) - 1 + num_resting)))
    (out / "camchain.yaml").write_text(
        f"cam0:\n  camera_model: pinhole\n  intrinsics: [{focal_px}, {focal_px}, {width / 2}, "
        f"{height / 2}]\n  distortion_model: none\n  resolution: [{width}, {height}]\n")
    return np.mean(hidden)


def motion_at_rest(run, num_moving):
    """Largest distance from the first pose at rest, in units of the map, and how many there are."""
    first_s = 1 + num_moving / RATE_HZ
    resting = [p.position for poses in run.trajectories[:1] for s, p in sorted(poses.items())
               if s * 1e-9 >= first_s - 1e-3]
    distances = [np.linalg.norm(np.subtract(p, resting[0])) for p in resting]
    return max(distances, default=0.0), len(resting)


def box_row(out, name, images, texture, focal_px, size_m, seed):
    num_moving = len(images) - 1
    hidden = write_scene(out / "scene", images, texture, focal_px, size_m, seed, seed % 2 == 0)
    try:
        run = map_sequence(out / "scene", out / "out", "mono", "--set", "calibration.refine=off")
        motion, count = motion_at_rest(run, num_moving)
    except NoPose:
        motion, count = 0.0, 0
    return [name, str(num_moving), f"{hidden:.2f}", f"{count} of {NUM_RESTING}", f"{motion:.3f}"]


def box_table(data_dir, work, only):
    """Sequences of DATA_DIR in mono, by their own focal length where they are perspective."""
    rows = []
    grey = lambda frame: cv2.imread(str(frame[0]), cv2.IMREAD_GRAYSCALE)  # noqa: E731
    sequences = [Sequence(f, "mono") for f in sorted(data_dir.iterdir())
                 if (f / "groundtruth.txt").exists() and not (f / "video.mp4").exists()]
    sequences = [s for s in sequences if not only or any(o in s.name for o in only)]
    textures = [grey(s.files[len(s) // 2]) for s in sequences]
    for number, (sequence, size_m) in enumerate(itertools.product(sequences, SIZES)):
        texture = textures[(number // len(SIZES) + 1) % len(textures)]
        middle = len(sequence) // 2
        for num_moving in (0, NUM_MOVING):
            frames = sequence.files[middle - num_moving:middle + 1]
            images = [grey(f) for f in frames]
            focal_px = 0.8 * images[0].shape[1]
            rows.append(box_row(work, sequence.name, images, texture, focal_px, size_m, number))
    return ("At rest, with a box before the camera (mono): frames that moved before, the part of the "
            "image that the box hides, poses at rest, and how far they go, in units of the map:\n\n" +
            table(["background", "moved", "hidden", "poses", "motion"], rows))
