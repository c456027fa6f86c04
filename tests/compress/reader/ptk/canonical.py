"""Packs the decoded values of a cluster into its record and streams, with the smallest bit widths that fit."""

from ptk.normals import NORMAL_ENCODINGS
from ptk.payload import PageCluster
from ptk.records import CHART_SHIFT, HAS_NORMALS, HAS_UVS, MIXED_CHARTS, BadFile

LEFT, RESTART = 1, 2


def word_of(fields, widths):
    """Returns the bit fields as one integer; the first field has the lowest bits."""
    word, at = 0, 0
    for value, width in zip(fields, widths):
        word |= value << at
        at += width
    return word


def widths_above(bases, tuples):
    """Returns per component the number of bits of its largest difference from the base."""
    return tuple((max(column) - base).bit_length() for base, column in zip(bases, zip(*tuples)))


def pack(values, geometry):
    """Returns the PageCluster of a SmallCluster. Anchors are rounded down."""
    encoding = NORMAL_ENCODINGS[geometry["normal_encoding"]]
    shift = geometry["anchor_shift"]
    anchor = tuple(min(column) - o >> shift for column, o in zip(zip(*values.places), geometry["origin"]))
    base = [o + (a << shift) for a, o in zip(anchor, geometry["origin"])]
    position_bits = widths_above(base, values.places)
    cluster = PageCluster({
        "material_slot": values.slot, "anchor": anchor, "normal_anchor": (0, 0), "vertex_count": len(values.places),
        "normal_palette": 0, "triangle_count": values.triangle_count, "strip_count": values.turns.count(RESTART),
        "position_bits": position_bits, "normal_bits": (0, 0), "flags": HAS_UVS if values.has_uvs else 0})
    cluster.starts = [int(turn == RESTART) for turn in values.turns]
    cluster.lefts = [int(turn == LEFT) for turn in values.turns]
    cluster.fresh = [int(fresh) for _, fresh in values.corners]
    cluster.reused_vertices = [vertex for vertex, fresh in values.corners if not fresh]
    cluster.positions = [word_of([p - b for p, b in zip(place, base)], position_bits) for place in values.places]
    if values.has_normals:
        pack_normals(cluster, values, encoding)
    if values.has_uvs:
        lows = [min(column) for column in zip(*values.uvs)]
        cluster.uv_anchors = tuple(low & 0xFFFFFFFF for low in lows)
        cluster.uv_bits = widths_above(lows, values.uvs)
        cluster.uvs = [word_of([q - low for q, low in zip(uv, lows)], cluster.uv_bits) for uv in values.uvs]
    return cluster


def pack_normals(cluster, values, encoding):
    record = cluster.record
    mixed = values.chart == encoding.charts
    placed = {}
    for normal in values.normals:
        placed[normal] = normal if mixed else encoding.unfold(normal, values.chart)
        if placed[normal] is None:
            raise BadFile("a normal that cannot be unfolded around its cluster's chart")
    anchors = [min(column) >> 1 for column in list(zip(*placed.values()))[1:]]
    record["normal_anchor"] = tuple(anchors)
    record["normal_bits"] = x_bits, y_bits = widths_above([2 * a for a in anchors], [p[1:] for p in placed.values()])
    record["flags"] |= HAS_NORMALS | (MIXED_CHARTS if mixed else values.chart << CHART_SHIFT)

    def word(normal):
        chart, x, y = placed[normal]
        fields = y - 2 * anchors[1], x - 2 * anchors[0], chart if mixed else 0
        return word_of(fields, (y_bits, x_bits, 3))

    if values.has_palette:
        palette = sorted(set(values.normals), key=lambda normal: encoding.code(*normal))
        record["normal_palette"] = len(palette)
        cluster.palette = [word(normal) for normal in palette]
        cluster.normals = [palette.index(normal) for normal in values.normals]
    else:
        cluster.normals = [word(normal) for normal in values.normals]
