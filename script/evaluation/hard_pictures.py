# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The pictures of docs/hard-scenes.md, from simulated sequences: `script/docs pictures`."""
import cv2
import numpy as np

from .degrade import IMAGE_FLAWS
from .program import ROOT
from .simulated import simulate

FOLDER = ROOT / "docs/hard-scenes"
WORK = ROOT / "build/evaluate/hard_pictures"
WIDTH_PX, HEIGHT_PX = 480, 360
MAX_BYTES = 40_000
WALK = ("--motion", "loop", "--frames", 40, "--rate", 3)  # Few frames, so that little is rendered.
FRAME = 17  # With depth and with texture in it.


def frames_of(name, *arguments):
    folder = simulate(WORK / name, *arguments, "--setup", "mono")
    images = folder / "mav0/cam0/data"
    return sorted((images if images.is_dir() else folder / "images").glob("*.png"))


def picture(path, width=WIDTH_PX, height=HEIGHT_PX):
    return cv2.resize(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), (width, height),
                      interpolation=cv2.INTER_AREA)


def save(name, image):
    """At the best quality that is small enough."""
    for quality in range(90, 10, -5):
        _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
        if len(data) <= MAX_BYTES:
            break
    (FOLDER / f"{name}.jpg").write_bytes(data.tobytes())


def side_by_side(images):
    """Upright parts of images of the same view, with a line between them."""
    joined = images[0].copy()
    for i, image in enumerate(images):
        left = i * joined.shape[1] // len(images)
        joined[:, left:] = image[:, left:]
        if i:
            joined[:, left - 1:left + 1] = 255
    return joined


def strip(images):
    """Images after each other, small, from left to right and then down."""
    half = [cv2.resize(i, (WIDTH_PX // 2, HEIGHT_PX // 2), interpolation=cv2.INTER_AREA) for i in images]
    rows = [np.hstack(half[i:i + 2]) for i in range(0, len(half), 2)]
    return np.vstack(rows)


def draw_flaws(frames):
    clean = picture(frames[FRAME])
    for name, flaw in IMAGE_FLAWS.items():
        if name != "flicker":
            save(name, side_by_side([clean, flaw(clean, FRAME, 0, 3)]))
    jumps = sorted((IMAGE_FLAWS["flicker"](clean, 15 * i, 0, 3) for i in range(9)), key=np.mean)
    save("flicker", side_by_side(jumps[1::3]))
    near = [picture(f) for f in frames[FRAME:FRAME + 4]]
    save("black", strip([near[0], np.zeros_like(clean), np.zeros_like(clean), near[3]]))


def main():
    FOLDER.mkdir(exist_ok=True)
    draw_flaws(frames_of("apartment", "apartment", *WALK))
    for name, frame in (("blank", FRAME), ("corridor", FRAME), ("shop", 28)):
        save(name, picture(frames_of(name, name, *WALK)[frame]))
    save("walkers", picture(frames_of("walkers", "apartment", *WALK, "--walkers", 3)[FRAME]))
    sphere = ("--camera", "equirectangular", "--operator")
    save("operator", picture(frames_of("operator", "apartment", *WALK, *sphere)[FRAME], WIDTH_PX, WIDTH_PX // 2))
    turns = frames_of("turns", "room", "--motion", "turns_250", "--frames", 60, "--rate", 10, "--exposure", 8)
    save("turns", strip([picture(f) for f in turns[38:42]]))
    rest = frames_of("rest", "apartment", "--motion", "still", "--walkers", 1, "--frames", 40, "--rate", 10)
    save("rest", strip([picture(f) for f in rest[:40:10]]))
