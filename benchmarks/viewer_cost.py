#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What the viewer costs the tracker: alternates runs without and with it, a headless client watching all the while.

usage: benchmarks/viewer_cost.py INPUT [--pairs N] [--keyframes N] [options of waymark run]

Prints the median tracking time of each run and the quotients of the pairs, and how many keyframes, landmarks and frames
the client saw. With --keyframes the runs go on in a map of so many: that of INPUT, and copies of it beside it. The
program is build/release/waymark, or WAYMARK_PROGRAM.
"""
import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import threading

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from viewer_client import ViewerClient  # noqa: E402

PROGRAM = os.environ.get("WAYMARK_PROGRAM", str(ROOT / "build/release/waymark"))


def watch(url, seen):
    """Takes in everything until the session ends."""
    client = ViewerClient(url)
    try:
        while True:
            client.receive()
    except (ConnectionError, OSError):
        seen.append((len(client.keyframes), len(client.landmarks), client.num_frames_shown))


def run(arguments, has_viewer):
    """Median tracking_ms of one run, and what the client saw."""
    seen = []
    with tempfile.TemporaryDirectory(prefix="waymark_cost_") as folder:
        viewer = ["--viewer", "0"] if has_viewer else []
        process = subprocess.Popen([PROGRAM, "run", *arguments, *viewer, "-o", folder], stderr=subprocess.PIPE, text=True)
        for line in process.stderr:
            if found := re.search(r"open (http://\S+) in a browser", line):
                threading.Thread(target=watch, args=(found[1], seen), daemon=True).start()
        if process.wait() != 0:
            sys.exit(f"waymark run ended with status {process.returncode}")
        return json.loads((pathlib.Path(folder) / "summary.json").read_text())["tracking_ms"]["median"], seen


def enlarged_map(arguments, num_keyframes, folder):
    """A map of the input in which that many keyframes are."""
    small, large = folder / "small.wmap", folder / "large.wmap"
    subprocess.run([PROGRAM, "run", *arguments, "--map-out", small, "-o", folder, "--quiet"], check=True)
    enlarge = pathlib.Path(PROGRAM).parent / "benchmarks/waymark_enlarge_map"
    subprocess.run([enlarge, small, str(num_keyframes), large], check=True)
    return large


def compare(pairs, arguments):
    quotients = []
    for pair in range(pairs):
        if pair % 2 == 0:
            without, _ = run(arguments, False)
            watched, seen = run(arguments, True)
        else:
            watched, seen = run(arguments, True)
            without, _ = run(arguments, False)
        quotients.append(watched / without)
        print(f"pair {pair}: {without:.2f} ms without, {watched:.2f} ms with, client {seen}", flush=True)
    print(f"median quotient {statistics.median(quotients):.3f}, from {min(quotients):.3f} to {max(quotients):.3f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--pairs", type=int, default=7)
    parser.add_argument("--keyframes", type=int, default=0)
    options, arguments = parser.parse_known_args()
    with tempfile.TemporaryDirectory(prefix="waymark_cost_") as folder:
        if options.keyframes:
            large = enlarged_map(arguments, options.keyframes, pathlib.Path(folder))
            arguments += ["--map-in", str(large)]
        compare(options.pairs, arguments)


if __name__ == "__main__":
    main()
