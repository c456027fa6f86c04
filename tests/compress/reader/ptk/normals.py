"""Normal encodings."""

import math
from dataclasses import dataclass

from ptk.records import to_float32


@dataclass(frozen=True)
class NormalEncoding:
    """A normal encoding. Decoding rounds every operation to a 32-bit float."""

    family: str
    charts: int
    x_codes: int
    y_codes: int

    def decode(self, chart, x, y):
        return getattr(self, "decode_" + self.family)(*self.canonical(chart, x, y))

    def canonical(self, chart, x, y):
        """Returns the chart that contains the normal, and x and y clamped to their range."""
        if self.family == "axis":
            chart, x, y = self.fold(chart, x, y)
        chart = min(chart, self.charts - 1)
        return chart, min(max(x, 0), self.x_codes - 1), min(max(y, 0), self.y_codes - 1)

    def code(self, chart, x, y):
        return (chart * self.x_codes + x) * self.y_codes + y

    def unfold(self, normal, chart):
        """Inverse of fold(): returns the normal in the plane of cube face `chart`, or None if that is not adjacent to
        the normal's face."""
        face, x, y = normal
        if face == chart:
            return normal
        if self.family != "axis" or face // 2 == chart // 2:
            return None
        codes, along_x = self.x_codes, face // 2 == (chart // 2 + 1) % 3
        height = y if along_x else x
        distance = height if chart & 1 else codes - 1 - height
        beyond = -1 - distance if face & 1 else codes + distance
        return (chart, beyond, x) if along_x else (chart, y, beyond)

    def fold(self, chart, x, y):
        """Maps codes that extend beyond cube face `chart` onto the adjacent face that contains the normal."""
        codes, axis, sign = self.x_codes, chart >> 1, chart & 1
        for number, (own, other) in enumerate(((x, y), (y, x))):
            if 0 <= own < codes:
                continue
            distance = min(own - codes if own >= codes else -own - 1, codes - 1)
            height = distance if sign else codes - 1 - distance
            face = 2 * ((axis + 1 + number) % 3) + (own < 0)
            other = min(max(other, 0), codes - 1)
            return (face, other, height) if number == 0 else (face, height, other)
        return chart, x, y

    def decode_zsign(self, chart, x, y):
        nx = to_float32(to_float32(2 * x * to_float32(1 / 32766)) - 1)
        ny = to_float32(to_float32(2 * y * to_float32(1 / 65534)) - 1)
        squared = to_float32(to_float32(nx * nx) + to_float32(ny * ny))
        if squared >= 1:
            length = to_float32(math.sqrt(squared))
            return to_float32(nx / length), to_float32(ny / length), 0.0
        nz = to_float32(math.sqrt(to_float32(1 - squared)))
        return nx, ny, -nz if chart else nz

    def decode_axis(self, chart, x, y):
        scale = to_float32(1 / (self.x_codes - 1))
        cubic = to_float32(math.sqrt(0.5) - 803 / 1024)

        def warp(code):
            t = to_float32((2 * code - (self.x_codes - 1)) * scale)
            return to_float32(t * to_float32(803 / 1024 + to_float32(cubic * to_float32(t * t))))

        first, second = warp(x), warp(y)
        squared = to_float32(to_float32(first * first) + to_float32(second * second))
        along = to_float32(math.sqrt(max(to_float32(1 - squared), 0.0)))
        axis = chart >> 1
        normal = [0.0, 0.0, 0.0]
        normal[axis] = -along if chart & 1 else along
        normal[(axis + 1) % 3], normal[(axis + 2) % 3] = first, second
        return tuple(normal)

    def decode_oct(self, _, x, y):
        half = self.x_codes // 2 - 1
        scale = to_float32(1 / half)
        nx, ny = to_float32((x - half) * scale), to_float32((y - half) * scale)
        nz = to_float32(to_float32(1 - abs(nx)) - abs(ny))
        fold = max(-nz, 0.0)
        nx, ny = (math.copysign(1.0, n) * to_float32(abs(n) - fold) for n in (nx, ny))
        squared = to_float32(to_float32(to_float32(nx * nx) + to_float32(ny * ny)) + to_float32(nz * nz))
        length = to_float32(math.sqrt(squared))
        return to_float32(nx / length), to_float32(ny / length), to_float32(nz / length)


NORMAL_ENCODINGS = (
    NormalEncoding("zsign", 2, 32768, 65536),
    NormalEncoding("axis", 6, 26753, 26753), NormalEncoding("axis", 6, 1671, 1671), NormalEncoding("axis", 6, 103, 103),
    NormalEncoding("oct", 1, 65536, 65536), NormalEncoding("oct", 1, 4096, 4096), NormalEncoding("oct", 1, 1024, 1024),
    NormalEncoding("oct", 1, 256, 256), NormalEncoding("axis", 6, 25, 25))
