# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What closing loops is worth: the same sequences without and with it."""
import sys

from .program import map_sequence
from .tables import table
from .trajectories import Truth, ate, end_to_end_error

NEAR_M = 0.1  # Of the length of the path: sequences that end so near to where they began come back.


def comes_back(folder):
    """Whether a sequence ends near where it began, and goes somewhere in between."""
    poses = list(Truth(folder / "groundtruth.txt").poses())
    if len(poses) < 2:
        return False
    places = [p.position for p in poses]
    def apart(a, b):
        return sum((x - y)**2 for x, y in zip(a, b))**0.5
    far = max(apart(places[0], p) for p in places)
    nearest = min(apart(places[0], p) for p in places[len(places) * 2 // 3:])
    return far > 1.5 and nearest < NEAR_M * far


def measure(case, work):
    """Off and on: ((metres, degrees) from end to end, ATE), and the number of loops closed."""
    truth = Truth(case.folder / "groundtruth.txt")
    figures = []
    for enabled in ("false", "true"):
        run = map_sequence(case.folder, work / f"{case.name}_{case.setup}_loop_{enabled}", case.setup,
                           "--set", f"loop.enabled={enabled}")
        pairs = truth.pairs_with(run.trajectories[0])
        with_scale = case.setup == "mono"
        figures.append((*end_to_end_error(pairs, with_scale), ate(pairs, with_scale)))
    return figures, run.summary["loops"]


def loop_table(cases, work):
    rows = []
    for case in (c for c in cases if comes_back(c.folder)):
        try:
            (off, on), num_loops = measure(case, work)
        except RuntimeError as error:
            rows.append([case.name, case.setup, str(error), "", "", ""])
            continue
        print(f"{case.title}: from end to end {off[0]:.4f} m without, {on[0]:.4f} m with loops",
              file=sys.stderr)
        rows.append([case.name, case.setup, f"{off[0]:.3f} / {off[1]:.2f}",
                     f"{on[0]:.3f} / {on[1]:.2f}", f"{off[2]:.4f} / {on[2]:.4f}", str(num_loops)])
    return ("Error of the motion from the first frame to the last, without and with closing loops:\n\n" +
            table(["sequence", "set-up", "off: m / deg", "on: m / deg", "ATE m: off / on", "loops"],
                  rows))
