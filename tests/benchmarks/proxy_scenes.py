#!/usr/bin/env python3
"""Measures where voxel proxies make occlusion rays faster, in scenes of many equal instances. Prints a Markdown table.

    tests/benchmarks/proxy_scenes.py build/release/bin/packtrace FOLDER [SHAPE ...] > table.md

Per shape and number of voxels: CPU time of occlusion rays without and with --proxy-beyond (9 rays per pixel less 1 ray,
one thread, in turn; the median of the pairs' ratios), the mean difference of ambient occlusion, and the bytes that rays
need. --levels repeats this with levels of detail instead of voxels. FOLDER keeps the scenes. Needs only the standard
library; the shapes killeroo and spaceship read the folder PACKTRACE_SCENES.
"""
import argparse
import json
import math
import os
import pathlib
import random
import statistics
import struct
import subprocess
import sys


class Mesh:
    def __init__(self):
        self.points, self.triangles = [], []

    def add(self, points, triangles):
        first = len(self.points)
        self.points += points
        self.triangles += [tuple(first + i for i in t) for t in triangles]

    def box(self, low, high):
        corners = [tuple((high if i >> a & 1 else low)[a] for a in range(3)) for i in range(8)]
        quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
        self.add(corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])

    def write(self, path):
        with open(path, "wb") as f:
            f.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(self.points)}\nproperty float x\n"
                    f"property float y\nproperty float z\nelement face {len(self.triangles)}\n"
                    "property list uchar int vertex_indices\nend_header\n".encode())
            for p in self.points:
                f.write(struct.pack("<3f", *p))
            for t in self.triangles:
                f.write(struct.pack("<B3i", 3, *t))


def torus(rings, sides):
    mesh = Mesh()
    points = []
    for i in range(rings):
        for j in range(sides):
            u, v = 2 * math.pi * i / rings, 2 * math.pi * j / sides
            r = 0.7 + 0.3 * math.cos(v)
            points.append((r * math.cos(u), 0.3 * math.sin(v), r * math.sin(u)))
    triangles = []
    for i in range(rings):
        for j in range(sides):
            a, b = i * sides + j, i * sides + (j + 1) % sides
            c, d = (i + 1) % rings * sides + j, (i + 1) % rings * sides + (j + 1) % sides
            triangles += [(a, b, c), (b, d, c)]
    mesh.add(points, triangles)
    return mesh


def tree(leaves):
    """A trunk and loose leaves, mostly holes."""
    mesh, draw = Mesh(), random.Random(7)
    mesh.box((-0.06, -1.0, -0.06), (0.06, 0.2, 0.06))
    while leaves > 0:
        p = [draw.uniform(-1, 1) for _ in range(3)]
        if math.hypot(*p) > 1.0:
            continue
        at = (0.7 * p[0], 0.3 + 0.7 * p[1], 0.7 * p[2])
        corners = [tuple(c + draw.uniform(-0.05, 0.05) for c in at) for _ in range(3)]
        mesh.add(corners, [(0, 1, 2)])
        leaves -= 1
    return mesh


def building(floors, windows):
    """A block with a ledge per floor and a box per window."""
    mesh = Mesh()
    mesh.box((-0.6, -1.0, -0.6), (0.6, 1.0, 0.6))
    for f in range(floors):
        y, h = -1.0 + 2.0 * f / floors, 2.0 / floors
        mesh.box((-0.66, y, -0.66), (0.66, y + 0.1 * h, 0.66))
        for w in range(windows):
            x, d = -0.6 + 1.2 * w / windows, 1.2 / windows
            for s in (-1, 1):
                low, high = sorted((s * 0.6, s * 0.63))
                mesh.box((x + 0.2 * d, y + 0.3 * h, low), (x + 0.8 * d, y + 0.8 * h, high))
                mesh.box((low, y + 0.3 * h, x + 0.2 * d), (high, y + 0.8 * h, x + 0.8 * d))
    return mesh


def scenes_folder():
    folder = os.environ.get("PACKTRACE_SCENES")
    if not folder:
        sys.exit("killeroo and spaceship need PACKTRACE_SCENES")
    return folder


def killeroo():
    return (f'Scale 0.008 0.008 0.008 Rotate -90 1 0 0 '
            f'Include "{scenes_folder()}/killeroo/geometry/killeroo.pbrt"\n')


def spaceship():
    folder = pathlib.Path(scenes_folder()) / "spaceship" / "models"
    return "Scale 0.4 0.4 0.4\n" + "".join(
        f'Shape "plymesh" "string filename" "{path}"\n' for path in sorted(folder.glob("*.ply")))


def mesh_shape(make):
    def write(folder, name):
        make().write(folder / f"{name}.ply")
        return f'Shape "plymesh" "string filename" "{name}.ply"\n'
    return write


SHAPES = {
    "torus2k": mesh_shape(lambda: torus(48, 22)),
    "torus13k": mesh_shape(lambda: torus(128, 52)),
    "torus40k": mesh_shape(lambda: torus(200, 100)),
    "tree1k": mesh_shape(lambda: tree(1300)),
    "tree6k": mesh_shape(lambda: tree(6000)),
    "tree30k": mesh_shape(lambda: tree(30000)),
    "building3k": mesh_shape(lambda: building(10, 6)),
    "building20k": mesh_shape(lambda: building(24, 17)),
    "killeroo": lambda folder, name: killeroo(),
    "spaceship": lambda folder, name: spaceship(),
}

