# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""How the steps of mapping grow with the map: simulated towns at the level of features, measured by
benchmarks/town_benchmark.cc. Times are of the processor, as multiples of those of the smallest map."""
import json
import sys

from .program import ROOT, run
from .tables import table

BENCHMARK = ROOT / "build/release/benchmarks/waymark_town_benchmark"
SIZES = (1000, 3000, 10000, 30000)
MOST_ADJUSTED = 10000  # Adjusting more takes hours.
MEMORY = {"map_kb": "{}: map and index", "places_kb": "{}: index of places", "peak_kb": "{}: peak beyond the map",
          "file_kb": "{}: file"}

LOOPS = {"true_plausible": "true ones that are plausible", "false_plausible": "false ones that are plausible",
         "true_on": "true ones believed", "false_on": "false ones believed", "ate_open_m": "ATE in m without loops",
         "ate_all_m": "with all of them", "ate_true_m": "with the true ones", "ate_chosen_m": "with those believed",
         "ate_closed_true_m": "50 true ones closed one by one", "ate_closed_m": "and 20 false ones among them"}


def measure(size):
    """Figures by step: milliseconds of one iteration and counters. A process for each size, so that
    the memory of one is not that of another."""
    steps = ".*" if size <= MOST_ADJUSTED else "(one/.*|all/[^a].*|all/apply.*)"
    text = run([BENCHMARK, f"--benchmark_filter=^{steps}/{size}(/|$)", "--benchmark_format=json"])
    return {"/".join(step["name"].split("/")[:2]): step for step in json.loads(text)["benchmarks"]}


def milliseconds(time):
    return f"{time:.0f}" if time >= 100 else f"{time:.3g}"


def time_rows(sizes, measured, kind):
    """Milliseconds at the smallest size, then how many times as long; of steps over all of the map per keyframe."""
    rows = []
    for step, first in measured[0].items():
        if not step.startswith(kind):
            continue
        ratios = []
        for size, steps in zip(sizes, measured):
            parts = size / sizes[0] if kind == "all/" else 1.0
            ratios.append(f"{steps[step]['cpu_time'] / first['cpu_time'] / parts:.2f}" if step in steps else "")
        rows.append([step.removeprefix(kind), milliseconds(first["cpu_time"]), *ratios])
    return rows


def memory_rows(measured):
    return [[title.format(step.split("/")[1]), *(f"{steps[step][key]:.1f}" if step in steps else "" for steps in measured)]
            for step, first in measured[0].items() for key, title in MEMORY.items() if key in first]


def loop_rows(measured):
    """Of steps that choose among true and false loops."""
    rows = []
    for key, title in LOOPS.items():
        values = [next((step[key] for step in steps.values() if key in step), None) for steps in measured]
        if any(value is not None for value in values):
            rows.append([title, *("" if value is None else f"{value:.3g}" for value in values)])
    return rows


def large_table(only=None):
    sizes = sorted(int(o) for o in only or () if o.isdigit()) or list(SIZES)
    measured = []
    for size in sizes:
        measured.append(measure(size))
        print(f"{size} keyframes: measured", file=sys.stderr)
    header = ["step", f"ms at {sizes[0]}", *(f"{size}" for size in sizes)]
    return (f"Steps over all of a map: time per keyframe as a multiple of that at {sizes[0]} keyframes; 1 is linear:\n\n" +
            table(header, time_rows(sizes, measured, "all/")) +
            "\n\nSteps about one place: time as a multiple of that of the same map; 1 does not depend on the map:\n\n" +
            table(header, time_rows(sizes, measured, "one/")) +
            "\n\n500 true loops and 200 false ones, in a town whose loops are open:\n\n" +
            table(["what", *(f"{size}" for size in sizes)], loop_rows(measured)) +
            "\n\nMemory in kB per keyframe of 300 features:\n\n" +
            table(["what", *(f"{size}" for size in sizes)], memory_rows(measured)))
