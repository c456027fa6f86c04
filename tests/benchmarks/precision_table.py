#!/usr/bin/env python3
"""Bytes, triangles and the error of ambient occlusion by the number of position bits, as a table in Markdown.

    tests/benchmarks/precision_table.py build/release/runtime/commands/packtrace SCENE.pbrt ... > table.md

The error is the mean absolute difference from the picture of the scene's floats, with the same seed. Fails where a file
with more bits is smaller than one with fewer.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

CODECS = ("none", "fast", "small")


def run(program, *arguments, may_be_empty=False):
    """Returns whether it worked; it must, unless pictures may have no pixel in common."""
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode == 0:
        return True
    if may_be_empty and "no pixel to compare" in done.stderr:
        return False
    sys.exit(f"{' '.join(map(str, arguments))}: exit {done.returncode}\n{done.stderr}")


def render(program, scene, image, options):
    run(program, "render", scene, "-o", image, "--ground-truth", "--size", options.size, "--spp", options.spp,
        "--force", "-q")


def measure(program, scene, bits, folder, options):
    """One row: bytes by codec, triangles, and the error."""
    row = {"bits": bits}
    packed, report = folder / "packed.ptk", folder / "report.json"
    for codec in CODECS:
        run(program, "bake", scene, "-o", packed, "--force", "--position-bits", bits, "--codec", codec, "--json", report,
            "-q")
        row[codec] = packed.stat().st_size
    bake = json.loads(report.read_text())
    for key in ("triangles", "collapsed_triangles", "coinciding_triangles"):
        row[key] = bake[key]
    row["area"] = bake["collapsed_area"] / bake["source_area"]
    if options.spp > 0:
        render(program, packed, folder / "packed.exr", options)
        if run(program, "compare", folder / "packed.exr", folder / "float.exr", "--metric", "mae", "--json", report,
               "--force", "-q", may_be_empty=True):
            row["error"] = json.loads(report.read_text())["metrics"]["mae"]
    return row


def table(program, scene, options):
    falls = True
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if options.spp > 0:
            render(program, scene, folder / "float.exr", options)
        print(f"\n**{scene.parent.name}**\n\n| bits | MB none / fast / small | triangles kept | without area | coinciding | "
              "area lost | AO error |\n|---|---|---|---|---|---|---|")
        last = None
        for bits in range(options.first, options.last + 1, options.by):
            row = measure(program, scene, bits, folder, options)
            sizes = " / ".join(f"{row[codec] / 1e6:.3f}" for codec in CODECS)
            print(f"| {bits} | {sizes} | {row['triangles']:,} | {row['collapsed_triangles']:,} | "
                  f"{row['coinciding_triangles']:,} | {row['area']:.2e} | {row.get('error', float('nan')):.4f} |", flush=True)
            for codec in CODECS:
                if last and row[codec] < last[codec]:
                    print(f"{scene}, codec {codec}: {bits} bits take fewer bytes than {last['bits']}", file=sys.stderr)
                    falls = False
            last = row
    return falls


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scenes", nargs="+", type=pathlib.Path)
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--spp", type=int, default=64, help="0: no pictures")
    parser.add_argument("--first", type=int, default=6)
    parser.add_argument("--last", type=int, default=24)
    parser.add_argument("--by", type=int, default=2)
    options = parser.parse_args()
    if not all([table(options.program, scene, options) for scene in options.scenes]):
        sys.exit(1)


if __name__ == "__main__":
    main()
