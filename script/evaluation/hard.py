# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Hard scenes: sequences made worse, against their clean runs, and simulated motions."""
import itertools
import statistics
import sys
from typing import NamedTuple

from .program import map_sequence
from .simulated import simulate
from .splice import Part, Sequence, splice
from .tables import list_of, table
from .trajectories import ate

MIN_POSES = 10  # For an ATE.


class Recorded(NamedTuple):
    """A sequence of DATA_DIR and how it is made worse at levels 1 to 3."""
    name: str
    setup: str
    flaw: str
    levels: tuple = (2, 3)


class Simulated(NamedTuple):
    """What `waymark simulate` makes; another seed is another sequence."""
    name: str
    setups: tuple
    arguments: tuple


def skip(sequence, level, folder):
    """Every 2nd, 3rd or 4th frame only."""
    return splice([Part(sequence, 0, len(sequence), step=level + 1)], folder)


FLAWS = {"skip": skip}

RECORDED = tuple(
    Recorded(name, setup, flaw) for flaw in FLAWS for name, setup in (
        ("euroc_mh01_stereo", "stereo"), ("kitti_00_stereo", "stereo"), ("kitti_03_mono", "mono"),
        ("tum_fr1_rpy_rgbd", "rgbd"), ("sim_bookstore_mono", "mono"), ("sim_house_rgbd", "rgbd")))

ALL_SETUPS = ("mono", "stereo", "rgbd")
SHORT_EXPOSURE = ("--frames", 300, "--exposure", 5)
WALK = ("--motion", "loop", "--frames", 300, "--rate", 15)
LONG_WALK = ("--motion", "loop", "--frames", 1200, "--rate", 12)
# A blank flat beside the same one with texture, and with a crowd in it; places that look alike.
SIMULATED = tuple(Simulated(motion, ALL_SETUPS, ("room", "--motion", motion, *SHORT_EXPOSURE))
                  for motion in ("turns_150", "turns_250", "shaken")) + tuple(
                      Simulated(world, ALL_SETUPS, (world, *WALK)) for world in ("blank", "apartment")) + (
                          Simulated("walkers", ALL_SETUPS, ("apartment", *WALK, "--walkers", 3)),
                          Simulated("corridor", ALL_SETUPS, ("corridor", *LONG_WALK)),
                          Simulated("shop", ALL_SETUPS, ("shop", *LONG_WALK)))


def figures_of(sequence_run, true_pose, setup):
    """Coverage, ATE (None where there is none) and times of a run; true_pose: by time stamp."""
    pairs = [(pose, true_pose(stamp)) for stamp, pose in sequence_run.trajectories[0].items()]
    pairs = [pair for pair in pairs if pair[1] is not None]
    summary = sequence_run.summary
    return {"coverage": summary["coverage"], "parts": len(sequence_run.trajectories),
            "ate_m": ate(pairs, setup == "mono") if len(pairs) >= MIN_POSES else None,
            "mean_ms": summary["tracking_ms"]["mean"], "p95_ms": summary["tracking_ms"]["p95"]}


def median_figures(runs):
    """Of each figure over the seeds."""
    return {key: statistics.median(values) if None not in values else None
            for key, values in ((k, [r[k] for r in runs]) for k in runs[0])}


def measure(folder, out, setup, seeds, true_pose):
    runs = [map_sequence(folder, out, setup, "--seed", seed)
            for seed in range(seeds if setup == "mono" else 1)]
    return median_figures([figures_of(r, true_pose, setup) for r in runs])


def metres(value):
    return "-" if value is None else f"{value:.4f}"


def row_of(name, setup, figures, clean=None):
    both = clean and clean["ate_m"] and figures["ate_m"]
    return [name, setup, f"{figures['coverage']:.3f}", f"{figures['parts']:.0f}",
            metres(figures["ate_m"]), f"{figures['ate_m'] / clean['ate_m']:.2f}" if both else "-",
            f"{figures['mean_ms']:.1f}", f"{figures['p95_ms'] / figures['mean_ms']:.1f}"]


def recorded_rows(data, work, seeds, is_wanted):
    clean = {}
    for case in RECORDED:
        if not is_wanted(f"{case.name} {case.flaw}"):
            continue
        sequence = Sequence(data / case.name, case.setup)
        key = (case.name, case.setup)
        if key not in clean:
            clean[key] = measure(sequence.folder, work / case.name / "clean", case.setup, seeds,
                                 sequence.truth.at)
        for level in case.levels:
            folder = work / case.name / f"{case.flaw}_{level}"
            true = {f.stamp: f.true_pose() for f in FLAWS[case.flaw](sequence, level, folder / "input")}
            figures = measure(folder / "input", folder / "out", case.setup, seeds, true.get)
            yield row_of(f"{case.name} {case.flaw} {level}", case.setup, figures, clean[key])


def simulated_rows(work, seeds, is_wanted):
    for case in SIMULATED:
        for setup in case.setups:
            if not is_wanted(case.name):
                continue
            found = []
            for seed in range(seeds):
                folder = simulate(work / f"{case.name}_{setup}_{seed}", *case.arguments, "--setup",
                                  setup, "--seed", seed)
                truth = Sequence(folder, setup).truth
                sequence_run = map_sequence(folder, work / "out", setup)
                found.append(figures_of(sequence_run, truth.at, setup))
            yield row_of(case.name, setup, median_figures(found))


def hard_table(data, work, seeds, only):
    """Sequences of the folder that are not there are left out and named."""
    missing = sorted({c.name for c in RECORDED if not (data / c.name / "groundtruth.txt").exists()})

    def is_wanted(name):
        return name.split()[0] not in missing and (not only or any(o in name for o in only))

    rows = []
    for row in itertools.chain(recorded_rows(data, work, seeds, is_wanted),
                               simulated_rows(work, seeds, is_wanted)):
        print(" ".join(row), file=sys.stderr)
        rows.append(row)
    text = table(["scene", "set-up", "coverage", "parts", "ATE m", "of the clean run", "tracking ms",
                  "p95 by mean"], rows)
    return text + ("\n\nNot measured:\n\n" + list_of(missing) if missing else "")
