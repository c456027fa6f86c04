#!/usr/bin/env python3
"""Reads baked files (.ptk) of codec none, written from docs/baked_format.md alone; Python's standard library and nothing else.

    ptk_reader.py FILE.ptk                  prints counts, boxes and a checksum of each geometry
    ptk_reader.py FILE.ptk --expect DUMP    also compares everything decoded with a dump (see compare())

Exit codes: 0 fine, 1 the dump differs, 3 not a file this reader understands. The two hashes of a file are not checked:
the standard library has no XXH3.
"""

import argparse
import array
import math
import struct
import sys
import zlib
from dataclasses import dataclass

VERSION = 4
MAGIC = b"PTK\x89\r\n\x1a\0"
HEADER_BYTES = 512
DISK_FORM_HEADER_BYTES = 192
NONE = 0xFFFFFFFF

WORLD_SPACE, LOD_LEVEL = 1, 2  # geometry flags
HAS_NORMALS, HAS_UVS, MIXED_CHARTS, CHART_SHIFT = 1, 2, 4, 3  # cluster flags


class BadFile(Exception):
    """The file is not what the format's description says."""


class Record:
    """A record of fixed size; fields are (name, struct letters), several letters give a tuple."""

    def __init__(self, *fields):
        self.fields = fields
        self.layout = struct.Struct("<" + "".join(letters for _, letters in fields))

    def read_all(self, data):
        return [self._named(values) for values in self.layout.iter_unpack(data)]

    def _named(self, values):
        out, at = {}, 0
        for name, letters in self.fields:
            count = len(struct.unpack("<" + letters, bytes(struct.calcsize("<" + letters))))
            out[name] = values[at] if count == 1 else values[at : at + count]
            at += count
        return out


GEOMETRY = Record(
    ("first_cluster", "Q"), ("payload_offset", "Q"), ("payload_bytes", "Q"), ("origin", "3q"),
    ("max_position_error", "d"), ("position_error_bound", "d"),
    ("cluster_count", "I"), ("triangle_count", "I"), ("vertex_count", "I"),
    ("step_mantissa", "I"), ("step_exponent", "i"), ("anchor_shift", "I"), ("uv_exponent", "2i"),
    ("bounds_lo", "3f"), ("bounds_hi", "3f"),
    ("max_normal_error_degrees", "f"), ("mean_normal_error_degrees", "f"), ("max_uv_error", "f"),
    ("flags", "I"), ("class_clusters", "8I"), ("name", "2I"), ("normal_encoding", "I"), ("uv_encoding", "I"),
    ("slot_count", "I"), ("requirements", "I"))
CLUSTER = Record(
    ("payload_offset", "I"), ("first_triangle", "I"), ("first_vertex", "I"), ("material_slot", "I"),
    ("anchor", "3i"), ("normal_anchor", "2h"), ("vertex_count", "H"), ("normal_palette", "H"),
    ("triangle_count", "B"), ("restart_count", "B"), ("position_bits", "3B"), ("normal_bits", "2B"), ("flags", "B"))
MATERIAL = Record(
    ("flags", "I"), ("albedo", "3f"), ("alpha_mask", "I"), ("shadow_alpha_mask", "I"),
    ("albedo_texture", "I"), ("name", "2I"))
INSTANCE = Record(("world_from_object", "12f"), ("geometry", "I"), ("first_slot", "I"))
MASK = Record(
    ("first_word", "Q"), ("width", "I"), ("height", "I"), ("wrap", "I"), ("reserved", "I"),
    ("uv_scale", "2f"), ("uv_offset", "2f"))
TEXTURE = Record(
    ("first_byte", "Q"), ("width", "I"), ("height", "I"), ("wrap", "I"), ("codec", "I"),
    ("uv_scale", "2f"), ("uv_offset", "2f"), ("psnr_db", "f"), ("reserved", "I"), ("name", "2I"))
CAMERA = Record(
    ("world_from_camera", "12d"), ("fov_degrees", "d"), ("screen_window", "4d"), ("projection", "I"),
    ("has_screen_window", "I"), ("width_px", "I"), ("height_px", "I"), ("film_name", "2I"))
