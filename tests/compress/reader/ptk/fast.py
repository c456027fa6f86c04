"""Decodes pages of codec fast."""

import struct

from ptk.grids import Grid
from ptk.normals import NORMAL_ENCODINGS
from ptk.payload import PageCluster
from ptk.records import HAS_NORMALS, HAS_UVS, BadFile, Bits, Cursor, Record, index_bits, unzigzag
from ptk.zstd import decompress

PART_COUNT = 9
FIELDS, HEADERS, BITS, RUNS, REUSED_VERTICES, RESIDUALS = range(6)  # the first residual class; the others follow
WORD = (1 << 64) - 1
WIDE = 57  # maximum width of predicted words; wider ones are stored as they are

HEADER = Record(
    ("anchor", "3I"), ("material_slot", "I"), ("normal_anchor", "2H"), ("normal_palette", "H"),
    ("triangles", "B"), ("vertices", "B"), ("strips", "B"), ("flags", "B"), ("creases", "B"), ("escapes", "3B"),
    ("position_bits", "3B"), ("normal_bits", "2B"), ("coding", "8B"),
    ("grid", "B"), ("neighbours", "2B"), ("shared", "2B"))


def signed(number, bits):
    number &= (1 << bits) - 1
    return number - (1 << bits) if number >> bits - 1 else number


