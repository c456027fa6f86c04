"""Decodes the shading behind the textures."""

import struct

from ptk.records import NONE, BadFile

# Properties of a material: bit, number of floats, value without it. In the order of the file.
PROPERTIES = ((8, 1, (1.0,)), (9, 3, (0.0,) * 3), (10, 3, (0.0,) * 3), (11, 3, (0.0,) * 3),
              (12, 6, (1.0,) * 3 + (0.0,) * 3), (13, 1, (1.5,)), (14, 1, (0.0,)), (15, 1, (0.0,)))
POINT, SPOT, DISTANT, INFINITE = range(4)
LIGHT_LAYOUTS = {POINT: "3d", SPOT: "3d3f2f", DISTANT: "3f", INFINITE: "9fI"}


class ShadingBytes:
    def __init__(self, data):
        self.data = data
        self.at = 0

    def take(self, layout):
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values


def read_shading(baked):
    """Returns the materials' bits and properties, the lights and the environment maps; None without shading."""
    size = baked.sections["summary"][0]["shading_bytes"]
    if size == 0:
        return None
    data = ShadingBytes(baked.sections["texture_bytes"][-size:])
    material_count, light_count, map_count = data.take("3I")
    if material_count != len(baked.sections["materials"]):
        raise BadFile("the shading has another number of materials")
    materials = []
    for _ in range(material_count):
        (word,) = data.take("I")
        if word & ~0xFF3F:
            raise BadFile("undefined bits of a material's shading")
        values = []
        for bit, count, usual in PROPERTIES:
            values.extend(data.take(f"{count}f") if word >> bit & 1 else usual)
        materials.append((word & 0x3F, values))
    lights = []
    for _ in range(light_count):
        kind, *radiance = data.take("I3f")
        if kind not in LIGHT_LAYOUTS:
            raise BadFile("a light of no kind")
        values = data.take(LIGHT_LAYOUTS[kind])
        if kind == INFINITE and values[9] != NONE and values[9] >= map_count:
            raise BadFile("a light's map does not exist")
        lights.append((kind, radiance, values))
    maps = []
    for _ in range(map_count):
        width, height, name_bytes = data.take("3I")
        name = bytes(data.take(f"{name_bytes}s")[0]).decode("utf-8")
        pixels = []
        for _ in range(width * height):
            *mantissas, exponent = data.take("4B")
            pixels.extend(m * 2.0 ** (exponent - 136) if exponent else 0.0 for m in mantissas)
        maps.append((name, width, height, pixels))
    if data.at != len(data.data):
        raise BadFile("the shading ends early")
    return materials, lights, maps


def compare_shading(baked, dump, require_equal):
    """Compares the shading with a dump: whether there is any (u32); then per material its bits (u32) and properties
    (19 floats); per light its kind (u32) and radiance (3 floats); per map its size (2 u32) and pixels (3 floats each)."""
    shading = read_shading(baked)
    require_equal("shading", [0 if shading is None else 1], dump.take("I", 1))
    if shading is None:
        return
    materials, lights, maps = shading
    for number, (bits, values) in enumerate(materials):
        require_equal(f"shading of material {number}", [bits], dump.take("I", 1))
        require_equal(f"shading of material {number}", values, dump.take("f", len(values)))
    for number, (kind, radiance, _) in enumerate(lights):
        require_equal(f"light {number}", [kind], dump.take("I", 1))
        require_equal(f"light {number}", radiance, dump.take("f", 3))
    for number, (_, width, height, pixels) in enumerate(maps):
        require_equal(f"map {number}", [width, height], dump.take("I", 2))
        require_equal(f"map {number}", pixels, dump.take("f", len(pixels)))