SUMMARY = Record(
    ("source_triangles", "Q"), ("dropped_triangles", "Q"), ("unused_triangles", "Q"), ("source_vertices", "Q"),
    ("merged_vertices", "Q"), ("collapsed_triangles", "Q"), ("bounds_lo", "3d"), ("bounds_hi", "3d"),
    ("precision_value", "d"), ("precision_kind", "I"), ("world_step_mantissa", "I"), ("world_step_exponent", "i"),
    ("purpose", "I"), ("stream_bits", "4Q"), ("left_out", "Q"))

REQUIREMENT = Record(
    ("stream", "I"), ("reason", "I"), ("geometries", "I"), ("reserved", "I"),
    ("triangles", "Q"), ("source_bytes", "Q"), ("stored_bits", "Q"))

LOD_LEVEL_RECORD = Record(
    ("first_group", "Q"), ("first_link", "Q"), ("triangles", "Q"), ("base", "I"), ("level", "I"), ("geometry", "I"),
    ("group_count", "I"), ("error", "f"), ("reserved", "I"))
LOD_GROUP = Record(("center", "3f"), ("radius", "f"), ("error", "f"), ("level", "I"))
LOD_LINK = Record(("group", "I"), ("generating_group", "I"))

TREE = Record(
    ("first_node", "Q"), ("node_count", "I"), ("depth", "I"), ("origin", "3q"), ("step_mantissa", "I"),
    ("step_exponent", "i"), ("geometry", "I"), ("reserved", "I"))
NODE = Record(
    ("origin", "3i"), ("exponents", "H"), ("ray_classes", "B"), ("first_triangle", "B"), ("first_child", "I"),
    ("cluster", "I"), ("children", "8B"), ("lo", "24B"), ("hi", "24B"))
INNER_CHILD = 255

# In the order of the section table; None: bytes.
SECTIONS = (
    ("geometries", GEOMETRY), ("clusters", CLUSTER), ("payload", None), ("materials", MATERIAL),
    ("instances", INSTANCE), ("masks", MASK), ("mask_words", Record(("word", "I"))), ("textures", TEXTURE),
    ("texture_bytes", None), ("cameras", CAMERA), ("strings", None), ("summary", SUMMARY),
    ("material_slots", Record(("material", "I"))), ("requirements", REQUIREMENT),
    ("lod_levels", LOD_LEVEL_RECORD), ("lod_groups", LOD_GROUP), ("lod_links", LOD_LINK), ("trees", TREE), ("nodes", NODE))


def index_bits(count):
    """Bits that number `count` things: ceil(log2 count)."""
    return (count - 1).bit_length()


def to_float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


class Bits:
    """Fields packed least significant bit first."""

    def __init__(self, data):
        self.value = int.from_bytes(data, "little")
        self.at = 0

    def take(self, width):
        field = (self.value >> self.at) & ((1 << width) - 1)
        self.at += width
        return field

    def take_signed(self, width):
        field = self.take(width)
        return field - (1 << width) if field >> (width - 1) else field


@dataclass
class Mesh:
    """One decoded geometry: its clusters one after another, vertex numbers counting through them."""

    lattice: list
    positions: list
    normals: list  # (0, 0, 0) in flat clusters
    uvs: list  # (0, 0) in clusters without
    triangles: list
    slots: list  # per triangle, of materials


def read_triangles(bits, cluster):
    """The cluster's triangles as local vertex numbers."""
    count, vertex_count = cluster["triangle_count"], cluster["vertex_count"]
    restart = [bits.take(1) for _ in range(count)]
    left = [bits.take(1) for _ in range(count)]
    if restart[0] != 1 or sum(restart) != cluster["restart_count"]:
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


@dataclass(frozen=True)
class NormalEncoding:
    """Decodes normals; arithmetic is that of 32-bit floats, each operation rounded."""

    family: str
    charts: int
    x_codes: int
    y_codes: int

    def decode(self, chart, x, y):
        if self.family == "axis":
            chart, x, y = self.fold(chart, x, y)
        chart = min(chart, self.charts - 1)
        x, y = min(max(x, 0), self.x_codes - 1), min(max(y, 0), self.y_codes - 1)
        return getattr(self, "decode_" + self.family)(chart, x, y)

    def fold(self, chart, x, y):
        """From the cross of a face and its neighbours to the face that holds the normal."""
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
    NormalEncoding("oct", 1, 256, 256))


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


