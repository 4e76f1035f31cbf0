#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What each kind of task of a fleet costs: does all of them, one after the other, on maps of recordings.

usage: PYTHONPATH=build/release/python benchmarks/fleet_costs.py MAP... [--keyframes N] [--grid N]...

Prints JSON for benchmarks/fleet_simulation.py: seconds of processor time per keyframe, tile, pair or link, bytes per
keyframe, and how long the anchors of made-up grids of N tiles take, which is the only step that nobody shares.
"""
import argparse
import contextlib
import hashlib
import json
import pathlib
import random
import statistics
import tempfile
import time

import dask.distributed
from waymark import _waymark, fleet

NUM_IDLE_TASKS = 1000


def timed(function, *arguments):
    start = time.process_time()
    result = function(*arguments)
    return result, time.process_time() - start


def mean(values):
    return statistics.fmean(values) if values else 0.0


def costs_of_linking(url, contents, shared, costs):
    """Looks for shared places and links the tiles in `contents` and `shared`."""
    tiles = contents["tiles"]
    num_keyframes = sum(tile["num_keyframes"] for tile in tiles)
    places, seconds = timed(_waymark._Places, url, contents, 0, len(tiles))
    costs["open_places_s_per_keyframe"] = seconds / num_keyframes
    alike = [timed(places.alike, i) for i in range(len(tiles))]
    costs["seek_s_per_keyframe"] = sum(seconds for _, seconds in alike) / num_keyframes
    pairs = _waymark._pairs([(i, found) for i, (found, _) in enumerate(alike)])
    spent = []
    for a, b, queries in pairs:
        first, second = sorted((a, b))
        part = fleet.part_of(contents, [first, second], [])
        (result, _), seconds = timed(fleet.match, url, part, (int(a > b), int(b > a), queries), 0)
        spent.append(seconds)
        if result["found"]:
            link, landmarks = result["found"]
            contents["links"].append({**link, "a": first, "b": second})
            shared[landmarks[0], landmarks[1]] = landmarks
    costs["match_s"] = mean(spent)
    costs["pairs_per_tile"] = len(pairs) / len(tiles)
    costs["links_per_tile"] = len(contents["links"]) / len(tiles)


def costs_of_adjusting(url, contents, shared, costs):
    tiles, touching, spent = contents["tiles"], fleet.links_by_tile(contents), []

    def landmarks_of(links):
        return [shared[tiles[link["a"]]["origin"], tiles[link["b"]]["origin"]] for link in links]

    for group in _waymark._schedule(contents):
        results = []
        for tile in group:
            links = touching.get(tile, [])
            around = sorted({tile, *(link["a"] for link in links), *(link["b"] for link in links)})
            part = fleet.part_of(contents, around, links)
            (result, _), seconds = timed(fleet.adjust, url, part, around.index(tile), landmarks_of(links))
            spent.append(seconds)
            results.append((tile, result["checksum"]))
        for tile, checksum in results:
            tiles[tile]["checksum"] = checksum
    costs["adjust_s"] = mean(spent)
    costs["refit_s"] = mean([timed(fleet.refit, url, fleet.part_of(contents, [link["a"], link["b"]], [link]),
                                   landmarks_of([link]))[1] for link in contents["links"]])


def grid_of(tile, recordings, side):
    """Contents of tiles in a square, each linked with those beside it, by steps that are off a little."""
    rng = random.Random(0)
    names = [hashlib.sha256(str(i).encode()).hexdigest() for i in range(side * side)]
    place = {i: k for k, i in enumerate(sorted(range(len(names)), key=names.__getitem__))}
    links = []
    for i in range(len(names)):
        for beside, step in ((i + 1, (-10.0, 0.0)), (i + side, (0.0, -10.0))):
            if beside >= len(names) or (beside == i + 1 and beside % side == 0):
                continue
            sign = 1 if place[i] < place[beside] else -1
            shift = [sign * (value + rng.gauss(0, 0.05)) for value in (*step, 0.0)]
            links.append({"a": min(place[i], place[beside]), "b": max(place[i], place[beside]), "is_border": False,
                          "num_shared": 300, "b_from_a": [0, 0, 0, 1, *shift, 1.0]})
    tiles = [{**tile, "origin": name, "checksum": name, "places": name} for name in sorted(names)]
    return {"recordings": recordings, "tiles": tiles, "links": sorted(links, key=lambda link: (link["a"], link["b"]))}


def seconds_per_idle_task():
    """Of the thread that hands tasks out."""
    with contextlib.ExitStack() as stack:
        cluster = stack.enter_context(dask.distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None))
        client = stack.enter_context(dask.distributed.Client(cluster))
        start = time.monotonic()
        client.gather([client.submit(abs, i, pure=False) for i in range(NUM_IDLE_TASKS)])
        return (time.monotonic() - start) / NUM_IDLE_TASKS


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("maps", nargs="+")
    parser.add_argument("--keyframes", type=int, default=fleet.NUM_KEYFRAMES)
    parser.add_argument("--grid", type=int, action="append")
    options = parser.parse_args()
    costs = {"keyframes_per_tile": options.keyframes}
    with tempfile.TemporaryDirectory() as url:
        fleet.Workspace(url)
        cut = [timed(fleet.map_and_cut, url, path, [], options.keyframes) for path in options.maps]
        parts = sorted((result for result, _ in cut), key=lambda one: one["contents"]["recordings"][0]["checksum"])
        contents = _waymark._append([one["contents"] for one in parts])
        shared = {(a, b): [a, b, landmarks] for one in parts for a, b, landmarks in one["shared"]}
        num_keyframes = sum(tile["num_keyframes"] for tile in contents["tiles"])
        costs["cut_s_per_keyframe"] = sum(seconds for _, seconds in cut) / num_keyframes
        for name, suffix, key in (("tile", "wmap", "checksum"), ("places", "places", "places")):
            total = sum((pathlib.Path(url) / f"tiles/{tile[key]}.{suffix}").stat().st_size for tile in contents["tiles"])
            costs[f"{name}_bytes_per_keyframe"] = total / num_keyframes
        costs_of_linking(url, contents, shared, costs)
        contents = _waymark._solve(contents)
        costs_of_adjusting(url, contents, shared, costs)
        costs["solve_s"] = {}
        for count in options.grid or (1000, 5000):
            grid = grid_of(contents["tiles"][0], contents["recordings"], round(count ** 0.5))
            costs["solve_s"][len(grid["tiles"])] = timed(_waymark._solve, grid)[1]
        costs["task_s"] = seconds_per_idle_task()
    print(json.dumps(costs, indent=1))


if __name__ == "__main__":
    main()
