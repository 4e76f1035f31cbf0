# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Calibrations that are told wrong by a known amount: whether a run finds the right ones, and whether
the standard deviations that it states for them are honest."""
import re

from .program import PROGRAM, map_sequence, run
from .projection import pixels_apart
from .simulated import simulate
from .tables import table

WAY = ("room", "--motion", "inspect", "--frames", 400)
CAMERAS = ("perspective", "fisheye", "omni", "eucm", "ds", "division")
DISTORTED = ("perspective", "fisheye", "division")
# Set-up, and what `waymark simulate --told` takes.
ERRORS = (("mono", "focal=1.05"), ("mono", "focal=0.95"), ("stereo", "focal=1.05"), ("stereo", "turn_y=2"),
          ("rgbd", "focal=1.05"), ("mono", "distortion=0"))
HELD = 1e-3
TURNS = ("cam1.turn_x", "cam1.turn_y", "cam1.turn_z")


def focal_length(camchain):
    return float(re.search(r"intrinsics: \[(.*)\]", camchain)[1].split(",")[-4])


def rotation(camchain):
    rows = camchain.split("T_cn_cnm1:")[1].split("[")[1:4]
    return [[float(number) for number in row.split("]")[0].split(",")[:3]] for row in rows]


def turn_mrad(camchain, true_camchain):
    """Small rotation vector from the true camera 1 to the one that a camchain describes."""
    found, true = rotation(camchain), rotation(true_camchain)
    product = [[sum(a * b for a, b in zip(row, other)) for other in true] for row in found]
    return [500.0 * (product[k][j] - product[j][k]) for j, k in ((1, 2), (2, 0), (0, 1))]


def ate_m(folder, out, setup):
    align = "sim3" if setup == "mono" else "se3"
    return float(run([PROGRAM, "eval", out / "trajectory.txt", folder / "groundtruth.txt", "--align", align,
                      "--json"]).split('"ate_rmse_m":')[1].split(",")[0])


def row_of(work, camera, setup, told, exact_m):
    """Figures of one run, and the errors of what it found in standard deviations of its own."""
    folder, out = work / f"{camera}_{setup}", work / "out"
    wrong = simulate(work / f"{camera}_{setup}_{told}", *WAY[:3], "--frames", 1, "--camera", camera,
                     "--setup", setup, "--told", told)
    found = map_sequence(folder, out, setup, "-c", wrong / "camchain.yaml")
    true_camchain = (folder / "camchain.yaml").read_text()
    is_refined = (out / "calibration.yaml").exists()
    camchain = (out / "calibration.yaml" if is_refined else wrong / "camchain.yaml").read_text()
    off_px = focal_length(camchain) - focal_length(true_camchain)
    turns = turn_mrad(camchain, true_camchain) if setup == "stereo" else []
    off = {"cam0.fu": off_px, **{name: 1e-3 * turn for name, turn in zip(TURNS, turns)}}
    # What is held has not moved, and the standard deviation that was stated for it.
    normalised = [off[each["name"]] / each["sigma"] for each in found.summary.get("refined_calibration", [])
                  if each["name"] in off and abs(each["change"]) > HELD * each["sigma"]]
    size = sum(turn**2 for turn in turns)**0.5
    return [camera, setup, told, f"{100 * off_px / focal_length(true_camchain):.2f} %",
            f"{pixels_apart(true_camchain, camchain):.2f}", f"{size:.3f}" if turns else "",
            ", ".join(f"{each:.1f}" for each in normalised) or "held",
            f"{ate_m(folder, out, setup) / exact_m:.2f}"], normalised


def exact_ate_m(work, camera, setup):
    folder = simulate(work / f"{camera}_{setup}", *WAY, "--camera", camera, "--setup", setup)
    map_sequence(folder, work / "out", setup)
    return ate_m(folder, work / "out", setup)


def calibration_table(work, only=None):
    rows, errors = [], []
    for camera in CAMERAS:
        if only and camera not in only:
            continue
        exact_m = {setup: exact_ate_m(work, camera, setup) for setup in ("mono", "stereo", "rgbd")}
        for setup, told in ERRORS:
            if told.startswith("distortion") and camera not in DISTORTED:
                continue
            try:
                row, normalised = row_of(work, camera, setup, told, exact_m[setup])
            except RuntimeError as error:
                row, normalised = [camera, setup, told, str(error), "", "", "", ""], []
            rows.append(row)
            errors += normalised
    mean_square = sum(each**2 for each in errors) / max(1, len(errors))
    return ("Calibrations told wrong, after a run:\n\n" +
            table(["camera", "set-up", "told", "focal length off by", "projection off by, px", "turn off by, mrad",
                   "errors in stated standard deviations", "ATE / ATE with the true one"], rows) +
            f"\n\nRoot mean square of the errors in stated standard deviations: {mean_square**0.5:.2f}")
