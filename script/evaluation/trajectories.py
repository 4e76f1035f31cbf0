# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Trajectories in TUM format, and how far they are from the truth. A trajectory maps time stamps
(ns) to poses, in order."""
import bisect
import math
from typing import NamedTuple

from .rotations import (add, angle_deg, best_rotation, dot, mean, norm, product, rotation_of, scaled,
                        subtract, transposed, turned)

MAX_DIFFERENCE_NS = 20_000_000  # Between a pose and its true one, as `waymark eval` has it.


class Pose(NamedTuple):
    """World from camera."""
    rotation: tuple
    position: tuple

    def looks(self):
        """The direction of the optical axis."""
        return tuple(row[2] for row in self.rotation)


class Similarity(NamedTuple):
    """From the frame of an estimate into that of the truth."""
    scale: float
    rotation: tuple
    translation: tuple

    def of_pose(self, pose):
        position = add(scaled(self.scale, turned(self.rotation, pose.position)), self.translation)
        return Pose(product(self.rotation, pose.rotation), position)


def nanoseconds(text):
    """Of seconds in decimal notation, without the rounding of a float."""
    seconds, _, fraction = text.partition(".")
    return int(seconds) * 10**9 + int(fraction.ljust(9, "0")[:9])


def read_trajectory(path):
    lines = (line.split() for line in path.read_text().split("\n"))
    rows = [w for w in lines if w and not w[0].startswith("#")]
    found = {}
    for stamp, *words in sorted(rows, key=lambda w: nanoseconds(w[0])):
        values = [float(w) for w in words]
        found[nanoseconds(stamp)] = Pose(rotation_of(*values[3:7]), tuple(values[:3]))
    return found


def read_trajectories(folder):
    """What a run wrote: one trajectory per sub-map, the largest first."""
    found = [read_trajectory(folder / "trajectory.txt")]
    while (folder / f"trajectory_{len(found)}.txt").exists():
        found.append(read_trajectory(folder / f"trajectory_{len(found)}.txt"))
    return [t for t in found if t]


class Truth:
    """A true trajectory, asked at any time."""

    def __init__(self, path):
        self._poses = read_trajectory(path)
        self._stamps = list(self._poses)

    def poses(self):
        return self._poses.values()

    def at(self, stamp):
        """The nearest pose, or None where none is near."""
        i = bisect.bisect_left(self._stamps, stamp)
        near = self._stamps[max(0, i - 1):i + 1]
        best = min(near, key=lambda s: abs(s - stamp))
        return self._poses[best] if abs(best - stamp) <= MAX_DIFFERENCE_NS else None

    def pairs_with(self, trajectory):
        """The poses of a trajectory whose true ones are known, each with that one."""
        found = ((pose, self.at(stamp)) for stamp, pose in trajectory.items())
        return [(estimated, true) for estimated, true in found if true is not None]


def align(pairs, with_scale):
    """The similarity that moves estimated positions best onto the true ones (Horn 1987, Umeyama 1991);
    pairs of poses (estimated, true)."""
    estimated, true = ([pose.position for pose in poses] for poses in zip(*pairs))
    middle, true_middle = mean(estimated), mean(true)
    estimated = [subtract(p, middle) for p in estimated]
    true = [subtract(p, true_middle) for p in true]
    rotation = best_rotation(estimated, true)
    scale = 1.0
    spread = sum(dot(p, p) for p in estimated)
    if with_scale and spread > 0.0:
        scale = sum(dot(t, turned(rotation, e)) for e, t in zip(estimated, true)) / spread
    moved = scaled(scale, turned(rotation, middle))
    return Similarity(scale, rotation, subtract(true_middle, moved))


def errors(pairs, similarity):
    """Metres and degrees between each aligned pose and its true one."""
    found = []
    for estimated, true in pairs:
        moved = similarity.of_pose(estimated)
        turn = product(transposed(moved.rotation), true.rotation)
        found.append((norm(subtract(moved.position, true.position)), angle_deg(turn)))
    return found


def ate(pairs, with_scale):
    """Root mean square of the distances after aligning these pairs on their own."""
    distances = [d for d, _ in errors(pairs, align(pairs, with_scale))]
    return math.sqrt(sum(d * d for d in distances) / len(distances))


def motion(first, last):
    """The last pose as the first one sees it."""
    back = transposed(first.rotation)
    return Pose(product(back, last.rotation),
                turned(back, subtract(last.position, first.position)))


def end_to_end_error(pairs, with_scale):
    """Metres and degrees by which the estimated motion from the first pose to the last differs from
    the true one; where the scale is free it is that of the whole trajectory."""
    scale = align(pairs, with_scale).scale
    (first, true_first), (last, true_last) = pairs[0], pairs[-1]
    estimated, true = motion(first, last), motion(true_first, true_last)
    turn = product(transposed(true.rotation), estimated.rotation)
    return norm(subtract(scaled(scale, estimated.position), true.position)), angle_deg(turn)
