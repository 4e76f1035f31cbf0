# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Long simulated runs: does the scale stay, and the time, and the memory?"""
import sys
from typing import NamedTuple

from .program import map_sequence
from .simulated import simulate
from .tables import table
from .trajectories import Truth, align, ate

PANORAMA = "cam0:\n  camera_model: equirectangular\n  resolution: [640, 320]\n"


class LongRun(NamedTuple):
    """Three times over the same ground."""
    name: str
    world: str
    num_frames: int
    camera: str = ""  # A camchain; empty: the usual one.


LONG_RUNS = (LongRun("rounds_hall", "hall", 3000), LongRun("rounds_street", "street", 3000),
             LongRun("rounds_street_360", "street", 5000, PANORAMA))


def tracking_ms(row):
    """From image in memory to pose returned; waiting for the mapper does not count."""
    return sum(float(v) for k, v in row.items() if k.endswith("_ms") and k != "wait_ms")


def percentile_95(values):
    return sorted(values)[-(-95 * len(values) // 100) - 1]


def scale_of(truth, poses):
    return align(truth.pairs_with(poses), True).scale


def measure(long_run, work):
    options = ["--setup", "mono", "--motion", "rounds", "--frames", long_run.num_frames, "--seed", 7]
    if long_run.camera:
        camera = work / f"{long_run.name}.yaml"
        camera.parent.mkdir(parents=True, exist_ok=True)
        camera.write_text(long_run.camera)
        options += ["--camera", camera]
    folder = simulate(work / long_run.name, long_run.world, *options)
    run = map_sequence(folder, work / f"{long_run.name}_out", "mono")
    truth = Truth(folder / "groundtruth.txt")
    poses = list(run.trajectories[0].items())
    tenth = len(poses) // 10
    first, last = scale_of(truth, dict(poses[:tenth])), scale_of(truth, dict(poses[-tenth:]))
    rows = [r for r in run.frames if r["state"] == "tracked"]
    tenth = len(rows) // 10
    times = [percentile_95([tracking_ms(r) for r in part]) for part in (rows[:tenth], rows[-tenth:])]
    pairs = truth.pairs_with(run.trajectories[0])
    return {"name": long_run.name, "frames": len(run.frames), "summary": run.summary,
            "coverage": len(pairs) / len(run.frames), "ate_m": ate(pairs, True),
            # An estimate that has grown is scaled down by the alignment.
            "scale_change_percent": 100.0 * (first / last - 1.0),
            "tracking_p95_ms": times}


def long_table(work, only=None):
    rows = []
    for long_run in LONG_RUNS:
        if only and not any(o in long_run.name for o in only):
            continue
        try:
            m = measure(long_run, work)
        except RuntimeError as error:
            rows.append([long_run.name, str(error)] + [""] * 7)
            continue
        first, last = m["tracking_p95_ms"]
        summary = m["summary"]
        memory = 1024.0 * summary["peak_rss_mb"] / max(1, summary["keyframes"])
        rows.append([m["name"], str(m["frames"]), f"{m['coverage']:.3f}", f"{m['ate_m']:.3f}",
                     f"{m['scale_change_percent']:+.2f}", f"{first:.1f} / {last:.1f} = "
                     f"{last / first:.2f}", str(summary["loops"]), str(summary["keyframes"]),
                     f"{memory:.0f} ({summary['peak_rss_mb']:.0f} MB)"])
        print(f"{m['name']}: scale {m['scale_change_percent']:+.2f} %", file=sys.stderr)
    return ("Three rounds over the same ground, mono; the last tenth against the first:\n\n" +
            table(["sequence", "frames", "coverage", "ATE m", "change of scale %",
                   "tracking p95 ms: first / last", "loops", "keyframes", "peak kB per keyframe"],
                  rows))
