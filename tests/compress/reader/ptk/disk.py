"""Expands files in disk form to resident form."""

import struct

from ptk import fast, small
from ptk.nodes import restore_nodes
from ptk.normals import NORMAL_ENCODINGS
from ptk.records import CLUSTER, GEOMETRY, MAGIC, SECTIONS, VERSION, BadFile, Cursor, Record
from ptk.zstd import GROWTH, decompress

HEADER = Record(
    ("magic", "8s"), ("version", "I"), ("header_bytes", "I"), ("file_bytes", "Q"), ("codec", "I"), ("page_count", "I"),
    ("resident_bytes", "Q"), ("head", "2Q"), ("tail", "2Q"), ("stream_bytes", "5Q"), ("nodes", "2Q"),
    ("node_form", "I"), ("reserved", "I"), ("motion_bytes", "Q"), ("zeros", "32s"), ("table_hash", "Q"), ("header_hash", "Q"))
PAGE = Record(("hash", "Q"), ("disk_bytes", "I"), ("payload_bytes", "I"), ("clusters", "I"), ("form", "I"))
PAGE_DECODERS = {1: fast.decode_page, 2: small.decode_page}
PAGE_FORMS = {1: (1,), 2: (1, 2)}  # by codec; form 0 is allowed in all
SECTION_NAMES = [name for name, _ in SECTIONS]


def section_place(resident, name):
    """Returns a section's offset and size in bytes, from the table in the header of the resident form."""
    return struct.unpack_from("<QQ", resident, 48 + 24 * SECTION_NAMES.index(name))


def clusters_of_page(data, page, geometries, codec, payload_begin):
    """Returns the records of a page's clusters and the bytes of their streams.
    @param geometries the geometry of each cluster
    @param payload_begin offset of the page's payload in the payload section"""
    if page["form"] == 0:
        plain = decompress(data, page["clusters"] * CLUSTER.layout.size + page["payload_bytes"])
        records = CLUSTER.read_all(plain[: page["clusters"] * CLUSTER.layout.size])
        return records, plain[page["clusters"] * CLUSTER.layout.size :]
    if page["form"] not in PAGE_FORMS[codec]:
        raise BadFile("a page of a form that the file's codec does not have")
    clusters = PAGE_DECODERS[page["form"]](data, geometries)
    payload = b""
    for cluster, geometry in zip(clusters, geometries):
        cluster.record["payload_offset"] = (payload_begin + len(payload) - geometry["payload_offset"]) // 4
        payload += cluster.streams(NORMAL_ENCODINGS[geometry["normal_encoding"]].charts)
    return [cluster.record for cluster in clusters], payload


def number_clusters(records, geometry_of):
    """Sets first_triangle and first_vertex of each record; both count within the geometry."""
    last = None
    for record, geometry in zip(records, geometry_of):
        if geometry is not last:
            triangles, vertices, last = 0, 0, geometry
        record |= {"first_triangle": triangles, "first_vertex": vertices}
        triangles += record["triangle_count"]
        vertices += record["vertex_count"]


def is_disk_form(data):
    return data[:8] == MAGIC and data[12:16] == HEADER.layout.size.to_bytes(4, "little")


def expand(data):
    """Returns the bytes of the resident form. Raises BadFile."""
    if len(data) < HEADER.layout.size:
        raise BadFile("the file is too short")
    (header,) = HEADER.read_all(data[: HEADER.layout.size])
    if header["version"] != VERSION or header["file_bytes"] != len(data) or header["codec"] not in PAGE_DECODERS or any(header["zeros"]):
        raise BadFile("the header's sizes or codec are none")
    if header["resident_bytes"] > GROWTH * len(data):
        raise BadFile("a resident file of more bytes than a file may ask for")
    parts = Cursor(data, HEADER.layout.size)
    pages = PAGE.read_all(parts.take(header["page_count"] * PAGE.layout.size))
    head = decompress(parts.take(header["head"][1]), header["head"][0])
    tail = decompress(parts.take(header["tail"][1]), header["tail"][0])
    motion = parts.take(header["motion_bytes"])
    nodes = parts.take(header["nodes"][1])

    offset, size = section_place(head, "geometries")
    geometries = GEOMETRY.read_all(head[offset : offset + size])
    geometry_of = [geometry for geometry in geometries for _ in range(geometry["cluster_count"])]
    records, payload, at = [], b"", 0
    for page in pages:
        of = geometry_of[len(records) : len(records) + page["clusters"]]
        page_records, page_payload = clusters_of_page(parts.take(page["disk_bytes"]), page, of, header["codec"], len(payload))
        if len(page_payload) != page["payload_bytes"] or len(page_records) != page["clusters"]:
            raise BadFile("a page does not hold the payload that its record says")
        records += page_records
        payload += page_payload
    if parts.at != len(data) or len(records) != len(geometry_of):
        raise BadFile("pages do not hold all clusters")
    number_clusters(records, geometry_of)

    out = bytearray(header["resident_bytes"])
    out[: len(head)] = head
    for name, content in (("clusters", b"".join(map(CLUSTER.write, records))), ("payload", payload)):
        offset, _ = section_place(head, name)
        out[offset : offset + len(content)] = content
    offset, _ = section_place(head, "materials")
    out[offset : offset + len(tail) + len(motion)] = tail + motion
    if len(out) != header["resident_bytes"]:
        raise BadFile("parts do not lie in the resident file")
    offset, size = section_place(head, "nodes")
    content = decompress(nodes) if nodes else b""
    out[offset : offset + size] = restore_nodes(bytes(out), content) if header["node_form"] == 1 else content
    return bytes(out)
