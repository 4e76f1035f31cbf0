#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Kills waymark_town_autosave at random moments and looks at what is left of its map.

usage: benchmarks/town_kill.py [--build build/release] [--keyframes 50000] [--kills 20] [--out FOLDER]

Prints a line per kill: keyframes that were safe when it came, and those that the files have; and at the end what
saving a hundred new keyframes took. Ends with 1 where something was lost.
"""
import argparse
import pathlib
import random
import subprocess
import sys
import tempfile
import time

MOST_SECONDS = 30.0  # After loading: the first save writes all, those after it what is new.


def start(program, num_keyframes, file):
    """The process, once it has a map, and the keyframes of that."""
    process = subprocess.Popen([program, str(num_keyframes), file], stdout=subprocess.PIPE, text=True)
    line = process.stdout.readline()
    if not line:
        sys.exit("the map cannot be read any more")
    return process, int(line.split()[0])


def kill_after(process, seconds):
    """Lines of what was saved until then."""
    time.sleep(seconds)
    process.kill()
    return [line.split() for line in process.stdout.read().splitlines(True) if line.endswith("\n")]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", default="build/release", type=pathlib.Path)
    parser.add_argument("--keyframes", default=50000, type=int)
    parser.add_argument("--kills", default=20, type=int)
    parser.add_argument("--out", type=pathlib.Path)
    args = parser.parse_args()
    program = args.build / "benchmarks/waymark_town_autosave"
    rng = random.Random(1)
    saves, num_lost = [], 0
    with tempfile.TemporaryDirectory(dir=args.out) as folder:
        file = pathlib.Path(folder) / "town.wmap"
        process, at_start = start(program, args.keyframes, file)
        for _ in range(args.kills):
            seconds = rng.uniform(0.0, MOST_SECONDS)
            lines = kill_after(process, seconds)
            safe = int(lines[-1][0]) if lines else at_start
            saves += [(float(line[2]), float(line[4])) for line in lines[1:]]
            process, at_start = start(program, args.keyframes, file)
            num_lost += at_start < safe
            print(f"killed after {seconds:.2f} s: {safe} keyframes were safe, {at_start} are there", flush=True)
        process.kill()
        process.wait()
    if saves:
        cpu, clock = zip(*saves)
        print(f"{len(saves)} saves of a hundred new keyframes: at most {max(cpu):.3f} s of the processor, "
              f"{max(clock):.3f} s by the clock; in the mean {sum(cpu) / len(cpu):.3f} and {sum(clock) / len(clock):.3f} s")
    print(f"{num_lost} of {args.kills} kills lost what was safe")
    sys.exit(num_lost > 0)


if __name__ == "__main__":
    main()
