"""Predicts normals from faces and neighbours; codec small stores differences from the prediction."""

import math
import struct


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
    """Returns the (chart, x, y) predicted for a unit vector."""
    x_last, y_last = encoding.x_codes - 1, encoding.y_codes - 1
    if encoding.family == "oct":
        length = abs(n[0]) + abs(n[1]) + abs(n[2])
        if length > 0.0:
            n = [component * (1.0 / length) for component in n]
        fold = max(-n[2], 0.0)
        return 0, code_of(n[0] + math.copysign(fold, n[0]), x_last - 1), code_of(n[1] + math.copysign(fold, n[1]), y_last - 1)
    if encoding.family == "zsign":
        return int(n[2] < 0.0), code_of(n[0], x_last - 1), code_of(n[1], y_last - 1)
    axis = max(range(3), key=lambda i: abs(n[i]))  # the first of equal components
    return 2 * axis + (n[axis] < 0.0), code_of(unwarp(n[(axis + 1) % 3]), x_last), code_of(unwarp(n[(axis + 2) % 3]), y_last)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def plus(a, b, scale=1.0):
    return tuple(p + q * scale for p, q in zip(a, b))


def minus(a, b):
    return tuple(p - q for p, q in zip(a, b))


def unit(v):
    square = dot(v, v)
    return tuple(component * (1.0 / math.sqrt(square)) for component in v) if square > 0.0 else tuple(v)


def bits_of(value):
    return struct.unpack("<Q", struct.pack("<d", value))[0]


FIRST_ERROR = 12 << 10


class NormalPredictor:
    """Mixes three guesses by their recent errors at similar vertices."""

    def __init__(self):
        self.memory = {}

    def predict(self, encoding, face_sum, triangles, neighbours, edges, opposite):
        """@param neighbours normals of the 0..2 earlier corners; edges from them to the vertex; opposite: a normal or None"""
        self.steps = 0.5 * encoding.y_codes
        face = unit(face_sum)
        surface = face
        if len(neighbours) == 1:
            surface = neighbours[0]
        if len(neighbours) == 2:
            surface = plus(*neighbours)
            surface = unit(minus(surface, opposite) if opposite else surface)
        self.guesses = face, surface, self.chord_guess(surface, neighbours, edges)
        apart = minus(face, surface)
        agreement = min((int(dot(apart, apart) * 4096.0).bit_length() + 1) // 2, 7)
        known = 0 if len(neighbours) < 2 else 2 if opposite else 1
        self.similar = agreement, known, min(max(triangles, 1), 4)
        errors, _ = self.memory.setdefault(self.similar, ([FIRST_ERROR] * 4, 0))
        mix = 0.0, 0.0, 0.0
        for guess, error in zip(self.guesses, errors):
            (weight,) = struct.unpack("<d", struct.pack("<Q", (1023 << 52) - (error << 43)))
            mix = plus(mix, guess, weight)
        self.mix = unit(mix)
        return guess_normal(encoding, self.mix)

    def chord_guess(self, guess, neighbours, edges):
        scales = [1.0 / dot(edge, edge) if dot(edge, edge) > 0.0 else 0.0 for edge in edges]
        for _ in range(2):
            for normal, edge, scale in reversed(list(zip(neighbours, edges, scales))):
                amount = dot(plus(guess, normal), edge) * scale
                guess = minus(guess, tuple(component * amount for component in edge))
        return unit(guess)

    def expected_error(self):
        errors, _ = self.memory[self.similar]
        return min(max((errors[3] >> 11) - 2, 0), 15)

    def learn(self, normal):
        errors, count = self.memory[self.similar]
        shift = min((count + 1).bit_length(), 4)
        errors = [e + (self.log_error(normal, guess) - e >> shift) for e, guess in zip(errors, (*self.guesses, self.mix))]
        self.memory[self.similar] = errors, min(count + 1, 7)

    def log_error(self, normal, guess):
        error = tuple(component * self.steps for component in minus(normal, guess))
        return (bits_of(dot(error, error) * 256.0 + 1.0) >> 42) - (1023 << 10)
