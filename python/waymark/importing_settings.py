# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Settings of OpenVSLAM, stella_vslam, ORB-SLAM2 and 3 (YAML) as calibrations.

Keys stand in sections or flat (`Camera.fx`). Settings of the algorithms of these programs are named and passed over."""
import math
import re

import numpy as np

from waymark import _waymark
from waymark.importing_cameras import FISHEYE, NUMBERS, PERSPECTIVE, Camera, calibration, fail, normalized, pinhole, printable, to_the_right

OPENVSLAM = {"Camera", "StereoRectifier", "depthmap_factor"}  # Sections that are used.
ORBSLAM = {"Camera", "Camera1", "Camera2", "Stereo", "LEFT", "RIGHT", "RGBD", "File", "DepthMapFactor"}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def describe(content):
    if content is None:
        return "empty"
    if isinstance(content, str):
        return content[:40] + "..." * (len(content) > 40) or "''"
    return f"a list of {len(content)}" if isinstance(content, list) else "a section"


def number_in(text):
    """None where that is no finite number."""
    value = float(text) if isinstance(text, str) and NUMBER.fullmatch(text) else math.nan
    return value if math.isfinite(value) else None


class Settings:
    """The keys of a file, each by its dotted name, whichever way it is written."""

    def __init__(self, name, text):
        self.name = printable(name)
        _, self.root = _waymark._parse_config(self.name, text)

    def find(self, key):
        """(where, content), or None."""
        section, _, rest = key.partition(".")
        _, inside = self.root.get(section, ("", None))
        return inside.get(rest) if rest and isinstance(inside, dict) else self.root.get(key)

    def require(self, key):
        return self.find(key) or fail(self.name, f"has no {key}, which is needed")

    def where(self, key):
        return self.require(key)[0]

    def text(self, key):
        where, content = self.require(key)
        return content if isinstance(content, str) else fail(where, f"{key} is {describe(content)}, expected a text")

    def number(self, key, low=-math.inf, high=math.inf, whole=False):
        where, content = self.require(key)
        value = number_in(content)
        if value is not None and low <= value <= high and not (whole and value != int(value)):
            return int(value) if whole else value
        limits = f" from {low:.15g} to {high:.15g}" if math.isfinite(low) else ""
        return fail(where, f"{key} is {describe(content)}, expected {'an integer' if whole else 'a number'}{limits}")

    def numbers(self, key, count=None):
        """A list, or a matrix of OpenCV's."""
        where, content = self.require(key)
        if isinstance(content, dict):
            where, content = content.get("data") or fail(where, f"{key} has no data, expected rows, cols, dt, data")
        if not isinstance(content, list):
            fail(where, f"{key} is {describe(content)}, expected a list [...] of numbers")
        values = [number_in(text) for _, text in content]
        if None in values:
            at = values.index(None)
            fail(content[at][0], f"{key}[{at}] is {describe(content[at][1])}, expected a number")
        if count is not None and len(values) != count:
            fail(where, f"{key} has {len(values)} numbers, expected {count}")
        return values

    def rigid(self, key, count):
        """The 4x4 matrix of 16 numbers of a motion, or of 9 of a turn."""
        matrix = np.eye(4)
        size = math.isqrt(count)
        matrix[:size, :size] = np.reshape(self.numbers(key, count), (size, size))
        _waymark._rigid(matrix.ravel(), self.where(key), key)  # Refuses what is none.
        return matrix

    def notes(self, used):
        ignored = dict.fromkeys(key.split(".")[0] for key in self.root if key.split(".")[0] not in used)
        return [f"{self.name}: settings of another program's algorithms are ignored: {', '.join(map(printable, ignored))}"] * bool(ignored)

    def depth_factor(self, *keys):
        return next((self.number(key, 1e-3, 1e9) for key in keys if self.find(key)), None)


def undo_rectification(cameras, turns, sides):
    """From the rectified pair back to the cameras that took the images. turns: how each was turned."""
    right = {**sides[1][0], "T_cn_cnm1": (np.linalg.inv(turns[1]) @ cameras[1][0]["T_cn_cnm1"] @ turns[0]).tolist()}
    return [sides[0], (right, sides[1][1])]


# OpenVSLAM and stella_vslam.


def openvslam_side(settings, side, is_fisheye, size):
    key = f"StereoRectifier.K_{side}"
    where = f"{settings.where(key)}: {key}"
    k = settings.numbers(key, 9)
    if [k[1], k[3], *k[6:]] != [0, 0, 0, 0, 1]:
        fail(where, "is no [fx 0 cx; 0 fy cy; 0 0 1], expected one without skew")
    lens = "equidistant" if is_fisheye else "radtan"
    return pinhole((k[0], k[4], k[2], k[5]), size, lens, settings.numbers(f"StereoRectifier.D_{side}"), ideal=None), where


