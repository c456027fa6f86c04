"""Predicts normals from faces; codec small stores differences from the prediction."""

import math


def sum_of_face_normals(places, triangles):
    """Returns per vertex the sum of its faces' area-weighted normals, added in the order of the triangles."""
    sums = [(0.0, 0.0, 0.0)] * len(places)
    for triangle in triangles:
        a, b, c = (places[corner] for corner in triangle)
        (ux, uy, uz), (vx, vy, vz) = ([float(q - p) for p, q in zip(a, other)] for other in (b, c))
        normal = uy * vz - vy * uz, uz * vx - vz * ux, ux * vy - vx * uy
        for corner in triangle:
            sums[corner] = tuple(s + n for s, n in zip(sums[corner], normal))
    return sums


def code_of(t, last):
    return min(max(int((t + 1.0) * 0.5 * last + 0.5), 0), last)


def unwarp(w):
    """Approximates the inverse of w(t) = t (803/1024 + c t^2), c = sqrt(1/2) - 803/1024."""
    slope, cubic = 803 / 1024, 0.70710678118654752440 - 803 / 1024
    square = w * w
    t = w * (1.2752 + square * (0.16 + square * 0.23))
    return t - (t * (slope + cubic * t * t) - w) / (slope + 3.0 * cubic * t * t)


def guess_normal(encoding, n):
    """Returns the (chart, x, y) predicted for a direction, which need not be of unit length."""
    x_last, y_last = encoding.x_codes - 1, encoding.y_codes - 1
    length = abs(n[0]) + abs(n[1]) + abs(n[2]) if encoding.family == "oct" else math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    if length > 0.0:
        n = [component * (1.0 / length) for component in n]
    if encoding.family == "oct":
        fold = max(-n[2], 0.0)
        return 0, code_of(n[0] + math.copysign(fold, n[0]), x_last - 1), code_of(n[1] + math.copysign(fold, n[1]), y_last - 1)
    if encoding.family == "zsign":
        return int(n[2] < 0.0), code_of(n[0], x_last - 1), code_of(n[1], y_last - 1)
    axis = max(range(3), key=lambda i: abs(n[i]))  # the first of equal components
    return 2 * axis + (n[axis] < 0.0), code_of(unwarp(n[(axis + 1) % 3]), x_last), code_of(unwarp(n[(axis + 2) % 3]), y_last)
