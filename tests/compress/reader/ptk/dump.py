"""Compares decoded geometry with a dump that the C++ library wrote."""

import array
import sys

from ptk.motion import read_motion
from ptk.records import LOD_LEVEL, NONE, to_float32
from ptk.shading import compare_shading
from ptk.textures import read_texels


class Differs(Exception):
    """A decoded value differs from the dump."""


class Dump:
    """Reads the arrays of a dump in order; they are little-endian and packed."""

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
    """Compares all decoded values with a dump, which holds:
    - the number of geometries (u32); per geometry the vertex and triangle counts (u32), per vertex its grid position
      (3 i64), then all positions (3 floats each), normals (3 floats) and uvs (2 floats), per triangle three vertices
      (u32), then all material slots (u32)
    - the number of instances (u32); per instance a matrix (12 floats), a geometry (u32) and a material per slot (u32)
    - the texels of all textures (3 u8 each)
    - per geometry that is not a LOD level, the number of its levels (u32); if there are any, an error threshold (float)
      and the cut for it: the number of clusters (u32), and per cluster its geometry and its index there (u32)
    - the numbers of tracks, moving instances and moving cameras (u32); per track its flags and the number of keys (u32),
      per key time, translation, rotation (w, x, y, z) and scale (17 floats); per moving instance its number, track and
      inner track (u32), pivot and error (4 floats); per moving camera its number and track (u32) and error (float)
    - the shading: see compare_shading()
    Raises Differs."""
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
    tracks, moving, cameras = read_motion(baked.sections["rigid_motion"])
    require_equal("motion", [len(tracks), len(moving), len(cameras)], dump.take("I", 3))
    for number, (flags, keys) in enumerate(tracks):
        require_equal(f"track {number}", [flags, len(keys)], dump.take("I", 2))
        for key in keys:
            numbers = [key[0], *key[1], *key[2], *flat(key[3])]
            require_equal(f"track {number}: key", [to_float32(n) for n in numbers], dump.take("f", len(numbers)))
    for instance, track, inner, pivot, error in moving:
        require_equal("moving instance", [instance, track, NONE if inner is None else inner], dump.take("I", 3))
        require_equal("moving instance", [*(pivot or (0.0, 0.0, 0.0)), error], dump.take("f", 4))
    for camera, track, error in cameras:
        require_equal("moving camera", [camera, track], dump.take("I", 2))
        require_equal("moving camera", [error], dump.take("f", 1))
    compare_shading(baked, dump, require_equal)
    if dump.at != len(dump.data):
        raise Differs("the dump holds more than the file")