def read_openvslam(settings):
    model = settings.text("Camera.model")
    numbers = {key: settings.number(f"Camera.{key}") for key in NUMBERS if settings.find(f"Camera.{key}")}
    cameras = Camera(f"{settings.where('Camera.model')}: Camera", model, settings.text("Camera.setup"), numbers).cameras()
    if len(cameras) == 2 and settings.find("StereoRectifier.K_left"):
        key = "StereoRectifier.model"
        kind = normalized(settings.text(key)) if settings.find(key) else "perspective"
        if kind not in ("perspective", "fisheye"):
            fail(settings.where(key), f"{key} is {describe(settings.text(key))}, expected perspective or fisheye")
        turns = [settings.rigid(f"StereoRectifier.R_{side}", 9) for side in ("left", "right")]
        size = cameras[0][0]["resolution"]
        cameras = undo_rectification(cameras, turns, [openvslam_side(settings, side, kind == "fisheye", size)
                                                      for side in ("left", "right")])
    factor = settings.depth_factor("Preprocessing.depthmap_factor", "depthmap_factor")
    return calibration(cameras, factor, settings.notes(OPENVSLAM))


def pyramid(settings):
    """(scale factor, number of levels) that settings of these programs state, else those of their defaults."""
    scale, levels = "Feature.scale_factor", "Feature.num_levels"
    return (settings.number(scale, 1.01, 10) if settings.find(scale) else 1.2,
            settings.number(levels, 1, 64, whole=True) if settings.find(levels) else 8)


# ORB-SLAM, by its calibration tutorial of 2021, and with the flat keys of its predecessors.


def orbslam_camera(settings, prefix, kind):
    where = settings.where(f"{prefix}.fx")
    size = [settings.number(f"Camera.{key}", 1, 1e6, whole=True) for key in ("width", "height")]
    numbers = [settings.number(f"{prefix}.{key}") for key in ("fx", "fy", "cx", "cy")]
    lens, keys = {"Rectified": ("radtan", ()), "KannalaBrandt8": ("equidistant", FISHEYE)}.get(kind, ("radtan", PERSPECTIVE))
    return pinhole(numbers, size, lens, [settings.number(f"{prefix}.{key}") if settings.find(f"{prefix}.{key}") else 0.0
                                         for key in keys]), where


def rectified(camera, baseline_m, where):
    if not baseline_m > 0:
        fail(where, f"gives a baseline of {baseline_m:g} m, expected more than 0")
    return [camera, (to_the_right(camera[0], baseline_m), camera[1])]


def newer_orbslam(settings):
    kind = settings.text("Camera.type")
    if kind not in ("PinHole", "KannalaBrandt8", "Rectified"):
        fail(settings.where("Camera.type"), f"Camera.type is {describe(kind)}, expected PinHole, KannalaBrandt8 or Rectified")
    camera = orbslam_camera(settings, "Camera1", kind)
    if settings.find("Stereo.T_c1_c2") and settings.find("Camera2.fx"):
        pose = np.linalg.inv(settings.rigid("Stereo.T_c1_c2", 16)).tolist()
        other, where = orbslam_camera(settings, "Camera2", kind)
        return [camera, ({**other, "T_cn_cnm1": pose}, where)]
    if kind == "Rectified" and not settings.find("RGBD.DepthMapFactor"):
        return rectified(camera, settings.number("Stereo.b"), settings.where("Stereo.b"))
    return [camera]


def older_orbslam(settings):
    camera = orbslam_camera(settings, "Camera", settings.text("Camera.type") if settings.find("Camera.type") else "PinHole")
    if settings.find("DepthMapFactor") or not settings.find("Camera.bf"):
        return [camera]
    focal_length = settings.number("Camera.fx")
    baseline = settings.number("Camera.bf") / focal_length if focal_length else math.nan
    cameras = rectified(camera, baseline, settings.where("Camera.bf"))
    if not settings.find("LEFT.K"):
        return cameras
    sides = []
    for side in ("LEFT", "RIGHT"):
        size = [settings.number(f"{side}.{key}", 1, 1e6, whole=True) for key in ("width", "height")]
        k = settings.numbers(f"{side}.K", 9)
        sides.append((pinhole((k[0], k[4], k[2], k[5]), size, "radtan", settings.numbers(f"{side}.D", 5), ideal=None),
                      settings.where(f"{side}.K")))
    return undo_rectification(cameras, [settings.rigid(f"{side}.R", 9) for side in ("LEFT", "RIGHT")], sides)


def read_orbslam(settings):
    cameras = newer_orbslam(settings) if settings.find("Camera1.fx") else older_orbslam(settings)
    factor = settings.depth_factor("DepthMapFactor", "RGBD.DepthMapFactor")
    return calibration(cameras, factor, settings.notes(ORBSLAM))


def read(name, text):
    """The Calibration of a settings file, bytes, of whichever of the programs. InputError for what is malformed."""
    settings = Settings(name, text)
    sections = {key.split(".")[0] for key in settings.root if "." in key}
    is_orbslam = "Camera1" in sections or ("Camera" in sections and not settings.find("Camera.model"))
    return read_orbslam(settings) if is_orbslam else read_openvslam(settings)
