# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Sequences made worse as recordings are, at levels 1 (mild) to 3 (severe). The cameras of a frame are
treated alike, but that each has its own noise; depth stays. Every draw follows from what it is for, so
that a frame does not depend on those before it and two runs write the same bits."""
import math

import cv2
import numpy as np

from .splice import Part, splice

LEVELS = (1, 2, 3)
DARK_CONTRAST = (0.4, 0.2, 0.1)
DARK_NOISE = (3.0, 4.0, 5.0)  # Grey values.
DARK_FLOOR = 16.0  # What a sensor shows without light.
FLICKER_FACTOR = (1.5, 2.5, 4.0)  # And one by it.
FLICKER_FRAMES = 15  # From one jump to the next.
BLUR_PX = (5, 9, 15)
BLUR_FRAMES = 10  # In one direction.
FLAT_CONTRAST = (0.7, 0.5, 0.3)
FLAT_SMOOTHED = (25.0, 50.0, 90.0)  # Steps of grey up to these go.
FLAT_DIAMETER_PX, FLAT_SIGMA_PX = 9, 5.0
OCCLUDED = (0.15, 0.3, 0.45)  # Of the view.
NUM_THINGS = 5
THING_TEXELS = 48
THING_SPEED_PX = (6.0, 3.0)  # To the side and down, per frame, at most.
BLACK_FRAMES = (3, 8, 15)
BLACK_EVERY = 60
JPEG_QUALITY = (25, 12, 6)


def draws(*key):
    """Random numbers of their own for each key, which is of whole numbers."""
    return np.random.default_rng(key)


def grey_values(values):
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def dark(image, frame, camera, level):
    """Little light: hardly any contrast, and the noise of the sensor."""
    noise = draws(1, frame, camera).normal(0.0, DARK_NOISE[level - 1], image.shape)
    return grey_values(DARK_FLOOR + DARK_CONTRAST[level - 1] * image.astype(np.float32) + noise)


def flicker(image, frame, _camera, level):
    """The exposure jumps by a factor; what is too bright is cut off."""
    widest = math.log(FLICKER_FACTOR[level - 1])
    factor = math.exp(draws(2, frame // FLICKER_FRAMES).uniform(-widest, widest))
    return grey_values(factor * image.astype(np.float32))


def blur(image, frame, _camera, level):
    """Motion blur: the mean along a line."""
    length = BLUR_PX[level - 1]
    angle = draws(3, frame // BLUR_FRAMES).uniform(0.0, math.pi)
    centre = length // 2
    reach = np.rint(centre * np.array([math.cos(angle), math.sin(angle)])).astype(int)
    line = np.zeros((length, length), np.float32)
    cv2.line(line, tuple(map(int, centre - reach)), tuple(map(int, centre + reach)), 1.0)
    return cv2.filter2D(image, -1, line / line.sum())


def flat(image, _frame, _camera, level):
    """Detail goes, then contrast: few corners are left (bilateral filter, Tomasi and Manduchi 1998)."""
    smooth = cv2.bilateralFilter(image, FLAT_DIAMETER_PX, FLAT_SMOOTHED[level - 1], FLAT_SIGMA_PX)
    return grey_values(128.0 + FLAT_CONTRAST[level - 1] * (smooth.astype(np.float32) - 128.0))


def occlude(image, frame, _camera, level):
    """Things with texture cross the view, each at a speed of its own, and come back on the other side."""
    height, width = image.shape[:2]
    side = round(math.sqrt(OCCLUDED[level - 1] * height * width / NUM_THINGS))
    occluded = image.copy()
    for thing in range(NUM_THINGS):
        rng = draws(4, thing)
        texels = rng.integers(0, 256, (THING_TEXELS, THING_TEXELS)).astype(np.uint8)
        start, speed = rng.uniform(0.0, 1.0, 2), rng.uniform(-1.0, 1.0, 2) * THING_SPEED_PX
        left = int(start[0] * width + speed[0] * frame) % (width + side) - side
        top = int(start[1] * height + speed[1] * frame) % (height + side) - side
        texture = cv2.resize(cv2.GaussianBlur(texels, (0, 0), 1.0), (side, side))
        seen = occluded[max(top, 0):top + side, max(left, 0):left + side]
        patch = texture[max(-top, 0):, max(-left, 0):][:seen.shape[0], :seen.shape[1]]
        seen[:] = patch if image.ndim == 2 else patch[:, :, None]
    return occluded


def compress(image, _frame, _camera, level):
    """What JPEG at a low quality leaves."""
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY[level - 1]])
    return cv2.imdecode(data, cv2.IMREAD_UNCHANGED)


# From (image, frame, camera, level) to the worse image.
IMAGE_FLAWS = {f.__name__: f for f in (dark, flicker, blur, flat, occlude, compress)}


def degrade_images(flaw, sequence, level, folder):
    """The whole sequence with each image through one of IMAGE_FLAWS."""
    def write(source, target, frame, camera):
        image = IMAGE_FLAWS[flaw](cv2.imread(str(source), cv2.IMREAD_UNCHANGED), frame, camera, level)
        cv2.imwrite(str(target), image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return splice([Part(sequence, 0, len(sequence))], folder, write)


def skip(sequence, level, folder):
    """Every 2nd, 3rd or 4th frame only."""
    return splice([Part(sequence, 0, len(sequence), step=level + 1)], folder)


def black(sequence, level, folder):
    """The last frames of each 60 are black."""
    num_black = BLACK_FRAMES[level - 1]
    parts = []
    for first in range(0, len(sequence), BLACK_EVERY):
        turn = min(first + BLACK_EVERY - num_black, len(sequence))
        end = min(first + BLACK_EVERY, len(sequence))
        parts.append(Part(sequence, first, turn))
        parts.append(Part(sequence, turn, end, is_black=True))
    return splice(parts, folder)


def degrade(flaw, sequence, level, folder):
    """Writes the sequence with a flaw, and returns its frames."""
    if flaw in IMAGE_FLAWS:
        return degrade_images(flaw, sequence, level, folder)
    return {"skip": skip, "black": black}[flaw](sequence, level, folder)


FLAWS = ("dark", "flicker", "blur", "flat", "occlude", "skip", "black", "compress")
