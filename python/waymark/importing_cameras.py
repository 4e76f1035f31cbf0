# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Cameras as OpenVSLAM and stella_vslam describe them, in maps and settings alike, in our words."""
import math
import os

from waymark import _waymark

MAX_SIZE_PX = 20000
PERSPECTIVE = ("k1", "k2", "p1", "p2", "k3")
FISHEYE = ("k1", "k2", "k3", "k4")
NUMBERS = ("cols", "rows", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "focal_x_baseline", "distortion")


def printable(text):
    """On one line, whatever names and quotations bring along."""
    return _waymark._printable(os.fsencode(text))


def fail(where, what):
    raise _waymark.InputError(printable(f"{where}: {what}"))


def quoted(text):
    return printable(f"'{text[:40]}{'...' if len(text) > 40 else ''}'")


def calibration(cameras, depth_factor=None, notes=()):
    """The Calibration of (camera of a camchain, what messages call it) each; InputError for what no model accepts."""
    chain = {f"cam{i}": camera for i, (camera, _) in enumerate(cameras)}
    if depth_factor is not None:
        chain["depth"] = {"factor": depth_factor}
    return _waymark._calibration(chain, [name for _, name in cameras], list(notes))


def pinhole(numbers, size, lens, coefficients, ideal="radtan"):
    """A camera of a camchain by its focal lengths and centre. ideal: the lens that is none where all coefficients are 0."""
    camera = {"camera_model": "pinhole", "intrinsics": list(numbers), "resolution": list(size), "distortion_model": "none"}
    if lens != ideal or any(coefficients):
        camera.update(distortion_model=lens, distortion_coeffs=list(coefficients))
    return camera


def to_the_right(camera, distance_m):
    """The same camera further to the right, as camera 1 of a pair."""
    return {**camera, "T_cn_cnm1": [[1.0, 0.0, 0.0, -distance_m], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]}


def normalized(name):
    """Models and set-ups are written "RadialDivision", "radial_division" and the like."""
    return "".join(c for c in name.lower() if c.isascii() and c.isalnum())


class Camera:
    """where begins messages; model, setup: as written; numbers: as far as they are there, by key."""

    def __init__(self, where, model, setup, numbers):
        self.where, self.model, self.numbers = where, model, numbers
        self.setup = normalized(setup)
        if self.setup not in ("monocular", "stereo", "rgbd"):
            fail(where, f"set-up {quoted(setup)}, expected monocular, stereo or RGBD")

    def require(self, key):
        if key not in self.numbers:
            fail(self.where, f"has no {key}, which is needed")
        return self.numbers[key]

    def _size(self, key):
        size = self.require(key)
        if not 1 <= size <= MAX_SIZE_PX or size != math.floor(size):
            fail(self.where, f"{key} is {size:g}, expected a whole number from 1 to {MAX_SIZE_PX}")
        return int(size)

    def _in_our_words(self):
        size = [self._size(key) for key in ("cols", "rows")]
        model = normalized(self.model)
        if model == "equirectangular":
            return {"camera_model": "equirectangular", "resolution": size}
        numbers = [self.require(key) for key in ("fx", "fy", "cx", "cy")]
        if model in ("perspective", "fisheye"):
            lens, keys = ("radtan", PERSPECTIVE) if model == "perspective" else ("equidistant", FISHEYE)
            return pinhole(numbers, size, lens, [self.numbers.get(key, 0.0) for key in keys])
        if model == "radialdivision":
            return {**pinhole(numbers, size, "none", []), "camera_model": "division",
                    "distortion_coeffs": [self.require("distortion")]}
        return fail(self.where, f"model {quoted(self.model)}, expected perspective, fisheye, equirectangular or radial_division")

    def cameras(self):
        """As calibration() takes them. Of a stereo pair, which is rectified, camera 1 is the same further to the right."""
        camera = self._in_our_words()
        if self.setup != "stereo":
            return [(camera, self.where)]
        focal_length = self.require("fx")
        baseline = self.require("focal_x_baseline") / focal_length if focal_length else math.inf
        if not 0 < baseline < math.inf:
            fail(self.where, f"focal_x_baseline / fx is {baseline:g}, expected the distance of the cameras of a stereo pair, "
                 "more than 0")
        return [(camera, self.where), (to_the_right(camera, baseline), self.where)]
