# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""All recorded sequences as one: no place of one may be taken for a place of another."""
import collections
import shutil
import subprocess
from typing import NamedTuple

from .program import map_sequence
from .tables import list_of, table
from .trajectories import nanoseconds

WIDTH, HEIGHT, FOCAL = 544, 232, 458.0
CAMCHAIN = f"""cam0:
  camera_model: pinhole
  intrinsics: [{FOCAL}, {FOCAL}, {WIDTH / 2 - 0.5}, {HEIGHT / 2 - 0.5}]
  distortion_model: none
  resolution: [{WIDTH}, {HEIGHT}]
"""
STEP_S = 0.05


class Piece(NamedTuple):
    """A sequence, and the focal length in pixels in the middle of its images. All images are scaled to
    one focal length and cropped to what the narrowest camera sees. Pieces of the same place may
    be joined."""
    name: str
    images: str
    focal: float
    place: str


PIECES = (
    Piece("sim_bookstore_mono", "mav0/cam0/data/*.png", 458.0, "shop"),
    Piece("kitti_03_mono", "image_0/*.png", 721.5, "road"),
    Piece("tum_fr1_rpy_rgbd", "rgb/*.png", 517.0, "desk"),
    Piece("sim_atrium_360", "video.mp4", 1280 / 6.2832, "atrium"),
    Piece("euroc_mh01_stereo", "mav0/cam0/data/*.png", 458.0, "machines"),
    Piece("sim_house_rgbd", "rgb/*.png", 537.0, "flat"),
    Piece("kitti_00_stereo", "image_0/*.png", 718.9, "town"),
    Piece("sim_warehouse_fisheye_stereo", "mav0/cam0/data/*.png", 191.0, "warehouse"),
    Piece("sim_track_stereo", "image_0/*.png", 707.1, "track"),
    Piece("sim_bookstore_query_mono", "images/*.png", 420.0, "shop"),
)


def add_images(piece, data, images, first):
    """Appends the images of a piece to a folder; how many."""
    pattern = str(data / piece.name / piece.images)
    source = ["-pattern_type", "glob", "-i", pattern] if "*" in pattern else ["-i", pattern]
    scale = FOCAL / piece.focal
    subprocess.run(["ffmpeg", "-v", "error", *source, "-fps_mode", "passthrough", "-vf",
                    f"scale=iw*{scale:.5f}:ih*{scale:.5f}:flags=area,crop={WIDTH}:{HEIGHT},format=gray",
                    "-start_number", str(first), str(images / "%06d.png")], check=True)
    return len(list(images.iterdir())) - first


def join_all(data, work):
    """Writes all pieces one after another; the piece of each frame."""
    folder = work / "all_as_one"
    shutil.rmtree(folder, ignore_errors=True)
    images = folder / "images"
    images.mkdir(parents=True)
    piece_of = []
    for piece in (p for p in PIECES if (data / p.name).is_dir()):
        piece_of += [piece] * add_images(piece, data, images, len(piece_of))
    (folder / "times.txt").write_text("".join(f"{1.0 + STEP_S * i:.9f}\n" for i in range(len(piece_of))))
    (folder / "camchain.yaml").write_text(CAMCHAIN)
    return folder, piece_of


def join_table(data, work):
    folder, piece_of = join_all(data, work)
    run = map_sequence(folder, work / "all_as_one_out", "mono")
    index_of = {nanoseconds(f"{1.0 + STEP_S * i:.9f}"): i for i in range(len(piece_of))}
    rows, false_joins = [], []
    for number, trajectory in enumerate(run.trajectories):
        counts = collections.Counter(piece_of[index_of[stamp]] for stamp in trajectory)
        rows.append([str(number), ", ".join(f"{p.name} {n}" for p, n in counts.items())])
        if len({piece.place for piece in counts}) > 1:
            frames = sorted((index_of[s], piece_of[index_of[s]].name) for s in trajectory)
            changes = [b for a, b in zip(frames, frames[1:]) if a[1] != b[1]]
            false_joins.append(f"sub-map {number} from frame " +
                               ", ".join(f"{i} ({name})" for i, name in changes))
    text = (f"All sequences as one, {len(piece_of)} frames of one size, mono: "
            f"{len(false_joins)} false joins, {run.summary['loops']} loops\n\n" +
            table(["sub-map", "frames"], rows))
    return text + ("\n\n" + list_of(false_joins) if false_joins else "")
