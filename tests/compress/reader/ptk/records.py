"""The on-disk records and bit fields of docs/baked_format.md."""

import struct

VERSION = 14
MAGIC = b"PTK\x89\r\n\x1a\0"
HEADER_BYTES = 576
NONE = 0xFFFFFFFF

WORLD_SPACE, LOD_LEVEL = 1, 2  # geometry flags
HAS_NORMALS, HAS_UVS, MIXED_CHARTS, CHART_SHIFT = 1, 2, 4, 3  # cluster flags


class BadFile(Exception):
    """The file violates the format's description."""


class Cursor:
    """Reads bytes sequentially."""

    def __init__(self, data, at=0):
        self.data, self.at = data, at

    def take(self, count):
        if self.at + count > len(self.data):
            raise BadFile("a file or a part of it is too short")
        self.at += count
        return self.data[self.at - count : self.at]


class Record:
    """A record of fixed size. Fields are (name, struct format); a format of several values gives a tuple."""

    def __init__(self, *fields):
        self.fields = fields
        self.layout = struct.Struct("<" + "".join(letters for _, letters in fields))

    def read_all(self, data):
        return [self._named(values) for values in self.layout.iter_unpack(data)]

    def write(self, named):
        values = []
        for name, letters in self.fields:
            values += [named[name]] if self._count(letters) == 1 else named[name]
        return self.layout.pack(*values)

    def _named(self, values):
        out, at = {}, 0
        for name, letters in self.fields:
            count = self._count(letters)
            out[name] = values[at] if count == 1 else values[at : at + count]
            at += count
        return out

    @staticmethod
    def _count(letters):
        return len(struct.unpack("<" + letters, bytes(struct.calcsize("<" + letters))))


GEOMETRY = Record(
    ("origin", "3q"), ("max_position_error", "d"), ("position_error_bound", "d"),
    ("step_mantissa", "I"), ("step_exponent", "i"), ("anchor_shift", "I"), ("uv_exponent", "2h"),
    ("flags", "H"), ("normal_encoding", "B"), ("uv_encoding", "B"), ("bounds_lo", "3f"), ("bounds_hi", "3f"),
    ("max_normal_error_degrees", "f"), ("mean_normal_error_degrees", "f"), ("max_uv_error", "f"),
    ("payload_offset", "Q"), ("payload_bytes", "Q"), ("class_clusters", "8I"), ("first_cluster", "I"),
    ("cluster_count", "I"), ("triangle_count", "I"), ("vertex_count", "I"), ("name", "2I"),
    ("slot_count", "I"), ("requirements", "I"))
CLUSTER = Record(
    ("payload_offset", "I"), ("first_triangle", "I"), ("first_vertex", "I"), ("material_slot", "I"),
    ("anchor", "3i"), ("normal_anchor", "2h"), ("vertex_count", "H"), ("normal_palette", "H"),
    ("triangle_count", "B"), ("strip_count", "B"), ("position_bits", "3B"), ("normal_bits", "2B"), ("flags", "B"))
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
    ("origin", "3d"), ("precision_value", "d"), ("precision_kind", "I"), ("world_step_mantissa", "I"), ("world_step_exponent", "i"),
    ("purpose", "I"), ("stream_bits", "4Q"), ("left_out", "Q"), ("coinciding_triangles", "Q"), ("source_area", "d"),
    ("collapsed_area", "d"), ("shading_bytes", "Q"))

REQUIREMENT = Record(
    ("stream", "I"), ("reason", "I"), ("geometries", "I"), ("reserved", "I"),
    ("triangles", "Q"), ("source_bytes", "Q"), ("stored_bits", "Q"))

LOD_LEVEL_RECORD = Record(
    ("first_group", "I"), ("first_link", "I"), ("triangles", "I"), ("base", "I"), ("geometry", "I"),
    ("group_count", "H"), ("level", "H"), ("error", "f"))
LOD_GROUP = Record(("center", "3f"), ("radius", "f"), ("error", "f"), ("level", "I"))
LOD_LINK = Record(("group", "H"), ("generating_group", "H"))

TREE = Record(
    ("first_node", "Q"), ("node_count", "I"), ("depth", "I"), ("origin", "3q"), ("step_mantissa", "I"),
    ("step_exponent", "i"), ("geometry", "I"), ("reserved", "I"))
NODE = Record(
    ("origin", "3i"), ("exponents", "H"), ("ray_classes", "B"), ("first_triangle", "B"), ("first_child", "I"),
    ("cluster", "I"), ("children", "8B"), ("lo", "24B"), ("hi", "24B"))
INNER_CHILD = 255

# In the order of the section table; None means plain bytes.
SECTIONS = (
    ("geometries", GEOMETRY), ("clusters", CLUSTER), ("payload", None), ("materials", MATERIAL),
    ("instances", INSTANCE), ("masks", MASK), ("mask_words", Record(("word", "I"))), ("textures", TEXTURE),
    ("texture_bytes", None), ("cameras", CAMERA), ("strings", None), ("summary", SUMMARY),
    ("material_slots", Record(("material", "I"))), ("requirements", REQUIREMENT),
    ("lod_levels", LOD_LEVEL_RECORD), ("lod_groups", LOD_GROUP), ("lod_links", LOD_LINK), ("trees", TREE),
    ("rigid_motion", None), ("deformation", None), ("nodes", NODE))


def index_bits(count):
    """Returns the number of bits of an index below `count`: ceil(log2 count)."""
    return (count - 1).bit_length()


def unzigzag(number):
    """Inverse of zigzag coding, which maps d >= 0 to 2 d and d < 0 to -2 d - 1."""
    return -(number + 1 >> 1) if number & 1 else number >> 1


def to_float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


class Bits:
    """Reads bit fields that are packed from the least significant bit."""

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
