# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Vectors and rotations as tuples: what comparing trajectories needs, without a library."""
import math


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b))


def scaled(factor, a):
    return tuple(factor * x for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def norm(a):
    return math.sqrt(dot(a, a))


def mean(vectors):
    return tuple(sum(column) / len(vectors) for column in zip(*vectors))


def turned(rotation, a):
    """A matrix, three rows, times a vector."""
    return tuple(dot(row, a) for row in rotation)


def transposed(rotation):
    return tuple(zip(*rotation))


def product(a, b):
    columns = transposed(b)
    return tuple(tuple(dot(row, column) for column in columns) for row in a)


def rotation_of(x, y, z, w):
    """Of a quaternion, of any length."""
    n = math.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / n, y / n, z / n, w / n
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))


def angle_deg(rotation):
    cosine = 0.5 * (rotation[0][0] + rotation[1][1] + rotation[2][2] - 1.0)
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


def largest_eigenvector(symmetric):
    """By Jacobi's rotations (Golub and Van Loan 2013, section 8.5)."""
    n = len(symmetric)
    a = [list(row) for row in symmetric]
    v = [[float(i == j) for j in range(n)] for i in range(n)]
    for _ in range(30):
        for p in range(n):
            for q in range(p + 1, n):
                if a[p][q] == 0.0:
                    continue
                theta = 0.5 * math.atan2(2.0 * a[p][q], a[q][q] - a[p][p])
                c, s = math.cos(theta), math.sin(theta)
                for k in range(n):
                    a[k][p], a[k][q] = c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]
                for k in range(n):
                    a[p][k], a[q][k] = c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]
                    v[k][p], v[k][q] = c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]
    best = max(range(n), key=lambda i: a[i][i])
    return [row[best] for row in v]


def best_rotation(sources, targets):
    """The rotation that turns centred sources nearest to centred targets (Horn 1987)."""
    s = [[sum(a[i] * b[j] for a, b in zip(sources, targets)) for j in range(3)] for i in range(3)]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = s
    w, x, y, z = largest_eigenvector(((xx + yy + zz, yz - zy, zx - xz, xy - yx),
                                      (yz - zy, xx - yy - zz, xy + yx, zx + xz),
                                      (zx - xz, xy + yx, yy - xx - zz, yz + zy),
                                      (xy - yx, zx + xz, yz + zy, zz - xx - yy)))
    return rotation_of(x, y, z, w)
