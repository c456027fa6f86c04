"""Decodes the streams of clusters in resident form."""

import math
import struct
from dataclasses import dataclass

from ptk.normals import NORMAL_ENCODINGS
from ptk.records import CHART_SHIFT, MIXED_CHARTS, BadFile, index_bits, to_float32


@dataclass
class Mesh:
    """A decoded geometry: its clusters are concatenated, and vertex indices are relative to the geometry."""

    lattice: list
    positions: list
    normals: list  # (0, 0, 0) in flat clusters
    uvs: list  # (0, 0) in clusters without texture coordinates
    triangles: list
    slots: list  # material slot per triangle


def read_triangles(bits, cluster):
    """Returns the triangles of a cluster as vertex indices relative to the cluster."""
    count, vertex_count = cluster["triangle_count"], cluster["vertex_count"]
    restart = [bits.take(1) for _ in range(count)]
    left = [bits.take(1) for _ in range(count)]
    if restart[0] != 1 or sum(restart) != cluster["strip_count"]:
        raise BadFile("restart bits do not fit the number of strips")
    corner_count = count + 2 * sum(restart)
    fresh = [bits.take(1) for _ in range(corner_count)]
    if sum(fresh) != vertex_count:
        raise BadFile("the bits of new vertices do not add up to the vertex count")
    width = index_bits(vertex_count)
    numbers = iter(range(vertex_count))
    corners = iter([next(numbers) if is_fresh else None for is_fresh in fresh])
    corners = iter([bits.take(width) if corner is None else corner for corner in corners])
    triangles = []
    for starts, turns_left in zip(restart, left):
        if starts:
            triangle = (next(corners), next(corners), next(corners))
        else:
            a, b, c = triangles[-1]
            triangle = (a, c, next(corners)) if turns_left else (c, b, next(corners))
        if max(triangle) >= vertex_count:
            raise BadFile("a corner names a vertex that does not exist")
        triangles.append(triangle)
    return triangles


def read_lattice(bits, cluster, geometry):
    base = [o + (a << geometry["anchor_shift"]) for o, a in zip(geometry["origin"], cluster["anchor"])]
    widths = cluster["position_bits"]
    return [tuple(b + bits.take(w) for b, w in zip(base, widths)) for _ in range(cluster["vertex_count"])]


def read_normals(bits, cluster, geometry):
    if geometry["normal_encoding"] >= len(NORMAL_ENCODINGS):
        raise BadFile("an unknown encoding of normals")
    encoding = NORMAL_ENCODINGS[geometry["normal_encoding"]]
    (x_bits, y_bits), (x_anchor, y_anchor) = cluster["normal_bits"], cluster["normal_anchor"]

    def read_one():
        y = 2 * y_anchor + bits.take(y_bits)
        x = 2 * x_anchor + bits.take(x_bits)
        if cluster["flags"] & MIXED_CHARTS:
            chart = bits.take(index_bits(encoding.charts))
        else:
            chart = cluster["flags"] >> CHART_SHIFT & 7
        return encoding.decode(chart, x, y)

    count, palette_count = cluster["vertex_count"], cluster["normal_palette"]
    if palette_count == 0:
        return [read_one() for _ in range(count)]
    palette = [read_one() for _ in range(palette_count)]
    width = index_bits(palette_count)
    return [palette[bits.take(width)] for _ in range(count)]


def uv_of(code, encoding, exponent):
    if encoding == 0:
        return to_float32(code * math.ldexp(1.0, exponent))
    if encoding == 1:
        return to_float32(code / 65535.0)
    magnitude = struct.unpack("<e", struct.pack("<H", min(abs(code), 31743)))[0]
    return -magnitude if code < 0 else magnitude


def read_uvs(bits, cluster, geometry):
    anchors = bits.take_signed(32), bits.take_signed(32)
    widths = bits.take(5), bits.take(5)
    return [
        tuple(uv_of(anchor + bits.take(width), geometry["uv_encoding"], exponent)
              for anchor, width, exponent in zip(anchors, widths, geometry["uv_exponent"]))
        for _ in range(cluster["vertex_count"])]
