#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Several programs write one atlas at a time, and some are killed: is anything lost that they said was done?

usage: benchmarks/atlas_writers.py MAP... [--program build/release/waymark] [--rounds 50] [--seed 0] [--fleet]

MAP are map files of one place. In each round two to four programs begin at once on a new atlas, or on one with a map:
`waymark atlas add` of one or two maps each, `waymark atlas optimize` and, with --fleet, `waymark fleet`; two of five are
killed at a moment that is drawn from as long as their kind takes. Whoever was not killed must end with status 0, what
ended so must be in the atlas, the atlas must be sound, and after one more writer nothing may be left over. Prints JSON;
status 1 if any of that fails.
"""
import argparse
import collections
import contextlib
import hashlib
import json
import pathlib
import random
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time

KILLED_SHARE = 0.4


class Writer:
    """One program on the way, which may be killed."""

    def __init__(self, command, kind, maps):
        self.kind, self.maps, self.started, self.seconds, self.was_killed = kind, maps, time.monotonic(), None, False
        self.process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.timer = None

    def kill_after(self, seconds):
        self.was_killed = True
        self.timer = threading.Timer(seconds, self.process.kill)
        self.timer.start()

    def wait(self):
        self.message = self.process.communicate()[1]
        self.seconds = time.monotonic() - self.started
        if self.timer:
            self.timer.cancel()


class Game:
    def __init__(self, options):
        self.options, self.rng = options, random.Random(options.seed)
        self.longest = collections.defaultdict(lambda: 1.0)  # Seconds, by kind.
        self.counts = collections.Counter()
        self.faults = []

    def start(self, kind, atlas, maps):
        program = self.options.program
        commands = {"add": [program, "atlas", "add", atlas, *maps, "--keyframes", 8],
                    "optimize": [program, "atlas", "optimize", atlas],
                    "fleet": [program, "fleet", *maps, "-o", atlas, "--workers", 1, "--keyframes", 8]}
        return Writer(commands[kind], kind, maps)

    def draw_writers(self, atlas, has_atlas):
        kinds = ["add", "add", "add", *["optimize"] * has_atlas, *["fleet"] * self.options.fleet]
        left = self.rng.sample(self.options.maps, len(self.options.maps))
        writers = []
        for _ in range(self.rng.randint(2, 4)):
            kind = self.rng.choice(kinds)
            count = 0 if kind == "optimize" else min(len(left), self.rng.randint(1, 2))
            if kind != "optimize" and not count:
                continue
            writers.append(self.start(kind, atlas, [left.pop() for _ in range(count)]))
            if self.rng.random() < KILLED_SHARE:
                writers[-1].kill_after(self.rng.uniform(0.0, self.longest[kind]))
        return writers

    def play(self, number, atlas):
        has_atlas = self.rng.random() < 0.5
        acknowledged = set()
        if has_atlas:
            first = self.start("add", atlas, self.rng.sample(self.options.maps, 1))
            first.wait()
            acknowledged.update(first.maps)
        for writer in self.draw_writers(atlas, has_atlas):
            writer.wait()
            status = writer.process.returncode
            self.counts[writer.kind] += 1
            self.counts["killed"] += status < 0
            if status == 0:
                acknowledged.update(writer.maps)
                self.longest[writer.kind] = max(self.longest[writer.kind], writer.seconds)
            elif not writer.was_killed:
                self.faults.append(f"round {number}: {writer.kind} ended with {status}: {writer.message.strip()[-300:]}")
        for kind, maps in (("add", self.options.maps[:1]), ("optimize", [])):
            last = self.start(kind, atlas, maps)
            last.wait()
            if last.process.returncode != 0:
                self.faults.append(f"round {number}: the last one ended with {last.process.returncode}: {last.message.strip()}")
        self.judge(number, atlas, acknowledged | set(self.options.maps[:1]))

    def judge(self, number, atlas, acknowledged):
        with contextlib.closing(sqlite3.connect(f"file:{atlas / 'atlas.db'}?mode=ro", uri=True)) as base:
            there = {row[0] for row in base.execute("SELECT checksum FROM recording")}
            listed = {name for row in base.execute("SELECT checksum, places FROM tile")
                      for name in (f"{row[0]}.wmap", f"{row[1]}.places")}
        lost = [path.name for path in acknowledged if hashlib.sha256(path.read_bytes()).hexdigest() not in there]
        self.counts["acknowledged"] += len(acknowledged)
        self.counts["lost"] += len(lost)
        checked = subprocess.run([self.options.program, "atlas", "check", atlas], capture_output=True, text=True)
        left = {path.name for path in (atlas / "tiles").iterdir()} - listed
        self.faults += [f"round {number}: {name} is lost" for name in lost]
        self.faults += [f"round {number}: {checked.stderr.strip()}"] * (checked.returncode != 0)
        self.faults += [f"round {number}: {name} is left over" for name in sorted(left)]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("maps", nargs="+", type=pathlib.Path)
    parser.add_argument("--program", type=pathlib.Path, default=pathlib.Path("build/release/waymark"))
    parser.add_argument("--rounds", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fleet", action="store_true")
    options = parser.parse_args()
    game, started = Game(options), time.monotonic()
    for number in range(options.rounds):
        with tempfile.TemporaryDirectory(prefix="waymark_writers_", ignore_cleanup_errors=True) as folder:
            game.play(number, pathlib.Path(folder) / "atlas")
    print(json.dumps({"rounds": options.rounds, **game.counts, "faults": game.faults,
                      "seconds": round(time.monotonic() - started, 1)}, indent=1))
    return 1 if game.faults else 0


if __name__ == "__main__":
    sys.exit(main())