def rgb_of_565(number):
    red, green, blue = number >> 11, number >> 5 & 63, number & 31
    return red << 3 | red >> 2, green << 2 | green >> 4, blue << 3 | blue >> 2


def bc1_colours(first, second):
    a, b = rgb_of_565(first), rgb_of_565(second)
    if first > second:
        return a, b, [(2 * x + y + 1) // 3 for x, y in zip(a, b)], [(x + 2 * y + 1) // 3 for x, y in zip(a, b)]
    return a, b, [(x + y + 1) // 2 for x, y in zip(a, b)], (0, 0, 0)


def read_texels(texture, data):
    """All texels from the top, three values each."""
    width, height, codec = texture["width"], texture["height"], texture["codec"]
    if codec == 0:
        return list(data[: 3 * width * height])
    if codec == 1:
        return [data[3 * number + c] for number in data[768 : 768 + width * height] for c in range(3)]
    if codec == 2:
        low, high = data[0:3], data[3:6]
        levels = [((code >> 6, 3), (code >> 2 & 15, 15), (code & 3, 3)) for code in data[6 : 6 + width * height]]
        return [(low[c] * (n - q) + high[c] * q + n // 2) // n for texel in levels for c, (q, n) in enumerate(texel)]
    texels = []
    for y in range(height):
        for x in range(width):
            block = 8 * (y // 4 * ((width + 3) // 4) + x // 4)
            colours = bc1_colours(*struct.unpack_from("<HH", data, block))
            texels += colours[data[block + 4 + y % 4] >> 2 * (x % 4) & 3]
    return texels


class BakedFile:
    """A file's records, and its geometries decoded on demand."""

    def __init__(self, data):
        if len(data) < 16 or data[:8] != MAGIC:
            raise BadFile("no baked file: the magic bytes are missing")
        version, header_bytes = struct.unpack_from("<II", data, 8)
        if version != VERSION:
            raise BadFile(f"format version {version}; this reader knows version {VERSION}")
        if header_bytes == DISK_FORM_HEADER_BYTES:
            raise BadFile("a file in disk form (codec fast or small); this reader knows codec none")
        if header_bytes != HEADER_BYTES or len(data) < HEADER_BYTES or struct.unpack_from("<Q", data, 16) != (len(data),):
            raise BadFile("the header's sizes are not the file's")
        (section_count,) = struct.unpack_from("<I", data, 40)
        if section_count != len(SECTIONS):
            raise BadFile(f"{section_count} sections instead of {len(SECTIONS)}")
        self.sections = {}
        end = HEADER_BYTES
        for number, (name, record) in enumerate(SECTIONS):
            offset, size, record_bytes, _ = struct.unpack_from("<QQII", data, 48 + 24 * number)
            if offset % 64 != 0 or offset < end or offset + size > len(data):
                raise BadFile(f"section {name} lies outside its place")
            if record_bytes != (1 if record is None else record.layout.size):
                raise BadFile(f"records of section {name} have {record_bytes} bytes")
            if any(data[end:offset]):
                raise BadFile(f"bytes before section {name} are not zero")
            end = offset + size
            content = data[offset:end]
            self.sections[name] = content if record is None else record.read_all(content)
        if (end + 63) // 64 * 64 != len(data) or any(data[end:]) or any(self.sections["payload"][-8:]):
            raise BadFile("the file or its payload does not end with zeros as it should")

    def text(self, ref):
        offset, size = ref
        return self.sections["strings"][offset : offset + size].decode("utf-8")

    def clusters(self, geometry):
        first = geometry["first_cluster"]
        return self.sections["clusters"][first : first + geometry["cluster_count"]]

    def instance_materials(self, instance):
        first, count = instance["first_slot"], self.sections["geometries"][instance["geometry"]]["slot_count"]
        return [slot["material"] for slot in self.sections["material_slots"][first : first + count]]

    def levels(self, base):
        return [level for level in self.sections["lod_levels"] if level["base"] == base]

    def cut(self, base, threshold):
        """Clusters, as (geometry, cluster of it), that stand for a geometry where errors up to `threshold` are allowed."""
        levels = self.levels(base)
        groups = self.sections["lod_groups"][levels[0]["first_group"]:]
        chosen = []
        for level in levels:
            geometry = self.sections["geometries"][level["geometry"]]
            for number in range(geometry["cluster_count"]):
                link = self.sections["lod_links"][level["first_link"] + number]
                made = 0.0 if link["generating_group"] == NONE else groups[link["generating_group"]]["error"]
                if groups[link["group"]]["error"] > threshold >= made:
                    chosen.append((level["geometry"], number))
        return chosen

    def check_levels(self, meshes):
        """That levels hold the triangles that they say, and that where level 0 is closed, so is the cut at each level's
        error."""
        geometries = self.sections["geometries"]
        for base, geometry in enumerate(geometries):
            levels = self.levels(base)
            if levels and geometry["flags"] & LOD_LEVEL:
                raise BadFile("a level of detail has levels")
            for number, level in enumerate(levels):
                if level["level"] != number or bool(geometries[level["geometry"]]["flags"] & LOD_LEVEL) != (number > 0):
                    raise BadFile("levels of detail are not in order")
            was_closed = bool(levels) and self.is_closed(self.cut(base, 0.0), meshes)
            for level in levels:
                chosen = self.cut(base, level["error"])
                triangles = sum(self.clusters(geometries[g])[c]["triangle_count"] for g, c in chosen)
                if triangles > level["triangles"]: # a cut may be coarser: groups have smaller errors than the level
                    raise BadFile("a cut has more triangles than the level of its error")
                if was_closed and not self.is_closed(chosen, meshes):
                    raise BadFile("a cut through levels of a closed surface is open")

    def is_closed(self, chosen, meshes):
        count = {}
        for number, c in chosen:
            mesh, cluster = meshes[number], self.clusters(self.sections["geometries"][number])[c]
            first = cluster["first_triangle"]
            for triangle in mesh.triangles[first : first + cluster["triangle_count"]]:
                for a, b in zip(triangle, triangle[1:] + triangle[:1]):
                    a, b = mesh.lattice[a], mesh.lattice[b]
                    count[a, b] = count.get((a, b), 0) + 1
                    count[b, a] = count.get((b, a), 0) - 1
        return not any(count.values())

    def decode(self, geometry):
        mesh = Mesh([], [], [], [], [], [])
        step = geometry["step_mantissa"] * math.ldexp(1.0, geometry["step_exponent"])
        start = geometry["payload_offset"]
        payload = self.sections["payload"][start : start + geometry["payload_bytes"]]
        clusters = self.clusters(geometry)
        ends = [4 * following["payload_offset"] for following in clusters[1:]] + [len(payload)]
        for cluster, end in zip(clusters, ends):
            first_vertex = len(mesh.lattice)
            if (first_vertex, len(mesh.triangles)) != (cluster["first_vertex"], cluster["first_triangle"]):
                raise BadFile("clusters do not follow each other")
            data = payload[4 * cluster["payload_offset"] : end]
            bits = Bits(data)
            for triangle in read_triangles(bits, cluster):
                mesh.triangles.append(tuple(first_vertex + corner for corner in triangle))
                mesh.slots.append(cluster["material_slot"])
            mesh.lattice += read_lattice(bits, cluster, geometry)
            count = cluster["vertex_count"]
            flags = cluster["flags"]
            mesh.normals += read_normals(bits, cluster, geometry) if flags & HAS_NORMALS else [(0.0, 0.0, 0.0)] * count
            mesh.uvs += read_uvs(bits, cluster, geometry) if flags & HAS_UVS else [(0.0, 0.0)] * count
            if (bits.at + 31) // 32 * 4 != len(data) or bits.value >> bits.at:
                raise BadFile("a cluster's streams do not fill its place in the payload")
        mesh.positions = [tuple(to_float32(point * step) for point in vertex) for vertex in mesh.lattice]
        if (len(mesh.lattice), len(mesh.triangles)) != (geometry["vertex_count"], geometry["triangle_count"]):
            raise BadFile("a geometry's counts are not those of its clusters")
        return mesh


class TreeCheck:
    """Walks the trees of a file: leaves hold each triangle that some ray sees once, boxes hold what lies below, and are
    no larger than rounding makes them."""

    def __init__(self, baked, meshes):
        self.baked, self.meshes = baked, meshes
        self.geometry_of, self.classes_of = [], []  # by cluster
        for number, geometry in enumerate(baked.sections["geometries"]):
            self.geometry_of += [number] * geometry["cluster_count"]
            for material_class, count in enumerate(geometry["class_clusters"]):
                # bits: seen by the camera, occludes, a mask must be looked up
                self.classes_of += [(~material_class & 3) | (material_class & 4)] * count
        self.leaves_of = [[0] * cluster["triangle_count"] for cluster in baked.sections["clusters"]]

    def run(self):
        trees = self.baked.sections["trees"]
        own = {tree["geometry"] for tree in trees}
        for tree in trees:
            self.tree = tree
            self.nodes = self.baked.sections["nodes"][tree["first_node"] : tree["first_node"] + tree["node_count"]]
            self.members = {number for number in range(len(self.meshes))
                            if number == tree["geometry"] or (tree["geometry"] == NONE and number not in own)}
            if self.nodes and self.walk(0)[1] != tree["depth"]:
                raise BadFile("a tree's depth is not what its record says")
        for cluster, leaves in enumerate(self.leaves_of):
            wanted = 1 if trees and self.classes_of[cluster] & 3 else 0
            if any(count != wanted for count in leaves):
                raise BadFile(f"triangles of cluster {cluster} are not in one leaf each")

    def walk(self, number):
        """The exact box below a node, and the levels of nodes from it down."""
        node = self.nodes[number]
        below, depth, classes = [], 0, 0
        triangle = node["first_triangle"]
        for slot, child in enumerate(node["children"]):
            if child == INNER_CHILD:
                box, levels = self.walk(node["first_child"] + len(below))
                classes |= self.nodes[node["first_child"] + len(below)]["ray_classes"] & 3
                depth = max(depth, levels)
            elif child:
                box = self.leaf_box(node["cluster"], triangle, child)
                triangle += child
                classes = self.classes_of[node["cluster"]]
            else:
                continue
            below.append(box)
            for axis in range(3):
                unit = 1 << (node["exponents"] >> 5 * axis & 31)
                lo, hi = (node["origin"][axis] + node[end][8 * axis + slot] * unit for end in ("lo", "hi"))
                if not (lo <= box[0][axis] < lo + unit and hi - unit < box[1][axis] <= hi):
                    raise BadFile(f"a box of node {number} is not that of what lies below")
        if classes != node["ray_classes"]:
            raise BadFile(f"the rays that see node {number} are not those of what lies below")
        return [[pick(box[end][axis] for box in below) for axis in range(3)] for end, pick in ((0, min), (1, max))], depth + 1

    def leaf_box(self, cluster, first, count):
        number = self.geometry_of[cluster]
        if number not in self.members:
            raise BadFile("a leaf of another tree's geometry")
        geometry, mesh = self.baked.sections["geometries"][number], self.meshes[number]
        start = self.baked.sections["clusters"][cluster]["first_triangle"] + first
        points = [mesh.lattice[corner] for triangle in mesh.triangles[start : start + count] for corner in triangle]
        for triangle in range(first, first + count):
            self.leaves_of[cluster][triangle] += 1
        shift = geometry["step_exponent"] - self.tree["step_exponent"]
        scale = (lambda q: q << shift) if shift >= 0 else (lambda q: q >> -shift)
        return [[pick(sign * scale(sign * point[axis]) - self.tree["origin"][axis] for point in points) for axis in range(3)]
                for pick, sign in ((min, 1), (max, -1))]  # rounded down and up


class Differs(Exception):
    """What was decoded is not what the dump holds."""


class Dump:
    """Takes arrays off a dump, little-endian and without gaps."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, code, count):
        values = array.array(code)
        size = count * values.itemsize
        if self.at + size > len(self.data):
            raise Differs("the dump is too short")
        values.frombytes(self.data[self.at : self.at + size])
        if sys.byteorder == "big":
            values.byteswap()
        self.at += size
        return values


def flat(tuples):
    return [value for item in tuples for value in item]


def require_equal(what, ours, theirs):
    if len(ours) != len(theirs):
        raise Differs(f"{what}: {len(ours)} values instead of {len(theirs)}")
    for number, (a, b) in enumerate(zip(ours, theirs)):
        if a != b:
            raise Differs(f"{what}: value {number} is {a!r} instead of {b!r}")


def compare(baked, meshes, dump):
    """A dump: geometries (u32); for each vertices, triangles (u32), then lattice (3 i64 a vertex), positions, normals
    (3 floats a vertex), uvs (2 floats), triangles (3 u32 each), material slots (u32 a triangle); instances (u32); for each
    12 floats, a geometry (u32) and its materials by slot (u32 each); of all textures the texels (3 u8 each); for each
    geometry that is no level itself the number of its levels (u32) and, where there are any, a threshold (float) and the cut for it: clusters
    (u32), for each a geometry and a cluster of it (u32). All must be equal."""
    require_equal("geometries", [len(meshes)], dump.take("I", 1))
    for number, mesh in enumerate(meshes):
        vertices, triangles = len(mesh.lattice), len(mesh.triangles)
        what = f"geometry {number}: "
        require_equal(what + "counts", [vertices, triangles], dump.take("I", 2))
        require_equal(what + "lattice", flat(mesh.lattice), dump.take("q", 3 * vertices))
        require_equal(what + "positions", flat(mesh.positions), dump.take("f", 3 * vertices))
        require_equal(what + "normals", flat(mesh.normals), dump.take("f", 3 * vertices))
        require_equal(what + "uvs", flat(mesh.uvs), dump.take("f", 2 * vertices))
        require_equal(what + "triangles", flat(mesh.triangles), dump.take("I", 3 * triangles))
        require_equal(what + "slots", mesh.slots, dump.take("I", triangles))
    instances = baked.sections["instances"]
    require_equal("instances", [len(instances)], dump.take("I", 1))
    for number, instance in enumerate(instances):
        require_equal(f"instance {number}", instance["world_from_object"], dump.take("f", 12))
        require_equal(f"instance {number}", [instance["geometry"]], dump.take("I", 1))
        materials = baked.instance_materials(instance)
        require_equal(f"instance {number}: materials", materials, dump.take("I", len(materials)))
    for number, texture in enumerate(baked.sections["textures"]):
        texels = read_texels(texture, baked.sections["texture_bytes"][texture["first_byte"] :])
        require_equal(f"texture {number}", texels, list(dump.take("B", 3 * texture["width"] * texture["height"])))
    bases = [number for number, g in enumerate(baked.sections["geometries"]) if not g["flags"] & LOD_LEVEL]
    for number in bases:
        (levels,) = dump.take("I", 1)
        require_equal(f"geometry {number}: levels", [len(baked.levels(number))], [levels])
        if levels == 0:
            continue
        (threshold,) = dump.take("f", 1)
        chosen = baked.cut(number, threshold)
        require_equal(f"geometry {number}: cut", [len(chosen)], dump.take("I", 1))
        require_equal(f"geometry {number}: cut", flat(chosen), dump.take("I", 2 * len(chosen)))
    if dump.at != len(dump.data):
        raise Differs("the dump holds more than the file")


def describe(baked, meshes):
    counts = {name: len(baked.sections[name]) for name, record in SECTIONS if record is not None}
    print(", ".join(f"{count} {name}" for name, count in counts.items()))
    for geometry, mesh in zip(baked.sections["geometries"], meshes):
        numbers = array.array("f", flat(mesh.positions)).tobytes() + array.array("I", flat(mesh.triangles)).tobytes()
        box = [tuple(pick(axis) for axis in zip(*mesh.positions)) for pick in (min, max)] if mesh.positions else "empty"
        print(f"{baked.text(geometry['name'])}: {len(mesh.triangles)} triangles, {len(mesh.positions)} vertices, "
              f"{geometry['cluster_count']} clusters, box {box}, checksum {zlib.crc32(numbers):08x}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--expect", metavar="DUMP")
    arguments = parser.parse_args()
    try:
        with open(arguments.file, "rb") as file:
            baked = BakedFile(file.read())
        meshes = [baked.decode(geometry) for geometry in baked.sections["geometries"]]
        baked.check_levels(meshes)
        TreeCheck(baked, meshes).run()
        describe(baked, meshes)
        if arguments.expect:
            with open(arguments.expect, "rb") as file:
                compare(baked, meshes, Dump(file.read()))
    except (BadFile, OSError) as problem:
        print(f"{arguments.file}: {problem}", file=sys.stderr)
        return 3
    except Differs as problem:
        print(f"{arguments.file}: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
