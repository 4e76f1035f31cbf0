# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Pieces of recordings, mapped with the calibration as it was given and as the images mend it: whether that is ever
worse, and whether pieces agree on it within the standard deviations that are stated."""
import itertools
import math
import re

from .calibrations import ate_m
from .program import map_sequence, setups_of
from .tables import table

LENGTHS = (50, 100, 200)
# Errors of bearings take each other's place; of the rest each number has a meaning of its own.
COMPARED = re.compile(r"cam\d\.(fu|k1|turn_[xyz])|readout_ms|depth\.inverse_offset")


def cuts_of(num_frames):
    """First frame and number of frames: the first, middle and last of each length that is clearly shorter."""
    cuts = []
    for length in LENGTHS:
        if length <= 0.9 * num_frames:
            cuts += [(first, length) for first in (0, (num_frames - length) // 2, num_frames - length)]
    return cuts or [(0, num_frames)]


def num_frames_of(folder):
    for name in ("mav0/cam0/data.csv", "times.txt", "rgb.txt"):
        if (folder / name).exists():
            return sum(line[:1] not in ("#", "") for line in (folder / name).read_text().splitlines())
    raise RuntimeError(f"{folder}: of no layout that can be cut")


def figures_of(folder, out, setup, cut, refine):
    """ATE, None without a pose, and what was told of the calibration."""
    try:
        run = map_sequence(folder, out, setup, "--first", cut[0], "--frames", cut[1],
                           "--set", f"calibration.refine={refine}")
        return ate_m(folder, out, setup), run.summary.get("refined_calibration", [])
    except RuntimeError:
        return None, []


def told(estimates):
    return {each["name"]: (each["given"] + each["change"], each["sigma"]) for each in estimates
            if COMPARED.fullmatch(each["name"])}


def differences(pieces):
    """Of each number that two pieces without a common frame tell, in standard deviations of the difference."""
    found = []
    for (cut, one), (other_cut, other) in itertools.combinations(pieces, 2):
        if cut[0] < other_cut[0] + other_cut[1] and other_cut[0] < cut[0] + cut[1]:
            continue
        found += [(name, (one[name][0] - other[name][0]) / math.hypot(one[name][1], other[name][1]))
                  for name in one.keys() & other.keys()]
    return sorted(found)


def describe(estimates):
    return ", ".join(f"{name} {value:.4g} +- {sigma:.2g}" for name, (value, sigma) in sorted(told(estimates).items()))


def cut_table(data_dir, work, only=None):
    rows, ratios, normalised = [], [], []
    for folder in sorted(path.parent for path in data_dir.glob("*/groundtruth.txt")):
        if only and not any(name in folder.name for name in only):
            continue
        for setup in setups_of(folder):
            pieces = []
            for cut in cuts_of(num_frames_of(folder)):
                auto, estimates = figures_of(folder, work / "auto", setup, cut, "auto")
                off, _ = figures_of(folder, work / "off", setup, cut, "off")
                row = [folder.name, setup, f"{cut[0]} + {cut[1]}", *(f"{each:.4f}" if each else "-" for each in (off, auto))]
                if auto and off:
                    ratios.append(auto / off)
                    row.append(f"{auto / off:.2f}")
                else:
                    row.append("-")
                rows.append(row + [describe(estimates)])
                pieces.append((cut, told(estimates)))
            normalised += differences(pieces)
    size = math.sqrt(sum(each**2 for _, each in normalised) / max(1, len(normalised)))
    worst = max((abs(each), name) for name, each in normalised) if normalised else (0.0, "")
    mean = math.exp(sum(map(math.log, ratios)) / max(1, len(ratios)))
    return ("Pieces of recordings, without and with a calibration that is estimated along:\n\n" +
            table(["sequence", "set-up", "frames", "ATE m, off", "ATE m, auto", "ratio", "told"], rows) +
            f"\n\n{len(ratios)} pieces: ratio at most {max(ratios, default=1.0):.2f}, {mean:.2f} in the (geometric) mean"
            f"\n{len(normalised)} differences between pieces in stated standard deviations: root mean square {size:.2f}, "
            f"at most {worst[0]:.1f} ({worst[1]})")
