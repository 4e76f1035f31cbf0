# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""How far apart two calibrations of a camera project: their numbers need not agree, since focal length and
shape of a wide lens are interchangeable."""
import math
import re

GRID = 24
MAX_ANGLE = math.radians(80)
STEP = 1e-6


def first_camera(camchain):
    """Model, intrinsics, distortion model, coefficients and resolution of cam0 of a camchain."""
    text = camchain.split("cam1:")[0]
    word = lambda key: re.search(rf"{key}: (\S+)", text)[1]

    def numbers(key):
        found = re.search(rf"{key}: \[(.*?)\]", text)
        return [float(number) for number in found[1].split(",")] if found else []

    return (word("camera_model"), numbers("intrinsics"), word("distortion_model"),
            numbers("distortion_coeffs"), numbers("resolution"))


def on_plane(camera, x, y, z):
    """Where a unit direction meets the plane at distance 1 that the camera's model makes of it."""
    model, intrinsics, distortion, coefficients, _ = camera
    radius = math.hypot(x, y)
    if distortion == "equidistant":
        angle = math.atan2(radius, z)
        bent = angle + sum(k * angle**(2 * i + 3) for i, k in enumerate(coefficients))
        return x / radius * bent, y / radius * bent
    if model == "division":
        root = math.sqrt(z * z - 4 * coefficients[0] * radius * radius)
        return 2 * x / (z + root), 2 * y / (z + root)
    if model == "omni":
        z += intrinsics[0]
    elif model == "eucm":
        alpha, beta = intrinsics[:2]
        z = alpha * math.sqrt(beta * radius * radius + z * z) + (1 - alpha) * z
    elif model == "ds":
        xi, alpha = intrinsics[:2]
        shifted = xi + z
        z = alpha * math.hypot(radius, shifted) + (1 - alpha) * shifted
    x, y = x / z, y / z
    k1, k2, p1, p2 = (coefficients + 4 * [0.0])[:4]
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2 * r2
    return (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y)


def pixel(camera, direction):
    fu, fv, pu, pv = camera[1][-4:]
    x, y = on_plane(camera, *direction)
    return fu * x + pu, fv * y + pv


def turned(direction, turn):
    """By a small rotation vector, to second order."""
    cross = lambda a, b: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    once = cross(turn, direction)
    twice = cross(turn, once)
    return [d + a + 0.5 * b for d, a, b in zip(direction, once, twice)]


def seen(camera):
    """Directions all over the image, and their pixels."""
    pairs = []
    for i in range(-GRID, GRID + 1):
        for j in range(-GRID, GRID + 1):
            angle = MAX_ANGLE * math.hypot(i, j) / GRID
            if not 0 < angle <= MAX_ANGLE:
                continue
            scale = math.sin(angle) / math.hypot(i, j)
            direction = (scale * i, scale * j, math.cos(angle))
            try:
                at = pixel(camera, direction)
            except ValueError:
                continue
            if 0 <= at[0] < camera[4][0] and 0 <= at[1] < camera[4][1]:
                pairs.append((direction, at))
    return pairs


def solve(matrix, right):
    """A linear system of three, by Cramer's rule."""
    det = lambda m: sum(m[0][i] * (m[1][i - 2] * m[2][i - 1] - m[1][i - 1] * m[2][i - 2]) for i in range(3))
    columns = [[[right[r] if c == k else matrix[r][c] for c in range(3)] for r in range(3)] for k in range(3)]
    return [det(column) / det(matrix) for column in columns]


def pixels_apart(camchain, other):
    """Root mean square over the image of camera 0, after the rotation between both that fits best."""
    true, found = first_camera(camchain), first_camera(other)
    pairs = seen(true)

    def residuals(turn):
        differences = []
        for direction, at in pairs:
            differences += [a - b for a, b in zip(pixel(found, turned(direction, turn)), at)]
        return differences

    turn = [0.0, 0.0, 0.0]
    for _ in range(3):
        now = residuals(turn)
        slopes = [[(b - a) / STEP for a, b in zip(now, residuals([t + STEP * (i == k) for i, t in enumerate(turn)]))]
                  for k in range(3)]
        dot = lambda a, b: sum(x * y for x, y in zip(a, b))
        step = solve([[dot(a, b) for b in slopes] for a in slopes], [-dot(a, now) for a in slopes])
        turn = [t + s for t, s in zip(turn, step)]
    return math.sqrt(sum(each**2 for each in residuals(turn)) / len(pairs))
