"""Predicts positions from the known points around them; codec small stores differences from the prediction."""

import struct

from ptk.normal_guess import bits_of, dot, minus, plus

ONE = 1 << 10  # of logarithms
MOST_CORNERS, MOST_GUESSES = 8, 12
WIDEST = 19
ACROSS_LIMITS = -0.09, -0.0025, 0.0025, 0.09, 0.36, 0.64
BETWEEN_LIMITS = -0.64, -0.36, -0.16, -0.04, 0.01, 0.25
FIRST_SLOPES = 0, 100, 40, 20, 0, 0, 0
TERMS = 40


def log2(x):
    return (bits_of(x) >> 42) - 1023 * ONE


def exp2(x):
    (value,) = struct.unpack("<d", struct.pack("<Q", min(max(x + 1023 * ONE, ONE), 2046 * ONE) << 42))
    return value


def clamped(value, low, high):
    return min(max(value, low), high)


def steps(begin, end):
    return tuple(float(q - p) for p, q in zip(begin, end))


def rounded(x):
    shifted = x + 0.5
    return int(shifted) - (float(int(shifted)) > shifted)


def level(log):
    return clamped((log + 4 * ONE) // ONE, 0, 39)


class PlacePredictor:
    def __init__(self):
        self.last, self.last_span = (0, 0, 0), (float(1 << 18),) * 3
        self.errors = {}  # per class of guesses: mean log of the relative square error, count
        self.terms = [[i * slope for i in range(TERMS)] for slope in FIRST_SLOPES]

    def predict(self, points, corners):
        """@param corners the triangles at the point, each as its next and previous point and the one across, or None"""
        self.guesses, known, near, neighbour = [], [], [], None
        self.spread, self.span = (0.0,) * 3, (0.0,) * 3
        for p, q, across in corners:
            if points[p].known != points[q].known:
                neighbour = p if points[p].known else q
            if not points[p].known or not points[q].known or len(known) == MOST_CORNERS:
                continue
            if not known:
                self.origin = points[p].place
            known.append((p, q))
            near.append([a + b for a, b in zip(points[p].widths, points[q].widths)])
            if across is not None and points[across].known:
                self.add(points, p, q, across, False)
        for i, (p, q) in enumerate(known):
            for r, s in known[i + 1 :]:
                if q == r and p != s:
                    self.add(points, p, s, q, True)
                elif s == p and q != r:
                    self.add(points, r, q, p, True)
        self.near = [sum(column) // len(near) for column in zip(*near)]
        self.kind = 1 if known else 0
        if self.guesses:
            place = self.mix()
        elif known:
            place = 0.0, 0.0, 0.0
            for p, q in known:
                a, b = steps(self.origin, points[p].place), steps(self.origin, points[q].place)
                place = plus(place, plus(a, b))
                self.span = tuple(max(s, abs(x)) for s, x in zip(self.span, minus(b, a)))
            place = tuple(x / (2.0 * len(known)) for x in place)
        else:
            self.origin = self.last if neighbour is None else points[neighbour].place
            self.span, place = self.last_span, (0.0,) * 3
        if known:
            self.last_span = self.span
        return [o + rounded(x) for o, x in zip(self.origin, place)]

    def add(self, points, p, q, o, between):
        if len(self.guesses) == MOST_GUESSES:
            return
        p, q, o = (steps(self.origin, points[n].place) for n in (p, q, o))
        u, v, w = minus(p, o), minus(q, o), minus(q, p)
        self.span = tuple(max(s, abs(a), abs(b), abs(c)) for s, a, b, c in zip(self.span, u, v, w))
        uv = dot(u, v)
        cosine, scale = uv * abs(uv), dot(u, u) * dot(v, v)
        angle = sum(cosine >= limit * scale for limit in (BETWEEN_LIMITS if between else ACROSS_LIMITS))
        self.guesses.append([plus(p, v), log2(dot(u, u) + dot(v, v) + 1.0), (between, angle, None)])

    def mix(self):
        for i, (place, size, (between, angle, _)) in enumerate(self.guesses):
            squares = [dot(a, a) for a in (minus(place, other[0]) for j, other in enumerate(self.guesses) if j != i)]
            if squares:
                apart = log2(min(squares) + 0.5) - size
                self.guesses[i][2] = between, angle, clamped((apart + 14 * ONE) // (3 * ONE), 0, 4)
        expected = [size + self.errors.setdefault(kind, (-3 * ONE, 0))[0] for _, size, kind in self.guesses]
        self.least = min(expected)
        total, weights = (0.0,) * 3, 0.0
        for (place, _, _), error in zip(self.guesses, expected):
            weight = exp2(-((3 * error) >> 1))
            weights += weight
            total = plus(total, place, weight)
        mean = tuple(x / weights for x in total)
        for place, _, _ in self.guesses:
            self.spread = tuple(max(s, abs(x)) for s, x in zip(self.spread, minus(place, mean)))
        return mean

    def models(self, axis):
        """Returns the name of the model of the error along the axis, or those of two."""
        if axis == 0:
            self.surprises, self.span_surprise = (0, 0), 0
        span = self.span[axis]
        self.span_bits = min(int(span).bit_length(), WIDEST)
        if not self.guesses:
            return (("position alone", self.kind, self.span_bits, self.span_surprise),)
        squares = dot(self.span, self.span)
        along = level(self.least + log2(span * span + squares * 2.0**-6) - log2(squares + 1.0))
        spread = min(int(2.0 * self.spread[axis]).bit_length(), WIDEST) if len(self.guesses) > 1 else self.span_bits
        near = self.near[axis]
        self.features = (min(len(self.guesses), 3) * 3 + axis, spread, min(near, 31), along, level(self.least), *self.surprises)
        self.estimate = sum(terms[feature] for terms, feature in zip(self.terms, self.features))
        return ("position", clamped(self.estimate // 128, 0, 45)), ("position near", min(near, 23), min(along // 2, 15))

    def learn_error(self, error):
        width = (~error if error < 0 else error).bit_length()
        if not self.guesses:
            self.span_surprise = 0 if width == 0 else 1 if width + 2 < self.span_bits else 2
            return
        off = (0 if error == 0 else width + 1) * 256 - self.estimate
        for terms, feature in zip(self.terms, self.features):
            terms[feature] += off >> 6
        self.surprises = clamped(off >> 8, -5, 5) + 6, self.surprises[0]

    def learn_place(self, place):
        self.last = place
        actual = steps(self.origin, place)
        for guess, size, kind in self.guesses:
            off = minus(guess, actual)
            mean, count = self.errors[kind]
            mean += (log2(dot(off, off) + 0.5) - size - mean) >> min((count + 1).bit_length(), 5)
            self.errors[kind] = mean, min(count + 1, 15)
