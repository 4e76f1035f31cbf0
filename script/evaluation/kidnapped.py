# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Sequences whose view is interrupted: black frames, jumps, other places in between. What happens to
them is judged by the files of a run alone."""
import collections
import sys
from typing import NamedTuple

from .program import map_sequence
from .rotations import dot, norm, subtract
from .splice import Part, Sequence, splice
from .tables import list_of, table
from .trajectories import align, ate, errors

MAX_SECONDS_TO_FIND = 1.0
MAX_ATE_RATIO = 1.3
ATE_FLOOR_M = 0.002  # So much more is allowed in any case: what chance does to an error of millimetres.
KNOWN_WITHIN_M = 1.0
KNOWN_WITHIN_COSINE = 0.866  # Of 30 degrees.
MIN_PART_POSES = 20
# A pose in a wrong place is wrong by metres; what drift does is bounded by the ratio above.
MAX_POSE_ERROR_RATIO = 8.0
MAX_POSE_ERROR_M = 0.25
MAX_POSE_ERROR_DEG = 15.0


class Case(NamedTuple):
    """Parts as (sequence, first, end), or with True behind for black frames."""
    name: str
    setup: str
    parts: tuple
    num_submaps: int = 1
    is_quick: bool = False  # Part of the tests, not only of the evaluation.

    @property
    def title(self):
        return f"{self.name}_{self.setup}"


def black_out(name, first, begin, end, last):
    return ((name, first, begin), (name, begin, end, True), (name, end, last))


EUROC, SHOP, HOUSE = "euroc_mh01_stereo", "sim_bookstore_mono", "sim_house_rgbd"
WAREHOUSE, TRACK, ROAD = "sim_warehouse_fisheye_stereo", "sim_track_stereo", "kitti_03_mono"
DESK = "tum_fr1_rpy_rgbd"

CASES = (
    Case("black_euroc", "stereo", black_out(EUROC, 0, 120, 150, 240), is_quick=True),
    Case("black_euroc", "mono", black_out(EUROC, 0, 120, 150, 300), is_quick=True),
    Case("black_house", "rgbd", black_out(HOUSE, 0, 120, 143, 240), is_quick=True),
    Case("black_house_long", "rgbd", black_out(HOUSE, 0, 240, 263, 503)),
    Case("black_house_long", "mono", black_out(HOUSE, 0, 240, 263, 503)),
    Case("black_shop", "mono", black_out(SHOP, 0, 500, 530, 1019)),
    Case("black_warehouse", "stereo", black_out(WAREHOUSE, 0, 390, 420, 794)),
    Case("black_warehouse", "mono", black_out(WAREHOUSE, 0, 390, 420, 794)),
    Case("jump_house", "rgbd", ((HOUSE, 0, 130), (HOUSE, 20, 110)), is_quick=True),
    Case("jump_shop", "mono", ((SHOP, 0, 408), (SHOP, 102, 1019))),
    Case("jump_to_start_shop", "mono", ((SHOP, 0, 510), (SHOP, 0, 510))),
    Case("jump_house_long", "rgbd", ((HOUSE, 0, 250), (HOUSE, 50, 503))),
    Case("jump_house_long", "mono", ((HOUSE, 0, 250), (HOUSE, 50, 503))),
    Case("jump_warehouse", "stereo", ((WAREHOUSE, 0, 400), (WAREHOUSE, 80, 794))),
    Case("jump_track", "stereo", ((TRACK, 0, 290), (TRACK, 70, 714))),
    Case("between_shop", "mono", ((SHOP, 0, 160), (EUROC, 0, 120), (SHOP, 160, 320)), 2, True),
    Case("between_shop_long", "mono", ((SHOP, 0, 510), (EUROC, 0, 300), (SHOP, 510, 1019)), 2),
    Case("between_euroc", "mono", ((EUROC, 0, 150), (SHOP, 0, 500), (EUROC, 150, 300)), 2),
    Case("between_house", "rgbd", ((HOUSE, 0, 250), (DESK, 0, 240), (HOUSE, 250, 503)), 2),
    Case("between_house", "mono", ((HOUSE, 0, 250), (DESK, 0, 240), (HOUSE, 250, 503)), 2),
    Case("apart_road", "mono", ((ROAD, 0, 100), (ROAD, 300, 400)), 2, True),
    Case("apart_track", "stereo", ((TRACK, 0, 100), (TRACK, 420, 520)), 2),
    Case("apart_warehouse", "stereo", ((WAREHOUSE, 0, 100), (WAREHOUSE, 430, 600)), 2),
    Case("apart_warehouse", "mono", ((WAREHOUSE, 0, 100), (WAREHOUSE, 430, 600)), 2),
    Case("apart_shop", "mono", ((SHOP, 0, 160), (SHOP, 580, 760)), 2),
)


class PartReport(NamedTuple):
    """What became of one part of a case."""
    name: str
    num_frames: int
    num_poses: int
    seconds_to_find: float | None  # From when a known place is seen; None where none is.
    ate_m: float | None
    unbroken_ate_m: float | None


class Report(NamedTuple):
    parts: list
    num_submaps: int
    max_error_m: float
    failures: list


class Judge:
    """Runs cases from the sequences of a folder, and the unbroken runs that they are compared with."""

    def __init__(self, data, work):
        self.data, self.work = data, work
        self._sequences, self._unbroken = {}, {}

    def has(self, case):
        return all((self.data / part[0] / "groundtruth.txt").exists() for part in case.parts)

    def judge(self, case):
        parts = [Part(self._sequence(name, case.setup), first, end, bool(black))
                 for name, first, end, *black in case.parts]
        folder = self.work / case.title
        frames = splice(parts, folder / "input")
        return Verdict(case, frames, map_sequence(folder / "input", folder / "out", case.setup),
                       lambda sequence: self._unbroken_run(case, sequence)).report()

    def _sequence(self, name, setup):
        key = (name, setup)
        if key not in self._sequences:
            self._sequences[key] = Sequence(self.data / name, setup)
        return self._sequences[key]

    def _unbroken_run(self, case, sequence):
        """The trajectory over all that the case shows of a sequence, by time stamp of the sequence."""
        shown = [p for p in case.parts if p[0] == sequence.name]
        first, end = min(p[1] for p in shown), max(p[2] for p in shown)
        key = (sequence.name, case.setup, first, end)
        if key not in self._unbroken:
            out = self.work / f"{sequence.name}_{case.setup}_{first}_{end}"
            run = map_sequence(sequence.folder, out, case.setup, "--first", first, "--frames",
                               end - first)
            self._unbroken[key] = run.trajectories[0]
        return self._unbroken[key]


class Verdict:
    """Compares a run with what the case asks for."""

    def __init__(self, case, frames, run, unbroken_run):
        self.case, self.frames, self.run, self.unbroken_run = case, frames, run, unbroken_run
        self.with_scale = case.setup == "mono"
        self.failures = []
        # Per frame: the sub-map it ended up in, as the number of its trajectory, and its pose there.
        self.pose = {stamp: (number, pose) for number, trajectory in enumerate(run.trajectories)
                     for stamp, pose in trajectory.items()}

    def fail(self, text):
        self.failures.append(f"{self.case.title}: {text}")

    def report(self):
        begins = [i for i, f in enumerate(self.frames)
                  if i == 0 or f.part is not self.frames[i - 1].part]
        parts = [self._judge_part(begin, end)
                 for begin, end in zip(begins, [*begins[1:], len(self.frames)])
                 if not self.frames[begin].part.is_black]
        max_error_m = self._judge_submaps()
        unexplained = [row["index"] for row in self.run.frames
                       if row["state"] not in ("tracked", "filled") and row["reason"] == "none"]
        if unexplained:
            self.fail(f"{len(unexplained)} frames have neither a pose nor a reason, from frame "
                      f"{unexplained[0]} on")
        return Report(parts, len(self.run.trajectories), max_error_m, self.failures)

    def _judge_part(self, begin, end):
        part = self.frames[begin].part
        name = f"{part.sequence.name} {part.first}..{part.end}"
        seconds = self._judge_finding(name, begin, end)
        in_part = [f for f in self.frames[begin:end] if f.stamp in self.pose]
        if len(in_part) < MIN_PART_POSES:
            self.fail(f"{name}: {len(in_part)} of {end - begin} frames have a pose")
            return PartReport(name, end - begin, len(in_part), seconds, None, None)
        error, unbroken = self._judge_error(name, part.sequence, in_part)
        return PartReport(name, end - begin, len(in_part), seconds, error, unbroken)

    def _judge_error(self, name, sequence, frames):
        """The error of a part whose calibration is right, against that of the unbroken run."""
        if sequence.calibration() != self.frames[0].part.sequence.calibration():
            return None, None
        number = collections.Counter(self.pose[f.stamp][0] for f in frames).most_common(1)[0][0]
        unbroken_run = self.unbroken_run(sequence)
        broken, unbroken = [], []
        for frame in frames:
            true = frame.true_pose()
            whole = unbroken_run.get(sequence.stamps[frame.index])
            if true and whole and self.pose[frame.stamp][0] == number:
                broken.append((self.pose[frame.stamp][1], true))
                unbroken.append((whole, true))
        if len(broken) < MIN_PART_POSES:
            self.fail(f"{name}: only {len(broken)} frames to compare")
            return None, None
        error, unbroken_error = ate(broken, self.with_scale), ate(unbroken, self.with_scale)
        if error > max(MAX_ATE_RATIO * unbroken_error, unbroken_error + ATE_FLOOR_M):
            self.fail(f"{name}: ATE {error:.4f} m, {unbroken_error:.4f} m without interruption")
        return error, unbroken_error

    def _judge_finding(self, name, begin, end):
        """Seconds from when a known place is seen until the tracker is in a sub-map that knows it."""
        known = [f for f in self.frames[:begin] if f.stamp in self.pose]
        for i in range(begin, end):
            near = [f for f in known if self._show_the_same(f, self.frames[i])]
            if near:
                break
        else:
            return None
        # Sub-maps under the names that they had while tracking and in the end.
        index_of = {f.stamp: k for k, f in enumerate(self.frames)}
        names = {self.run.live_submap.get(index_of[f.stamp]) for f in near}
        names |= {int(self.run.frames[index_of[f.stamp]]["submap"]) for f in near}
        found = next((k for k in range(i, end) if self.run.live_submap.get(k) in names), None)
        if found is None:
            self.fail(f"{name}: frame {i} shows a known place that is never found")
            return float("inf")
        seconds = (self.frames[found].stamp - self.frames[i].stamp) * 1e-9
        if seconds > MAX_SECONDS_TO_FIND:
            self.fail(f"{name}: frame {i} shows a known place that is found after {seconds:.2f} s, "
                      f"at frame {found}; reasons until then: {self._reasons(i, found)}")
        return seconds

    @staticmethod
    def _show_the_same(one, other):
        if one.part.is_black or other.part.is_black:
            return False
        if one.part.sequence is not other.part.sequence:
            return False
        a, b = one.true_pose(), other.true_pose()
        return (a is not None and b is not None and
                norm(subtract(a.position, b.position)) < KNOWN_WITHIN_M and
                dot(a.looks(), b.looks()) > KNOWN_WITHIN_COSINE)

    def _reasons(self, first, end):
        counts = collections.Counter(f"{row['state']}/{row['reason']}"
                                     for row in self.run.frames[first:end])
        return ", ".join(f"{count} {what}" for what, count in counts.items())

    def _judge_submaps(self):
        """No sub-map holds places that do not overlap; those that do are in one; every pose is near
        its true one."""
        if len(self.run.trajectories) != self.case.num_submaps:
            sizes = ", ".join(str(len(t)) for t in self.run.trajectories)
            self.fail(f"{len(self.run.trajectories)} sub-maps of {sizes} frames, "
                      f"expected {self.case.num_submaps}")
        largest = 0.0
        for number in range(len(self.run.trajectories)):
            members = [f for f in self.frames if self.pose.get(f.stamp, (None,))[0] == number]
            names = sorted({f.part.sequence.name for f in members})
            if len(names) > 1:
                self.fail(f"one sub-map holds {' and '.join(names)}")
                continue
            largest = max(largest, self._judge_poses(members))
        return largest

    def _judge_poses(self, members):
        """The largest distance of a pose of a sub-map to its true one."""
        sequence = members[0].part.sequence
        if sequence.calibration() != self.frames[0].part.sequence.calibration():
            return 0.0
        with_truth = [f for f in members if f.true_pose() is not None]
        if len(with_truth) < MIN_PART_POSES:
            return 0.0
        pairs = [(self.pose[f.stamp][1], f.true_pose()) for f in with_truth]
        whole = sequence.truth.pairs_with(self.unbroken_run(sequence))
        limit_m = max(MAX_POSE_ERROR_RATIO * ate(whole, self.with_scale), MAX_POSE_ERROR_M)
        found = errors(pairs, align(pairs, self.with_scale))
        wrong = [f for f, (metres, degrees) in zip(with_truth, found)
                 if metres > limit_m or degrees > MAX_POSE_ERROR_DEG]
        if wrong:
            worst = max(metres for metres, _ in found)
            self.fail(f"{len(wrong)} frames of {sequence.name} in a wrong place, from frame "
                      f"{self.frames.index(wrong[0])} on, off by {worst:.3f} m at most")
        return max(metres for metres, _ in found)


def kidnapped_table(data, work, only=None):
    judge = Judge(data, work)
    rows, failures = [], []
    for case in CASES:
        if not judge.has(case) or only and not any(o in case.title for o in only):
            continue
        try:
            report = judge.judge(case)
        except RuntimeError as error:
            failures.append(f"{case.title}: {error}")
            continue
        print(f"{case.title}: {'as it should be' if not report.failures else 'fails'}", file=sys.stderr)
        failures += report.failures
        for i, part in enumerate(report.parts):
            rows.append([case.title if i == 0 else "", part.name,
                         f"{part.num_poses} of {part.num_frames}", text_of(part.seconds_to_find, 2),
                         text_of(part.ate_m, 4), text_of(part.unbroken_ate_m, 4),
                         f"{report.num_submaps} ({case.num_submaps})" if i == 0 else "",
                         f"{report.max_error_m:.3f}" if i == 0 else ""])
    return ("Sequences with interruptions:\n\n" +
            table(["case", "part", "poses", "found after s", "ATE m", "unbroken", "sub-maps (true)",
                   "largest error m"], rows) +
            ("\n\n" + list_of(failures) if failures else ""))


def text_of(value, decimals):
    return "" if value is None else f"{value:.{decimals}f}"
