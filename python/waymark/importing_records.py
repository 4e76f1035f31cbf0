# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What map files of OpenVSLAM and stella_vslam hold, each value checked on its own, and how much of it there may be."""
import dataclasses

import numpy as np

MAX_FEATURES = 100_000  # Of a keyframe.
MAX_ID = 4_000_000_000
NO_ID = 2**32 - 1  # As ids of none come back that were stored unsigned.
MAX_LEVELS = 64
MAX_LENGTH = 1e9  # Metres, and pixels.
MAX_SECONDS = 9.2e9  # Nanoseconds of it fit 64 bits.


@dataclasses.dataclass
class Keyframe:
    where: str  # Begins messages.
    time_s: float
    camera: str
    pyramid: object  # (scale factor, number of levels), or the name of one.
    rotation: list  # Quaternion x y z w of the camera from the world, as written.
    translation: list
    pixels: np.ndarray  # (n, 2), of a camera without distortion; of an equirectangular one its own.
    angles_deg: np.ndarray
    levels: np.ndarray
    right_columns: np.ndarray  # Negative: none. Empty in mono.
    depths_m: np.ndarray  # Along z, as above.
    descriptors: np.ndarray  # (n, 32) bytes.
    landmarks: np.ndarray  # Ids; negative: none.
    parent: int  # Negative: none.
    loop_edges: np.ndarray


@dataclasses.dataclass
class Landmark:
    position: list
    reference: int
    num_visible: int
    num_found: int


class Records:
    """By name and id."""

    def __init__(self):
        self.cameras, self.pyramids, self.keyframes, self.landmarks = {}, {}, {}, {}
