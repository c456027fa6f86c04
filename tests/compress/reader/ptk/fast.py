"""Decodes pages of codec fast."""

import struct

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
    ("position_bits", "3B"), ("normal_bits", "2B"), ("coding", "9B"))


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


class FastCluster:
    def __init__(self, header, parts, charts):
        self.header, self.parts = header, parts
        self.cluster = PageCluster(record_of(header))
        self.charts = charts
        self.count = self.cluster.record["vertex_count"]

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

    def read_fields(self, bits):
        cluster, flags = self.cluster, self.header["flags"]
        if flags & HAS_UVS:
            cluster.uv_anchors = bits.take(32), bits.take(32)
            cluster.uv_bits = bits.take(5), bits.take(5)
        palette = self.header["normal_palette"]
        cluster.palette = [bits.take(cluster.normal_bits(self.charts)) for _ in range(palette)]
        cluster.positions = self.channel(bits, 0, self.header["position_bits"], self.originals)
        if flags & HAS_NORMALS:
            x_bits, y_bits = self.header["normal_bits"]
            chart_bits = cluster.normal_bits(self.charts) - x_bits - y_bits
            cluster.normals = self.channel(bits, 1, (index_bits(palette),) if palette else (y_bits, x_bits, chart_bits), {})
        if flags & HAS_UVS:
            cluster.uvs = self.channel(bits, 2, cluster.uv_bits, {})

    def channel(self, bits, number, widths, copies):
        """Returns the words of all vertices. @param copies maps a vertex to the one whose word it repeats"""
        total = sum(widths)
        coded = [v for v in range(1, self.count) if v not in copies]
        if total > WIDE:
            words = {v: bits.take(total) for v in [0] + coded}
            return [words[copies.get(v, v)] for v in range(self.count)]
        first = bits.take(total)
        codings = self.header["coding"][3 * number : 3 * number + len(widths)]
        lows = [[bits.take(coding & 63) for coding in codings] for _ in coded]
        residuals = [[0] * len(widths) for _ in coded]
        for f, coding in enumerate(codings):
            for i, high in enumerate(self.parts[RESIDUALS + (coding >> 6)].take(len(coded))):
                residuals[i][f] = lows[i][f] | high << (coding & 63)
        for _ in range(self.header["escapes"][number]):
            f, i, width = bits.take(2), bits.take(8), bits.take(6)
            residuals[i][f] = lows[i][f] | bits.take(width) << (codings[f] & 63)
        places = [sum(widths[:f]) for f in range(len(widths))]
        sums = dict(zip(coded, (sum(unzigzag(value) << place for value, place in zip(r, places)) for r in residuals)))
        words = [first]
        for v in range(1, self.count):
            p, q, o = (0 if g is None else words[g] for g in self.guesses[v])
            words.append(words[copies[v]] if v in copies else p + q - o + sums[v] & WORD)
        return words


def decode_page(page, geometries):
    """Returns the PageClusters of a page. @param geometries the geometry of each cluster"""
    parts = read_parts(page)
    clusters = [FastCluster(header, parts, NORMAL_ENCODINGS[geometry["normal_encoding"]].charts)
                for header, geometry in zip(read_headers(parts[HEADERS], len(geometries)), geometries)]
    bits = Bits(parts[FIELDS].take(len(parts[FIELDS].data)))
    for cluster in clusters:
        cluster.read_strips()
        cluster.read_fields(bits)
    if any(part.at != len(part.data) for part in parts) or (bits.at + 7) // 8 != len(parts[FIELDS].data):
        raise BadFile("a page does not use up its parts")
    return [cluster.cluster for cluster in clusters]