class PartCursor(Cursor):
    """A part of a page, read sequentially."""

    def take_bits(self, count):
        """Reads bits that start at a byte boundary and are padded to one."""
        number = int.from_bytes(self.take((count + 7) // 8), "little")
        return [number >> i & 1 for i in range(count)]


def read_parts(page):
    sizes = struct.unpack_from(f"<{2 * PART_COUNT}I", page)
    at = 8 * PART_COUNT
    parts = []
    for size, disk_size in zip(sizes[::2], sizes[1::2]):
        data = page[at : at + disk_size]
        parts.append(PartCursor(data if size == disk_size else decompress(data, size)))
        at += disk_size
    if at != len(page):
        raise BadFile("a page is not as long as its parts")
    return parts


def read_headers(part, count):
    """Returns the headers of a page's clusters, with the differences between consecutive ones resolved."""
    columns = part.take(count * HEADER.layout.size)
    headers = HEADER.read_all(b"".join(columns[i::count] for i in range(count)))
    anchor, slot, normal_anchor = [0, 0, 0], 0, [0, 0]
    for header in headers:
        anchor = [a + unzigzag(d) for a, d in zip(anchor, header["anchor"])]
        slot ^= header["material_slot"]
        normal_anchor = [a + unzigzag(d) for a, d in zip(normal_anchor, header["normal_anchor"])]
        header["anchor"] = tuple(signed(a, 32) for a in anchor)
        header["normal_anchor"] = tuple(signed(a, 16) for a in normal_anchor)
        header["material_slot"] = slot
    return headers


def record_of(header):
    record = {name: header[name] for name in
              ("material_slot", "anchor", "normal_anchor", "normal_palette", "position_bits", "normal_bits", "flags")}
    return record | {"vertex_count": header["vertices"] + 1, "triangle_count": header["triangles"] + 1,
                     "strip_count": header["strips"] + 1}


def words_to_coordinates(words, widths, anchors):
    """Returns the coordinates of all fields of words."""
    places = [sum(widths[:f]) for f in range(len(widths))]
    return [[(word >> place & (1 << width) - 1) + anchor for place, width, anchor in zip(places, widths, anchors)]
            for word in words]


class FastCluster:
    def __init__(self, header, parts, geometry):
        self.header, self.parts, self.geometry = header, parts, geometry
        self.cluster = PageCluster(record_of(header))
        self.charts = NORMAL_ENCODINGS[geometry["normal_encoding"]].charts
        self.count = self.cluster.record["vertex_count"]
        self.grid = Grid(header["grid"], header["triangles"] + 1) if header["grid"] else None
        self.frames = [None] * 3  # widths and anchors of each channel

    def read_topology(self, grids):
        """@param grids the grid clusters of the page before this one"""
        if self.grid:
            self.read_grid(grids)
        else:
            self.read_strips()

    def read_grid(self, grids):
        """Takes the strips of the grid. Sets vertex_of, which maps points to vertices."""
        cluster = self.cluster
        self.grid.diagonals = grids[-1].grid.diagonals if grids else 0
        if self.grid.has_diagonals:
            bits = self.parts[BITS].take_bits(self.grid.columns * self.grid.rows)
            self.grid.diagonals = sum(bit << i for i, bit in enumerate(bits))
        cluster.starts, cluster.lefts, corners = self.grid.strips()
        self.vertex_of, self.originals, self.guesses = {}, {}, []
        for corner in corners:
            cluster.fresh.append(int(corner not in self.vertex_of))
            vertex = self.vertex_of.setdefault(corner, len(self.vertex_of))
            if not cluster.fresh[-1]:
                cluster.reused_vertices.append(vertex)
        if len(self.grid.points) != self.count or len(self.vertex_of) != self.count:
            raise BadFile("a grid does not have the vertices of its cluster")
        if self.header["creases"] or sum(cluster.starts) != cluster.record["strip_count"]:
            raise BadFile("a grid does not have the strips of its cluster")

    def read_strips(self):
        """Reads the triangle strips. Sets guesses[v] = (p, q, o), the vertices (or None) that predict new vertex v as
        p + q - o."""
        cluster, parts = self.cluster, self.parts
        triangles, strips = cluster.record["triangle_count"], cluster.record["strip_count"]
        cluster.lefts = parts[BITS].take_bits(triangles)
        cluster.fresh = parts[BITS].take_bits(triangles + 2 * strips)
        creases = parts[BITS].take_bits(self.count) if self.header["creases"] else [0] * self.count
        for run in parts[RUNS].take(strips):
            cluster.starts += [1] + [0] * (run - 1)
        if len(cluster.starts) != triangles or sum(cluster.fresh) != self.count:
            raise BadFile("strips do not hold the triangles and vertices of their cluster")
        self.guesses = [None] * self.count
        self.originals = {}
        self.corners = iter(cluster.fresh)
        self.creases, self.last_old, self.next_vertex = creases, 0, 0
        last, before = None, None  # triangle, corner
        for starts, left in zip(cluster.starts, cluster.lefts):
            if starts:
                a = self.corner((before, None, None))
                b = self.corner((a, None, None))
                last = a, b, self.corner((b, None, None))
            else:
                a, b, c = last
                p, q, o = (a, c, b) if left else (c, b, a)
                last = p, q, self.corner((p, q, o))
            before = last[2]

    def corner(self, guess):
        if next(self.corners):
            vertex = self.next_vertex
            self.next_vertex += 1
            self.guesses[vertex] = guess
            if self.creases[vertex]:
                self.originals[vertex] = self.old()
            return vertex
        self.cluster.reused_vertices.append(self.old())
        return self.cluster.reused_vertices[-1]

    def old(self):
        self.last_old = self.last_old + unzigzag(self.parts[REUSED_VERTICES].take(1)[0]) & 255
        return self.last_old

    def read_fields(self, bits, grids):
        """Reads the values of all vertices. @param grids the grid clusters of the page before this one"""
        cluster, flags = self.cluster, self.header["flags"]
        if flags & HAS_UVS:
            cluster.uv_anchors = bits.take(32), bits.take(32)
            cluster.uv_bits = bits.take(5), bits.take(5)
        palette = self.header["normal_palette"]
        cluster.palette = [bits.take(cluster.normal_bits(self.charts)) for _ in range(palette)]
        shift = self.geometry["anchor_shift"]
        places = [o + (a << shift) for o, a in zip(self.geometry["origin"], self.header["anchor"])]
        cluster.positions = self.channel(bits, grids, 0, self.header["position_bits"], places)
        if flags & HAS_NORMALS:
            x_bits, y_bits = self.header["normal_bits"]
            chart_bits = cluster.normal_bits(self.charts) - x_bits - y_bits
            if palette:
                cluster.normals = self.channel(bits, grids, 1, (index_bits(palette),), (0,))
            else:
                x, y = self.header["normal_anchor"]
                cluster.normals = self.channel(bits, grids, 1, (y_bits, x_bits, chart_bits), (2 * y, 2 * x, 0))
        if flags & HAS_UVS:
            anchors = [signed(a, 32) for a in cluster.uv_anchors]
            cluster.uvs = self.channel(bits, grids, 2, cluster.uv_bits, anchors)

    def channel(self, bits, grids, number, widths, anchors):
        """Returns the words of all vertices."""
        total = sum(widths)
        copies = self.originals if number == 0 else {}  # vertex -> the one whose word it repeats
        self.frames[number] = widths, anchors
        if self.grid and total <= WIDE:
            return self.grid_words(bits, grids, number, widths, anchors)
        coded = [v for v in range(1, self.count) if v not in copies]
        if total > WIDE:
            words = {v: bits.take(total) for v in [0] + coded}
            return [words[copies.get(v, v)] for v in range(self.count)]
        words = [bits.take(total)]
        sums = dict(zip(coded, self.residuals(bits, number, widths, len(coded))))
        for v in range(1, self.count):
            p, q, o = (0 if g is None else words[g] for g in self.guesses[v])
            words.append(words[copies[v]] if v in copies else p + q - o + sums[v] & WORD)
        return words

    def grid_words(self, bits, grids, number, widths, anchors):
        """Returns the words of all vertices of a grid. Its points are coded row by row."""
        places = [sum(widths[:f]) for f in range(len(widths))]
        words = {}  # by point
        for border, (neighbour, shared) in enumerate(zip(self.header["neighbours"], self.header["shared"])):
            if not shared >> number & 1:
                continue
            other = grids[-neighbour]
            there = [other.vertex_of[point] for point in other.grid.opposite_border(border)]
            old_widths, old_anchors = other.frames[number]
            old_words = (other.cluster.positions, other.cluster.normals, other.cluster.uvs)[number]
            coordinates = words_to_coordinates([old_words[v] for v in there], old_widths, old_anchors)
            for point, values in zip(self.grid.border(border), coordinates):
                words[point] = sum(v - a << place for v, a, place in zip(values, anchors, places)) & WORD
        if not words:
            words[0, 0] = bits.take(sum(widths))
        coded = [point for point in self.grid.points if point not in words]
        for point, residual in zip(coded, self.residuals(bits, number, widths, len(coded))):
            p, q, o = (0 if g is None else words[g] for g in self.grid.guess(*point))
            words[point] = p + q - o + residual & WORD
        by_vertex = {vertex: words[point] for point, vertex in self.vertex_of.items()}
        return [by_vertex[v] for v in range(self.count)]

    def residuals(self, bits, number, widths, count):
        """Returns the residual words of a channel."""
        codings = self.header["coding"][3 * number : 3 * number + len(widths)]
        lows = [[bits.take(coding & 63) for coding in codings] for _ in range(count)]
        residuals = [[0] * len(widths) for _ in range(count)]
        for f, coding in enumerate(codings):
            for i, high in enumerate(self.parts[RESIDUALS + (coding >> 6)].take(count)):
                residuals[i][f] = lows[i][f] | high << (coding & 63)
        for _ in range(self.header["escapes"][number]):
            f, i, width = bits.take(2), bits.take(8), bits.take(6)
            residuals[i][f] = lows[i][f] | bits.take(width) << (codings[f] & 63)
        places = [sum(widths[:f]) for f in range(len(widths))]
        return [sum(unzigzag(value) << place for value, place in zip(r, places)) for r in residuals]


def decode_page(page, geometries):
    """Returns the PageClusters of a page. @param geometries the geometry of each cluster"""
    parts = read_parts(page)
    clusters = [FastCluster(header, parts, geometry)
                for header, geometry in zip(read_headers(parts[HEADERS], len(geometries)), geometries)]
    bits = Bits(parts[FIELDS].take(len(parts[FIELDS].data)))
    grids = []
    for cluster in clusters:
        cluster.read_topology(grids)
        cluster.read_fields(bits, grids)
        if cluster.grid:
            grids.append(cluster)
    if any(part.at != len(part.data) for part in parts) or (bits.at + 7) // 8 != len(parts[FIELDS].data):
        raise BadFile("a page does not use up its parts")
    return [cluster.cluster for cluster in clusters]
