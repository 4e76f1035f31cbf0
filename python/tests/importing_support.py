# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A small map of stella_vslam as its documents have it, to be packed, damaged and imported."""
import copy
import math
import pathlib
import random
import sys

import numpy as np
import waymark
from support import Test

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests"))
from exchange_formats import make_database, pack  # noqa: E402

PERSPECTIVE = {"model_type": "Perspective", "setup_type": "Monocular", "color_order": "Gray", "cols": 640, "rows": 480, "fps": 30.0,
               "focal_x_baseline": 0.0, "fx": 400.0, "fy": 405.0, "cx": 318.0, "cy": 241.0, "k1": -0.2, "k2": 0.03, "p1": 1e-4,
               "p2": -2e-4, "k3": 0.0}


def camera(**changes):
    return {**PERSPECTIVE, **changes}


def pose(number):
    """cam_from_world: quaternion x y z w, and translation, of a camera that moves to the right and turns."""
    angle, centre = 0.03 * number, np.array([0.2 * number, 0, 0.05 * number])
    turn = np.array([[math.cos(angle), 0, -math.sin(angle)], [0, 1, 0], [math.sin(angle), 0, math.cos(angle)]])
    return [0.0, -math.sin(angle / 2), 0.0, math.cos(angle / 2)], (-turn @ centre).tolist(), turn


def undistorted_pixel(model, point):
    """Key points lie where a camera without distortion shows the points; of an equirectangular camera where it shows them itself."""
    x, y, z = point
    if model["model_type"] != "Equirectangular":
        return [model["fx"] * x / z + model["cx"], model["fy"] * y / z + model["cy"]]
    return [(math.atan2(x, z) / (2 * math.pi) + 0.5) * model["cols"] - 0.5,
            (math.asin(y / math.hypot(x, y, z)) / math.pi + 0.5) * model["rows"] - 0.5]


class SmallMap:
    """Points 4 to 8 m ahead of three keyframes, each with all points it sees and one key point more that shows none. The parent
    of each is the one before; keyframes 0 and 2 close a loop."""

    def __init__(self, model=PERSPECTIVE):
        rng = random.Random(3)
        self.points = [[rng.uniform(-2, 2), rng.uniform(-1, 1), rng.uniform(4, 8)] for _ in range(30)]
        self.document = {"cameras": {"cam": copy.deepcopy(model)},
                         "orb_params": {"orb": {"name": "orb", "scale_factor": 1.2, "num_levels": 8}},
                         "keyframes": {str(number): self._keyframe(number, model, rng) for number in range(3)},
                         "landmarks": {str(i): {"1st_keyfrm": 0, "ref_keyfrm": 1, "pos_w": point, "n_vis": 9, "n_fnd": 5}
                                       for i, point in enumerate(self.points)},
                         "keyframe_next_id": 3, "landmark_next_id": 30}

    def seen(self, number):
        """The points in the camera of a keyframe."""
        _, translation, turn = pose(number)
        return [turn @ point + translation for point in self.points]

    def _keyframe(self, number, model, rng):
        seen = [*self.seen(number), (0, 0, 6)]
        rotation, translation, _ = pose(number)
        return {"ts": 100.5 + number, "cam": "cam", "orb_params": "orb", "rot_cw": rotation, "trans_cw": translation,
                "n_keypts": 31,
                "undist_keypts": [{"pt": undistorted_pixel(model, point), "ang": 270.0, "oct": i % 8} for i, point in enumerate(seen)],
                "x_rights": [], "depths": [], "descs": [[rng.randrange(1 << 32) for _ in range(8)] for _ in seen],
                "lm_ids": [*range(30), -1], "span_parent": number - 1 if number else 2**32 - 1, "span_children": [],
                "loop_edges": [] if number == 1 else [2 - number]}

    def keyframe(self, number):
        return self.document["keyframes"][str(number)]

    def camera(self):
        return self.document["cameras"]["cam"]


class ImportTest(Test):
    def setUp(self):
        super().setUp()
        self.msg, self.db = self.folder / "map.msg", self.folder / "map.db"

    def load(self, small):
        self.msg.write_bytes(pack(small.document))
        return waymark.import_map(self.msg)

    def load_database(self, small):
        make_database(self.db, small.document)
        return waymark.import_map(self.db)

    def assert_no_residuals(self, loaded):
        """Each landmark shows where it is by every feature that sees it, as a bearing and as a pixel."""
        positions = dict(zip(loaded.landmarks().ids.tolist(), loaded.landmarks().positions_in_world))
        for number in loaded.keyframes().ids.tolist():
            keyframe = loaded.keyframe(number)
            features, rig_from_world = keyframe.features, np.linalg.inv(keyframe.world_from_rig)
            for i in np.flatnonzero(features.landmarks != waymark.NO_ID).tolist():
                of_rig = keyframe.cameras[features.cameras[i]]
                point = (of_rig.cam_from_rig @ rig_from_world @ [*positions[features.landmarks[i]], 1])[:3]
                pixels, is_visible = of_rig.project([point])
                self.assertTrue(is_visible[0])
                self.assertLess(np.linalg.norm(pixels[0] - features.pixels[i]), 1e-2)
                self.assertLess(np.linalg.norm(point / np.linalg.norm(point) - features.bearings[i]), 1e-5)
