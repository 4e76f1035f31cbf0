#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A fleet of recordings of one town: what `waymark fleet` makes of it, and what it costs.

usage: PYTHONPATH=build/release/python benchmarks/town_fleet.py [--build build/release] [--recordings 24]
                                                                [--keyframes 250] [--out FOLDER]

Makes the recordings by waymark_town_fleet (three rigs in turns, each with its own start, way and light, mapped one by
one) and, unless FOLDER has them already, a quarter of as many of a town of a quarter; then runs the fleet: with two
workers; once more; with one worker and the recordings in reverse; with a worker killed in the middle; with one
recording cut off. Prints JSON.
"""
import argparse
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import waymark


def positions(path):
    """Of the truth, by time in milliseconds."""
    truth = {}
    for line in path.read_text().splitlines():
        words = line.split()
        truth[round(float(words[0]) * 1000)] = [float(word) for word in words[1:4]]
    return truth


def root_mean_square(found, truth):
    """Of distances after the best rigid motion (Umeyama 1991)."""
    found, truth = np.asarray(found), np.asarray(truth)
    u, _, vt = np.linalg.svd((truth - truth.mean(0)).T @ (found - found.mean(0)))
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    off = (found - found.mean(0)) @ rotation.T - (truth - truth.mean(0))
    return float(np.sqrt((off ** 2).sum(1).mean()))


def errors_of(made, truth):
    """ATE of the keyframes of each sub-map of a map."""
    keyframes = made.keyframes()
    times = np.round(keyframes.timestamps_ns / 1e6).astype(int)
    return [root_mean_square([keyframes.world_from_rig[i, :3, 3] for i in of_submap], [truth[times[i]] for i in of_submap])
            for submap in np.unique(keyframes.submaps) for of_submap in [np.flatnonzero(keyframes.submaps == submap)]]


def processes_below(pid):
    for task in pathlib.Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            yield int(child)
            yield from processes_below(int(child))


def kill_a_worker(pid):
    for child in processes_below(pid):
        if b"spawn_main" in pathlib.Path(f"/proc/{child}/cmdline").read_bytes():
            os.kill(child, signal.SIGKILL)
            return True
    return False


class Fleet:
    def __init__(self, program, folder):
        self.program, self.folder, self.num_killed = program, folder, 0

    def run(self, name, recordings, *, workers, kill_after=None):
        """What one run costs and says; kill_after: a worker goes at the first line with these words."""
        before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        lines = []
        with subprocess.Popen([self.program, "fleet", *map(str, recordings), "-o", str(self.folder / name), "--workers",
                               str(workers)], stderr=subprocess.PIPE, text=True) as fleet:
            for line in fleet.stderr:
                lines.append(line.rstrip())
                print(lines[-1], file=sys.stderr)
                if kill_after and kill_after in line and kill_a_worker(fleet.pid):
                    kill_after, self.num_killed = None, self.num_killed + 1
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return {"status": fleet.returncode, "cpu_s": round(cpu, 1), "s": round(time.monotonic() - started, 1), "lines": lines}

    def contents(self, name):
        atlas = waymark.Atlas(self.folder / name)
        return {"recordings": atlas.recordings, "tiles": atlas.tiles, "links": atlas.links}


def make_recordings(build, count, keyframes, folder):
    if not folder.exists():
        making = folder.with_suffix(".new")
        shutil.rmtree(making, ignore_errors=True)
        program = build / "benchmarks/waymark_town_fleet"
        subprocess.run([str(program), str(count), str(keyframes), str(making)], check=True, stdout=sys.stderr)
        making.rename(folder)
    return sorted(folder.glob("*.wmap"))


def single_errors(recordings, truth):
    return [error for path in recordings for error in errors_of(waymark.Map.load(path), truth)]


def measure(fleet, recordings, few):
    truth = {}
    for path in recordings:
        truth.update(positions(path.with_suffix(".txt")))
    single = single_errors(recordings, truth)
    first = fleet.run("first", recordings, workers=2)
    made = waymark.Atlas(fleet.folder / "first").export()
    contents = fleet.contents("first")
    together = errors_of(made, truth)
    result = {"recordings": len(recordings), "keyframes": made.num_keyframes, "tiles": len(contents["tiles"]),
              "places": sum(not link["is_border"] for link in contents["links"]),
              "parts": len(together), "ate_single_mean_m": np.mean(single), "ate_single_m": single,
              "ate_one_frame_m": together, "ratio": together[0] / np.mean(single), "cpu_s": first["cpu_s"], "s": first["s"]}
    again = fleet.run("first", recordings, workers=2)
    result["again"] = {"done": sum(int(line.split(" done now")[0].split()[-1]) for line in again["lines"]
                                   if " done now" in line), "cpu_s": again["cpu_s"], "s": again["s"],
                       "same": fleet.contents("first") == contents}
    fleet.run("reverse", recordings[::-1], workers=1)
    result["one_worker_in_reverse_is_same"] = fleet.contents("reverse") == contents
    for name, words in (("killed_mapping", f"[{len(recordings) // 4}/"), ("killed_linking", "look for shared places")):
        fleet.num_killed = 0
        killed = fleet.run(name, recordings, workers=2, kill_after=words)
        result[name] = {"killed": fleet.num_killed, "status": killed["status"], "same": fleet.contents(name) == contents}
    damaged = fleet.folder / f"{recordings[1].stem}.wmap"
    damaged.write_bytes(recordings[1].read_bytes()[:recordings[1].stat().st_size // 2])
    torn = fleet.run("torn", [recordings[0], damaged, *recordings[2:]], workers=2)
    result["damaged"] = {"status": torn["status"], "lines": [line for line in torn["lines"] if str(damaged) in line],
                         "done": len(fleet.contents("torn")["recordings"])}
    of_few = fleet.run("few", few, workers=2)
    each = [of_few["cpu_s"] / len(few), first["cpu_s"] / len(recordings)]
    result["cpu_s_per_recording"] = {str(len(few)): each[0], str(len(recordings)): each[1], "ratio": each[1] / each[0],
                                     "ratio_of_logs": np.log(len(recordings)) / np.log(len(few))}
    return result


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build/release"))
    parser.add_argument("--recordings", type=int, default=24)
    parser.add_argument("--keyframes", type=int, default=250)
    parser.add_argument("--out", type=pathlib.Path)
    options = parser.parse_args()
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=options.out) as temporary:
        kept = options.out or pathlib.Path(temporary)

        def make(count):
            return make_recordings(options.build, count, options.keyframes, kept / f"town_{count}_{options.keyframes}")

        fleet = Fleet(str(options.build / "waymark"), pathlib.Path(temporary))
        result = measure(fleet, make(options.recordings), make(options.recordings // 4))
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
