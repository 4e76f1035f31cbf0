# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A camera that stands still for an hour: memory and time must not follow the clock. That noise
changes nothing of that is for the tests (system/at_rest_test.cc): here the images are the same."""
import shutil

from .program import map_sequence
from .simulated import simulate
from .tables import table

SETUPS = ("mono", "stereo", "rgbd")
NUM_MOVING = 40
RATE_HZ = 30
NUM_FRAMES = (1000, 10000, 3600 * RATE_HZ)
LISTS = ("mav0/cam0/data.csv", "mav0/cam1/data.csv", "rgb.txt", "depth.txt")


def read_list(path):
    """Its separator, header and names."""
    lines = path.read_text().splitlines()
    separator = "," if path.suffix == ".csv" else " "
    return separator, lines[0], [line.split(separator)[1] for line in lines[1:]]


def resting_sequence(work, setup):
    """Some frames of motion, so that there is a map; from then on the last one for ever."""
    moving = simulate(work / f"{setup}_moving", "room", "--motion", "slide", "--setup", setup,
                      "--frames", NUM_MOVING)
    folder = work / setup
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(moving, folder)
    for name in LISTS:
        if not (folder / name).exists():
            continue
        separator, header, names = read_list(folder / name)
        names += names[-1:] * NUM_FRAMES[-1]
        times_ns = [10**9 + i * 10**9 // RATE_HZ for i in range(len(names))]
        times = times_ns if name.endswith(".csv") else [f"{t * 1e-9:.9f}" for t in times_ns]
        rows = [f"{time}{separator}{image}" for time, image in zip(times, names)]
        (folder / name).write_text("\n".join([header, *rows]) + "\n")
    return folder


def rest_table(work, only=None):
    rows = []
    for setup in SETUPS:
        if only and setup not in only:
            continue
        folder = resting_sequence(work, setup)
        memory_mb, frame_ms = [], []
        for num_frames in NUM_FRAMES:
            run = map_sequence(folder, work / f"{setup}_out", setup, "--frames", num_frames)
            memory_mb.append(run.summary["peak_rss_mb"])
            frame_ms.append(1e3 * run.summary["cpu_s"] / num_frames)
        rows.append([setup, run.summary["keyframes"], f"{run.summary['coverage']:.3f}",
                     *(f"{mb:.1f} ({mb / memory_mb[0]:.3f})" for mb in memory_mb),
                     *(f"{ms:.2f}" for ms in frame_ms)])
    frames = [f"{n} frames" for n in NUM_FRAMES]
    return ("At rest: peak memory in MB, in brackets by that after the first so many frames; processor "
            "time per frame in ms:\n\n" +
            table(["set-up", "keyframes", "coverage", *(f"MB, {f}" for f in frames),
                   *(f"ms, {f}" for f in frames)], [list(map(str, row)) for row in rows]))
