"""Reads the resident form."""

import math
import struct

from ptk.records import (HAS_NORMALS, HAS_UVS, HEADER_BYTES, MAGIC, SECTIONS, VERSION, BadFile, Bits, to_float32)
from ptk.streams import Mesh, read_lattice, read_normals, read_triangles, read_uvs


class BakedFile:
    """The records of a file by section. decode() decodes its geometries."""

    def __init__(self, data, with_nodes=True):
        if len(data) < 16 or data[:8] != MAGIC:
            raise BadFile("no baked file: the magic bytes are missing")
        version, header_bytes = struct.unpack_from("<II", data, 8)
        if version != VERSION:
            raise BadFile(f"format version {version}; this reader knows version {VERSION}")
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
            if name != "nodes" or with_nodes:
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
        """Returns the LOD cut of a geometry for errors up to `threshold`: pairs of a geometry and a cluster index there."""
        levels = self.levels(base)
        groups = self.sections["lod_groups"]
        chosen = []
        for below, level in zip([None] + levels, levels):
            geometry = self.sections["geometries"][level["geometry"]]
            for number in range(geometry["cluster_count"]):
                link = self.sections["lod_links"][level["first_link"] + number]
                made = 0.0 if below is None else groups[below["first_group"] + link["generating_group"]]["error"]
                if groups[level["first_group"] + link["group"]]["error"] > threshold >= made:
                    chosen.append((level["geometry"], number))
        return chosen

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