LAYOUTS = ("field", "heap", "near")


def placements(layout):
    """Field: a plane of instances. Heap: they touch, in a volume. Near: a field behind large spheres."""
    draw = random.Random(3)
    if layout == "heap":
        return [tuple(draw.uniform(-1, 1) * s for s in (60, 12, 60)) for _ in range(3000)]
    return [(3.2 * (i - 25) + draw.uniform(-0.5, 0.5), 0.0, 3.2 * (j - 25) + draw.uniform(-0.5, 0.5))
            for i in range(50) for j in range(50)]


def write_scene(folder, name, layout):
    shape = SHAPES[name](folder, name)
    draw = random.Random(5)
    path = folder / f"{name}_{layout}.pbrt"
    with open(path, "w") as f:
        f.write('LookAt 0 70 -150  0 0 0  0 1 0\nCamera "perspective" "float fov" [40]\nWorldBegin\n'
                'Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] '
                '"point P" [-200 -1.2 -200 200 -1.2 -200 200 -1.2 200 -200 -1.2 200]\n')
        if layout == "near":
            for x in (-45, 0, 45):
                f.write(f'AttributeBegin\nTranslate {x} 30 -80\nShape "sphere" "float radius" 17\nAttributeEnd\n')
        f.write(f'ObjectBegin "shape"\n{shape}ObjectEnd\n')
        for p in placements(layout):
            f.write(f'AttributeBegin\nTranslate {p[0]:.3f} {p[1]:.3f} {p[2]:.3f}\nRotate {draw.uniform(0, 360):.1f} 0 1 0\n'
                    'ObjectInstance "shape"\nAttributeEnd\n')
        f.write("WorldEnd\n")
    return path


class Runner:
    def __init__(self, options):
        self.program, self.folder, self.options = options.program, options.folder, options

    def call(self, *arguments):
        """Runs the program and returns its CPU seconds."""
        log = self.folder / "log.txt"
        with open(log, "w") as f:
            process = subprocess.Popen([self.program, *map(str, arguments), "--force", "-q"], stdout=f, stderr=f)
            _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            sys.exit(f"{' '.join(map(str, arguments))}: exit {process.returncode}\n{log.read_text()}")
        return usage.ru_utime

    def render(self, file, name, spp, extra):
        return self.call("render", file, "-o", self.folder / f"{name}.exr", "--json", self.folder / f"{name}.json",
                         "--frames", self.options.frames, "--spp", spp, "--size", self.options.size, "--aov", "ao_raw",
                         "--no-denoise", "--threads", 1, *extra)

    def occlusion(self, file, name, extra):
        return self.render(file, name, 9, extra) - self.render(file, name, 1, extra)

    def difference(self, file, extra):
        """Mean difference of converged ambient occlusion from that of triangles."""
        for name, options in (("exact", []), ("other", extra)):
            self.render(file, name, 128, ["--frames", 1, *options])
        self.call("compare", self.folder / "other.exr", self.folder / "exact.exr", "--layer", "ao_raw", "--metric",
                  "mae", "--json", self.folder / "mae.json")
        return json.loads((self.folder / "mae.json").read_text())["metrics"]["mae"]

    def row(self, label, file, extra):
        ratios = []
        for _ in range(self.options.pairs):
            exact, other = self.occlusion(file, "exact", []), self.occlusion(file, "other", extra)
            ratios.append(exact / other)
        result = json.loads((self.folder / "other.json").read_text())
        before = json.loads((self.folder / "exact.json").read_text())["resident_bytes"]["tracing"]
        used = result.get("proxies", {}).get("instances", "")
        print(f"| {label} | {used} | {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}) | "
              f"{self.difference(file, extra):.4f} | {1e-6 * before:.2f}, {1e-6 * result['resident_bytes']['tracing']:.2f} |",
              flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program"), parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("shapes", nargs="*", default=list(SHAPES))
    parser.add_argument("--layouts", default="field"), parser.add_argument("--voxels", default="16,32")
    parser.add_argument("--pixels", default="8"), parser.add_argument("--size", default="240x135")
    parser.add_argument("--surface", default="matched"), parser.add_argument("--error", default="0.01")
    parser.add_argument("--frames", type=int, default=3), parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--levels", help="bounds of --lod-error, in pixels, to compare with")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    runner = Runner(options)
    print("| scene | instances as voxels | triangles' time over theirs | mean difference | MB for rays: before, with |\n"
          "|---|---|---|---|---|")
    for shape in options.shapes:
        for layout in options.layouts.split(","):
            scene = write_scene(options.folder, shape, layout)
            for n in options.voxels.split(","):
                file = scene.with_suffix(f".{n}.ptk")
                runner.call("bake", scene, "-o", file, "--proxy", "voxels", "--proxy-voxels", n, "--proxy-surface",
                            options.surface)
                runner.row(f"{shape}, {layout}, {n}^3", file, ["--proxy-beyond", options.pixels, "--proxy-error", options.error])
            if options.levels:
                file = scene.with_suffix(".lod.ptk")
                runner.call("bake", scene, "-o", file, "--lod", "instanced")
                for error in options.levels.split(","):
                    runner.row(f"{shape}, {layout}, levels, {error} pixels", file,
                               ["--lod-error", error, "--lod-rays", "occlusion"])


main()
