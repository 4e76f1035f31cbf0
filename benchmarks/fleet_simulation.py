#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""How long fleets of any size take: hands made-up tasks with measured costs to simulated workers.

usage: benchmarks/fleet_simulation.py COSTS.json [--recordings N]... [--workers N]... [--frame-s S] [--frames N]
                                      [--keyframes N]

COSTS.json comes from benchmarks/fleet_costs.py. Steps, barriers and who does what are those of python/waymark/fleet.py:
one scheduler hands out tasks one after the other, workers take the next when they are free, a step begins when the one
before has ended, and some of it is done by whoever started the fleet, alone. Lengths of recordings vary by a factor of
three (a tenth of them are three times as long as the median).
"""
import argparse
import heapq
import json
import math
import random
from typing import NamedTuple

SPREAD = math.log(3.0) / 1.2816  # Of lengths: the 90 % quantile of a normal distribution is 1.2816.
NUM_GROUPS = 5  # Of tiles that are adjusted at a time: those of grids, whatever their size.
INDEX_KEYFRAMES = 131072  # As python/waymark/fleet.py has them.
NUM_SEEKING_TASKS = 64
LINKS_PER_TILE = 4  # To neighbours, most of them of other recordings.


class Size(NamedTuple):
    recordings: int
    frames: int
    keyframes: int
    frame_s: float


class Step(NamedTuple):
    name: str
    tasks: list  # Seconds of each.
    alone_s: float = 0.0  # Of the one that started the fleet, while all workers wait.


def tiles_of(size, costs, rng):
    """Per recording how many keyframes, and so how many tiles."""
    keyframes = [size.keyframes * math.exp(rng.gauss(0.0, SPREAD)) for _ in range(size.recordings)]
    return keyframes, [math.ceil(count / costs["keyframes_per_tile"]) for count in keyframes]


def seconds_to_solve(costs, num_tiles):
    """By the power of the number that two sizes show."""
    (few, few_s), (many, many_s) = sorted((int(count), seconds) for count, seconds in costs["solve_s"].items())[-2:]
    return many_s * (num_tiles / many) ** (math.log(many_s / few_s) / math.log(many / few))


def seeking(keyframes, costs, num_workers):
    """All recordings ask one part of the index after the other; a worker opens each part once."""
    num_parts = math.ceil(sum(keyframes) / INDEX_KEYFRAMES)
    count = 1 + len(keyframes) // NUM_SEEKING_TASKS
    batches = [keyframes[first:first + count] for first in range(0, len(keyframes), count)]
    opening_s = costs["open_places_s_per_keyframe"] * sum(keyframes) / num_parts * min(1.0, num_workers / len(batches))
    return [opening_s + sum(batch) * costs["seek_s_per_keyframe"] for batch in batches] * num_parts


def steps_of(size, costs, num_workers, rng):
    keyframes, tiles = tiles_of(size, costs, rng)
    total, num_tiles = sum(keyframes), sum(tiles)
    frames_per_keyframe = size.frames / size.keyframes
    solve_s = seconds_to_solve(costs, num_tiles)
    matches = round(costs["pairs_per_tile"] * num_tiles)
    adjusting = [costs["adjust_s"]] * math.ceil(num_tiles / NUM_GROUPS)
    return [
        Step("map and cut", [count * (frames_per_keyframe * size.frame_s + costs["cut_s_per_keyframe"])
                             for count in keyframes]),
        Step("look for shared places", seeking(keyframes, costs, num_workers)),
        Step("verify and link", [costs["match_s"]] * matches, solve_s),
        *(Step("adjust", adjusting) for _ in range(NUM_GROUPS)),
        Step("fit links", [costs["refit_s"]] * (LINKS_PER_TILE * num_tiles), solve_s),
    ], total


def seconds_of(step, num_workers, task_s):
    """Until the last task has ended; the scheduler gives tasks out in turn, as workers are free."""
    free = [0.0] * num_workers
    given_s = 0.0
    for seconds in step.tasks:
        given_s += task_s
        begin = max(given_s, heapq.heappop(free))
        heapq.heappush(free, begin + seconds)
    return max(free) + step.alone_s


def simulate(size, costs, num_workers):
    """Per step how long it takes and what part of the workers' time is work; the keyframes of all."""
    steps, total = steps_of(size, costs, num_workers, random.Random(0))
    spent, work = {}, {}
    for step in steps:
        spent[step.name] = spent.get(step.name, 0.0) + seconds_of(step, num_workers, costs["task_s"])
        work[step.name] = work.get(step.name, 0.0) + sum(step.tasks)
    return {name: (spent[name], work[name] / (num_workers * spent[name])) for name in spent}, sum(work.values()), total


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("costs")
    parser.add_argument("--recordings", type=int, action="append")
    parser.add_argument("--workers", type=int, action="append")
    parser.add_argument("--frames", type=int, default=3000, help="of the median recording")
    parser.add_argument("--keyframes", type=int, default=500, help="of the median recording")
    parser.add_argument("--frame-s", type=float, default=0.012, help="processor time per frame (cpu_s by frames of summary.json)")
    options = parser.parse_args()
    with open(options.costs, encoding="utf-8") as file:
        costs = json.load(file)
    print("| recordings | workers | keyframes | core hours | hours | work | slowest step | places in a worker, GB | tiles, GB |")
    print("|---|---|---|---|---|---|---|---|---|")
    for recordings in options.recordings or (24, 1000, 20_000):
        for workers in options.workers or (2, 64, 1024):
            steps, work, total = simulate(Size(recordings, options.frames, options.keyframes, options.frame_s), costs, workers)
            hours = sum(seconds for seconds, _ in steps.values()) / 3600
            slowest = max(steps, key=lambda name: steps[name][0])
            print(f"| {recordings} | {workers} | {total:.3g} | {work / 3600:.3g} | {hours:.3g} | {work / 3600 / workers / hours:.2f} | "
                  f"{slowest}: {steps[slowest][0] / 3600:.3g} h, {steps[slowest][1]:.2f} | "
                  f"{costs['places_bytes_per_keyframe'] * min(total, INDEX_KEYFRAMES) / 1e9:.3g} | {costs['tile_bytes_per_keyframe'] * total / 1e9:.3g} |")


if __name__ == "__main__":
    main()
