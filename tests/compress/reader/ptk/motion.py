"""Decodes the section of rigid motion."""

import math
import struct

from ptk.records import BadFile, Bits

SCALES = ((), ((0, 0),), ((0, 0), (1, 1), (2, 2)), ((0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1)),
          tuple((column, row) for column in range(3) for row in range(3)))
UNIFORM, SYMMETRIC = 1, 3


class MotionBytes:
    def __init__(self, data):
        self.data = data
        self.at = 0

    def take(self, layout):
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values

    def count(self):
        number, shift = 0, 0
        while True:
            (byte,) = self.take("B")
            number |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return number

    def channels(self, number):
        """Returns a width, a base and a step per channel."""
        widths = self.take(f"{number}B")
        exponent = self.take("h")[0] if any(widths) else 0
        return [(width, base, 2.0**exponent) for width, base in zip(widths, self.take(f"{number}d"))]


def read_rotation(bits, width):
    """Returns a quaternion w, x, y, z."""
    largest, negative = bits.take(2), bits.take(1)
    middle = (1 << width - 1) - 1
    parts = [None if i == largest else (bits.take(width) / middle - 1) * math.sqrt(0.5) for i in range(4)]
    rest = math.sqrt(max(1 - sum(part * part for part in parts if part is not None), 0))
    parts[largest] = -rest if negative else rest
    length = math.sqrt(sum(part * part for part in parts))
    return [part / length for part in parts]


def read_scale(entries, values, form):
    """Returns the matrix as columns."""
    scale = [[float(row == column) for row in range(3)] for column in range(3)]
    for (column, row), value in zip(entries, values):
        scale[column][row] = value
        if form == UNIFORM:
            scale[1][1] = scale[2][2] = value
        if form == SYMMETRIC:
            scale[row][column] = value
    return scale


def read_track(section):
    """Returns flags and keys: time, translation, rotation (w, x, y, z), scale (columns)."""
    (flags,) = section.take("B")
    count = section.count()
    if count > 1 and flags & 4:
        first, last = section.take("2d")
        times = [first + (last - first) * (i / (count - 1)) for i in range(count - 1)] + [last]
    else:
        times = section.take(f"{count}d") if count > 1 else (0.0,)
    if any(a >= b for a, b in zip(times, times[1:])):
        raise BadFile("times of keys do not ascend")
    translation = section.channels(3)
    rotation_form, scale_form = flags >> 3 & 3, flags >> 5
    rotation, width = [1.0, 0.0, 0.0, 0.0], 0
    if rotation_form == 1:
        rotation = list(section.take("4d"))
    elif rotation_form == 2:
        (width,) = section.take("B")
    scale = section.channels(len(SCALES[scale_form]))
    key_bits = sum(channel[0] for channel in translation + scale) + (3 + 3 * width if width else 0)
    keys = []
    for time in times:
        bits = Bits(bytes(section.take(f"{(key_bits + 7) // 8}B")))
        move = [base + bits.take(n) * step for n, base, step in translation]
        turn = read_rotation(bits, width) if width else rotation
        factors = [base + bits.take(n) * step for n, base, step in scale]
        keys.append((time, move, turn, read_scale(SCALES[scale_form], factors, scale_form)))
    return flags & 3, keys


def read_error(section):
    return struct.unpack("<f", b"\0\0" + bytes(section.take("2B")))[0]


def read_motion(data):
    """Returns tracks, instances (number, track, inner track or None, pivot or None, error) and cameras (number, track,
    error)."""
    if not data:
        return [], [], []
    section = MotionBytes(data)
    counts = [section.count() for _ in range(3)]
    tracks = [read_track(section) for _ in range(counts[0])]
    instances, cameras, number = [], [], -1
    for _ in range(counts[1]):
        number += 1 + section.count()
        (flags,) = section.take("B")
        track = section.count()
        inner = section.count() if flags == 2 else None
        pivot = section.take("3f") if flags == 1 else None
        instances.append((number, track, inner, pivot, read_error(section)))
    number = -1
    for _ in range(counts[2]):
        number += 1 + section.count()
        cameras.append((number, section.count(), read_error(section)))
    if section.at != len(data):
        raise BadFile("motion has bytes behind its end")
    return tracks, instances, cameras
