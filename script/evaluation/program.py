# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Running the program, and what it wrote."""
import csv
import json
import os
import pathlib
import re
import shutil
import subprocess

from .trajectories import read_trajectories

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PROGRAM = pathlib.Path(os.environ.get("WAYMARK_PROGRAM", ROOT / "build/release/waymark"))
LIVE_SUBMAP = re.compile(r"frame (\d+): tracked in sub-map (\d+)")


class NoPose(RuntimeError):
    """A run in which no image has one."""


def run(command):
    """Standard output of a command; RuntimeError says why it failed."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode == 3:
        raise NoPose("no pose at all")
    if done.returncode:
        message = done.stderr.strip().split("\n")[-1]
        raise RuntimeError(message or f"status {done.returncode}")
    return done.stdout


def config_of(folder):
    """EuRoC and KITTI carry their calibration; the others need the camchain beside them."""
    carries_its_own = (folder / "mav0").exists() or (folder / "calib.txt").exists()
    camchain = folder / "camchain.yaml"
    return [] if carries_its_own or not camchain.exists() else ["-c", camchain]


class Run:
    """The files of a run."""

    def __init__(self, folder):
        self.summary = json.loads((folder / "summary.json").read_text())
        with open(folder / "frames.csv", newline="") as file:
            self.frames = list(csv.DictReader(file))
        self.trajectories = read_trajectories(folder)
        log = folder / "run.log"
        found = LIVE_SUBMAP.findall(log.read_text()) if log.exists() else []
        # The sub-map that each frame was tracked in at that time; the table has what became of it.
        self.live_submap = {int(index): int(submap) for index, submap in found}


def map_sequence(folder, out, setup, *options):
    """Runs the program on a data set."""
    shutil.rmtree(out, ignore_errors=True)
    run([PROGRAM, "run", folder, *config_of(folder), "--setup", setup, "--timing", "lockstep", "-o",
         out, "--quiet", "--log", out / "run.log", *options])
    return Run(out)


def setups_of(folder):
    """Set-ups that the layout of a sequence offers."""
    if (folder / "depth.txt").exists():
        return ["rgbd", "mono"]
    is_pair = (folder / "mav0/cam1").exists() or (folder / "image_1").exists()
    return ["stereo", "mono"] if is_pair else ["mono"]
