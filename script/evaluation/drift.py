# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What a trajectory loses on the way: errors of stretches that are aligned by their first pose only,
as the KITTI benchmark has it (Geiger, Lenz and Urtasun 2012)."""
import bisect
import math
import statistics

from .rotations import angle_deg, norm, product, scaled, subtract, transposed
from .trajectories import Truth, align, motion, read_trajectory

STRETCH_M = 100.0  # Half the way where that is shorter.
MIN_WAY_M = 50.0
FRAMES_BETWEEN = 10  # Of the first frames of stretches.


def ways(poses):
    """Metres from the first pose to each along the path."""
    found = [0.0]
    for before, after in zip(poses, poses[1:]):
        found.append(found[-1] + norm(subtract(after.position, before.position)))
    return found


def drift(pairs, with_scale):
    """Means over stretches of pairs of poses (estimated, true), per 100 m: `translation_m`,
    `rotation_deg`, and `scale_percent`, by which the scale of the second half of a stretch differs
    from that of the first, root mean square. None where the true way is too short. The scale of
    translations is that of the whole trajectory where it is free."""
    estimated, true = ([pose for pose in poses] for poses in zip(*pairs))
    way, own_way = ways(true), ways(estimated)
    if way[-1] < MIN_WAY_M:
        return None
    stretch = min(STRETCH_M, 0.5 * way[-1])
    scale = align(pairs, True).scale if with_scale else 1.0
    moved, turned_by, scales = [], [], []
    for first in range(0, len(pairs), FRAMES_BETWEEN):
        middle = bisect.bisect_left(way, way[first] + 0.5 * stretch)
        last = bisect.bisect_left(way, way[first] + stretch)
        if last == len(pairs):
            break
        own, real = motion(estimated[first], estimated[last]), motion(true[first], true[last])
        moved.append(norm(subtract(scaled(scale, own.position), real.position)))
        turned_by.append(angle_deg(product(transposed(real.rotation), own.rotation)))
        early, late = ((own_way[b] - own_way[a]) / max(way[b] - way[a], 1e-9)
                       for a, b in ((first, middle), (middle, last)))
        if min(early, late) > 0.0:  # Else a gap, or an estimate that stands.
            scales.append(2.0 * math.log(late / early))  # The halves are half a stretch apart.
    per_100_m = 100.0 / stretch
    return {"stretch_m": stretch,
            "translation_m": per_100_m * statistics.mean(moved),
            "rotation_deg": per_100_m * statistics.mean(turned_by),
            "scale_percent": 100.0 * per_100_m * math.sqrt(sum(s * s for s in scales) / max(1, len(scales)))}


def drift_of_run(trajectory, truth, with_scale):
    """The same for files in TUM format."""
    return drift(Truth(truth).pairs_with(read_trajectory(trajectory)), with_scale)
