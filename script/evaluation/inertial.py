# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Simulated motions with an IMU, described rightly and wrongly: whether one camera finds metres, and how sure it is."""
import math

from .program import PROGRAM, map_sequence, run
from .simulated import simulate
from .tables import table

MOTIONS = (("room", "loop", 300, "mems"), ("room", "turns_400", 200, "mems"), ("street", "drive", 300, "mems"),
           ("hall", "flight", 300, "phone"))
NOISE = ("gyroscope_noise_density", "gyroscope_random_walk", "accelerometer_noise_density", "accelerometer_random_walk")
TOLD = ("", "imu_turn=5", "imu_turn=90", "imu_lever=10", "imu_shift=20", "noise=10", "noise=0.1", "imu=none",
        "imu_turn=5,imu_lever=10,imu_shift=20,noise=0.1")


def evaluated(folder, out, align):
    text = run([PROGRAM, "eval", out / "trajectory.txt", folder / "groundtruth.txt", "--align", align, "--json"])
    return [float(text.split(f'"{key}":')[1].split(",")[0]) for key in ("ate_rmse_m", "scale")]


def description(folder, factor):
    """The files that tell of the IMU, its noise multiplied."""
    files = [folder / name for name in ("camchain.yaml", "imu.yaml") if (folder / name).exists()]
    if factor != 1.0 and len(files) == 2:
        lines = []
        for line in files[1].read_text().splitlines():
            key, _, value = line.partition(": ")
            lines.append(f"{key}: {factor * float(value)}" if key in NOISE else line)
        files[1] = folder / "imu_told.yaml"
        files[1].write_text("\n".join(lines) + "\n")
    return [word for file in files for word in ("-c", file)]


def row_of(work, motion, told):
    world, name, num_frames, imu = motion
    way = (world, "--motion", name, "--setup", "mono", "--camera", "perspective", "--imu", imu)
    folder, out = simulate(work / name, *way, "--frames", num_frames), work / "out"
    words = told.split(",") if told else []
    factor = next((float(word[6:]) for word in words if word.startswith("noise=")), 1.0)
    off = ",".join(word for word in words if not word.startswith("noise="))
    wrong = simulate(work / f"{name}_{off}", *way, "--frames", 1, "--told", off) if off else folder
    found = map_sequence(folder, out, "mono", *description(wrong, factor)).summary["imu"]
    ate_m, _ = evaluated(folder, out, "se3")
    sim3_m, scale = evaluated(folder, out, "sim3")
    row = [f"{world}, {name}, {imu}", told or "as it is", f"{ate_m:.4f}", f"{sim3_m:.4f}"]
    if not found["used"]:
        return row + [found["reason"], "", "", ""], []
    shift, rotation = found["time_shift_ms"], found["rotation_deg"]
    turn_deg = math.sqrt(sum(each**2 for each in rotation["value"]))
    row += [f"{100 * abs(scale - 1):.2f} % ({100 * found['scale_sigma']:.2f})",
            f"{shift['value']:.2f} ({shift['sigma']:.2f})", f"{turn_deg:.3f} ({rotation['sigma']:.3f})",
            str(found["metric_from_frame"])]
    return row, [(scale - 1) / found["scale_sigma"], shift["value"] / shift["sigma"]]


def inertial_table(work):
    rows, errors = [], []
    for motion in MOTIONS:
        for told in TOLD:
            try:
                row, normalised = row_of(work, motion, told)
            except RuntimeError as error:
                row, normalised = [", ".join(map(str, motion)), told, str(error), "", "", "", "", ""], []
            rows.append(row)
            errors += normalised
    size = math.sqrt(sum(each**2 for each in errors) / max(1, len(errors)))
    return ("One camera and an IMU, in brackets the standard deviations stated:\n\n" +
            table(["world, motion, IMU", "told", "ATE m, SE(3)", "Sim(3)", "scale off by", "clock off by, ms",
                   "turned by, degrees", "metres from frame"], rows) +
            f"\n\nRoot mean square of errors of scale and clock in stated standard deviations: {size:.2f}")
