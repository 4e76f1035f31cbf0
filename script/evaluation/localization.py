# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""How well images are found in a saved map, and how well a saved map is extended, judged by the files
that the program writes."""
import json
import pathlib
import shutil
import statistics
import sys
from typing import NamedTuple

from .program import PROGRAM, config_of, run
from .tables import list_of, table
from .trajectories import Truth, align, ate, errors, read_trajectory

SHOP, QUERY, FOREIGN = "sim_bookstore_mono", "sim_bookstore_query_mono", "stella_bookstore/map.msg"
# Sequence, set-up, and the number of its frames.
EXTENDED = (("euroc_mh01_stereo", "mono", 300), (SHOP, "mono", 1019), ("sim_house_rgbd", "rgbd", 503))


class Query(NamedTuple):
    """Images to be found, and where they were taken."""
    images: pathlib.Path
    truth: pathlib.Path
    config: pathlib.Path


class Found(NamedTuple):
    """What became of the images of a query. Errors are measured after aligning the map's own
    trajectory with its truth, not that of the images."""
    num_images: int
    num_localized: int
    median_m: float
    median_deg: float
    largest_m: float
    ms_per_image: float

    @property
    def share(self):
        return self.num_localized / self.num_images


def query_of(data_dir):
    folder = data_dir / QUERY
    return Query(folder / "images", folder / "groundtruth.txt", folder / "camchain.yaml")


def localize(map_file, alignment, query, out, *options):
    """Looks for images in a map; alignment is from the frame of the map to that of the truth."""
    shutil.rmtree(out, ignore_errors=True)
    run([PROGRAM, "localize", map_file, query.images, "-c", query.config, "-o", out, "--quiet", *options])
    summary = json.loads((out / "summary.json").read_text())
    found = errors(Truth(query.truth).pairs_with(read_trajectory(out / "trajectory.txt")), alignment)
    return Found(summary["frames"], summary["localized"], statistics.median(m for m, _ in found),
                 statistics.median(deg for _, deg in found), max(m for m, _ in found),
                 summary["tracking_ms"]["mean"])


def map_to_file(folder, map_file, out, *options):
    """Maps a sequence and saves the map."""
    shutil.rmtree(out, ignore_errors=True)
    run([PROGRAM, "run", folder, *config_of(folder), "--map-out", map_file, "-o", out, "--quiet",
         *options])


def alignment_with(trajectory, truth):
    """From the frame of a map without scale to that of the truth, by a trajectory in the map."""
    return align(Truth(truth).pairs_with(read_trajectory(trajectory)), True)


class Extension(NamedTuple):
    """A map of half a sequence that was extended by the other half, and one of the whole."""
    ate_m: float
    once_ate_m: float
    submaps: int
    coverage: float
    keyframes: int
    once_keyframes: int


def extend(source, setup, num_frames, work, seed=0):
    """ATE of all keyframes, with a break in the middle and without."""
    truth, half = Truth(source / "groundtruth.txt"), num_frames // 2
    options = ["--setup", setup, "--seed", seed]
    work.mkdir(parents=True, exist_ok=True)
    first, extended = work / "first.wmap", work / "extended.wmap"
    map_to_file(source, first, work / "first", "--frames", half, *options)
    map_to_file(source, extended, work / "extended", "--first", half, "--map-in", first, *options)
    map_to_file(source, work / "once.wmap", work / "once", *options)
    summaries = [json.loads((work / name / "summary.json").read_text()) for name in ("extended", "once")]
    ates = [ate(truth.pairs_with(read_trajectory(work / name / "keyframes.txt")), setup == "mono")
            for name in ("extended", "once")]
    return Extension(*ates, summaries[0]["submaps"], summaries[0]["coverage"],
                     *(s["keyframes"] for s in summaries))


def found_row(title, order, found):
    print(f"{title}, {order}: {found.num_localized} of {found.num_images}, {found.median_m:.4f} m",
          file=sys.stderr)
    return [title, order, f"{found.num_localized} of {found.num_images}", f"{found.median_m:.4f}",
            f"{found.median_deg:.2f}", f"{found.largest_m:.3f}", f"{found.ms_per_image:.1f}"]


def shop_maps(data_dir, work):
    """(what it is, map file, alignment) of our map of the shop and of one that stella_vslam made."""
    truth = data_dir / SHOP / "groundtruth.txt"
    map_to_file(data_dir / SHOP, work / "shop.wmap", work / "map")
    yield "map of the shop", work / "shop.wmap", alignment_with(work / "map/trajectory.txt", truth)
    if not (data_dir / FOREIGN).exists():
        return
    foreign = work / "foreign.wmap"
    run([PROGRAM, "import", data_dir / FOREIGN, "-o", foreign])
    run([PROGRAM, "export", foreign, "--format", "tum", "-o", work / "foreign.txt"])
    yield "imported map of a part", foreign, alignment_with(work / "foreign.txt", truth)


def query_rows(data_dir, work):
    for title, map_file, alignment in shop_maps(data_dir, work):
        for order in ("stream", "unordered"):
            options = [] if order == "stream" else ["--unordered"]
            found = localize(map_file, alignment, query_of(data_dir), work / "found", *options)
            yield found_row(title, order, found)


def extension_row(data_dir, name, setup, num_frames, work, seeds):
    runs = [extend(data_dir / name, setup, num_frames, work, seed) for seed in range(seeds)]
    ate_m, once_ate_m, ratio = (statistics.median(values) for values in zip(
        *((r.ate_m, r.once_ate_m, r.ate_m / r.once_ate_m) for r in runs)))
    print(f"{name}: {ate_m:.4f} m extended, {once_ate_m:.4f} m at once", file=sys.stderr)
    return [name, setup, f"{once_ate_m:.4f}", f"{ate_m:.4f}", f"{ratio:.2f}",
            f"{min(r.coverage for r in runs):.3f}", str(max(r.submaps for r in runs))]


def localization_table(data_dir, work, seeds):
    missing = [n for n in (SHOP, QUERY, *(name for name, *_ in EXTENDED))
               if not (data_dir / n / "groundtruth.txt").exists()]
    if missing:
        return "Not measured, for want of the sequences:\n\n" + list_of(dict.fromkeys(missing))
    work.mkdir(parents=True, exist_ok=True)
    found = table(["map", "images", "localized", "median m", "median deg", "largest m", "ms per image"],
                  list(query_rows(data_dir, work)))
    extended = table(["sequence", "set-up", "ATE m at once", "ATE m with a break", "ratio", "coverage",
                      "sub-maps"],
                     [extension_row(data_dir, *case, work / "extend", seeds) for case in EXTENDED])
    return ("Images of another camera, found in a saved map; errors after aligning the map's own trajectory:\n\n"
            f"{found}\n\nMaps of the first half, saved and extended by the second; medians over the seeds:\n\n"
            f"{extended}")
