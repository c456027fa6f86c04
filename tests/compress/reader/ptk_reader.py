#!/usr/bin/env python3
"""Reads baked files (.ptk) of any codec.

    ptk_reader.py FILE.ptk                  prints counts, boxes and a checksum of each geometry
    ptk_reader.py FILE.ptk --expect DUMP    also compares all decoded values with a dump (ptk/dump.py)
    ptk_reader.py FILE.ptk --resident OUT   also writes the resident form

The code follows docs/baked_format.md alone. It needs Python's standard library, and libzstd for files in disk form.
Hashes are not checked, because the standard library has no XXH3.

Exit codes: 0 success, 1 the dump differs, 3 invalid file.
"""

import argparse
import array
import struct
import sys
import zlib

sys.dont_write_bytecode = True  # keep the source folder clean

from ptk.checks import TreeCheck, check_levels
from ptk.disk import expand, is_disk_form
from ptk.dump import Differs, Dump, compare, flat
from ptk.motion import read_motion
from ptk.records import SECTIONS, BadFile
from ptk.resident import BakedFile


# A damaged file may also cause out-of-range numbers.
NOT_A_FILE = (BadFile, OSError, ArithmeticError, LookupError, StopIteration, TypeError, ValueError, struct.error)


def describe(baked, meshes):
    counts = {name: len(baked.sections[name]) for name, record in SECTIONS if record is not None}
    print(", ".join(f"{count} {name}" for name, count in counts.items()))
    tracks, instances, cameras = read_motion(baked.sections["rigid_motion"])
    if tracks:
        print(f"motion: {len(tracks)} tracks, {len(instances)} instances, {len(cameras)} cameras")
        for flags, keys in tracks:
            print(f"track {flags}: {keys}")
    for geometry, mesh in zip(baked.sections["geometries"], meshes):
        numbers = array.array("f", flat(mesh.positions)).tobytes() + array.array("I", flat(mesh.triangles)).tobytes()
        box = [tuple(pick(axis) for axis in zip(*mesh.positions)) for pick in (min, max)] if mesh.positions else "empty"
        print(f"{baked.text(geometry['name'])}: {len(mesh.triangles)} triangles, {len(mesh.positions)} vertices, "
              f"{geometry['cluster_count']} clusters, box {box}, checksum {zlib.crc32(numbers):08x}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--expect", metavar="DUMP")
    parser.add_argument("--resident", metavar="OUT")
    arguments = parser.parse_args()
    try:
        with open(arguments.file, "rb") as file:
            data = file.read()
        if is_disk_form(data):
            data = expand(data)
        if arguments.resident:
            with open(arguments.resident, "wb") as file:
                file.write(data)
        baked = BakedFile(data)
        meshes = [baked.decode(geometry) for geometry in baked.sections["geometries"]]
        check_levels(baked, meshes)
        TreeCheck(baked, meshes).run()
        describe(baked, meshes)
        if arguments.expect:
            with open(arguments.expect, "rb") as file:
                compare(baked, meshes, Dump(file.read()))
    except NOT_A_FILE as problem:
        print(f"{arguments.file}: {problem}", file=sys.stderr)
        return 3
    except Differs as problem:
        print(f"{arguments.file}: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
