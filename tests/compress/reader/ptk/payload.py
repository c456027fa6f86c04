"""Writes the streams of clusters in resident form, the last step of decoding a page."""

from dataclasses import dataclass, field

from ptk.records import HAS_NORMALS, HAS_UVS, MIXED_CHARTS, index_bits


class FieldWriter:
    """Writes bit fields that Bits reads."""

    def __init__(self):
        self.value = 0
        self.at = 0

    def put(self, value, width):
        if value >> width:
            raise ValueError(f"{value} does not fit into {width} bits")
        self.value |= value << self.at
        self.at += width

    def bytes(self):
        return self.value.to_bytes((self.at + 31) // 32 * 4, "little")


@dataclass
class PageCluster:
    """A cluster of a page: its record, without the fields that depend on preceding clusters, and its streams."""

    record: dict
    starts: list = field(default_factory=list)  # per triangle: whether it begins a strip
    lefts: list = field(default_factory=list)  # per triangle
    fresh: list = field(default_factory=list)  # per corner
    reused_vertices: list = field(default_factory=list)  # vertices of corners that are not fresh
    positions: list = field(default_factory=list)  # words: the fields of a vertex, first field lowest
    normals: list = field(default_factory=list)  # words, or palette indices
    palette: list = field(default_factory=list)  # words
    uvs: list = field(default_factory=list)  # words
    uv_anchors: tuple = (0, 0)  # as unsigned numbers
    uv_bits: tuple = (0, 0)

    def normal_bits(self, charts):
        """Returns the number of bits of a normal or a palette entry."""
        mixed = self.record["flags"] & MIXED_CHARTS
        return sum(self.record["normal_bits"]) + (index_bits(charts) if mixed else 0)

    def streams(self, charts):
        """Returns the bytes of the streams. @param charts number of charts of the geometry's normal encoding"""
        out = FieldWriter()
        for bits in (self.starts, self.lefts, self.fresh):
            for bit in bits:
                out.put(bit, 1)
        for vertex in self.reused_vertices:
            out.put(vertex, index_bits(self.record["vertex_count"]))
        for word in self.positions:
            out.put(word, sum(self.record["position_bits"]))
        if self.record["flags"] & HAS_NORMALS:
            for word in self.palette:
                out.put(word, self.normal_bits(charts))
            width = index_bits(len(self.palette)) if self.palette else self.normal_bits(charts)
            for word in self.normals:
                out.put(word, width)
        if self.record["flags"] & HAS_UVS:
            for anchor in self.uv_anchors:
                out.put(anchor, 32)
            for width in self.uv_bits:
                out.put(width, 5)
            for word in self.uvs:
                out.put(word, sum(self.uv_bits))
        return out.bytes()
