#!/usr/bin/env python3
"""Every comparison with another program that docs/peers.md lists, as tables in Markdown.

    cmake --preset release -DPACKTRACE_UNITY= && cmake --build --preset release     # optimised for speed
    tests/benchmarks/peers.py --scenes DIR --folder /tmp/peers > peers.md           # half an hour on an idle machine
    tests/benchmarks/peers.py --folder /tmp/peers --again > peers.md                # only the tables, from the results

DIR holds the folders house, spaceship, bunny and killeroo. With --meshoptimizer, the folder of npm's package, meshes are
also simplified by its newest version. Results are kept in the folder, one JSON file per program; --resume goes on
after an interruption.
"""
import argparse
import array
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import time

SCENES = ("house", "spaceship", "bunny", "killeroo")
LARGE = ("mesh", "forest")


def run(options, program, *arguments, **environment):
    command = [str(options.bin / program), *map(str, arguments)]
    print(" ".join([f"{k}={v}" for k, v in environment.items()] + command), file=sys.stderr, flush=True)
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                          env=os.environ | {"PACKTRACE_SCENES": str(options.scenes)} | environment)
    if done.returncode != 0:
        sys.exit(f"exit {done.returncode}\n{done.stderr}")


def write_spheres(folder):
    """60 PLY files of spheres with normals, 13,944 triangles each, and a scene of them."""
    rings, columns = 85, 84
    folder.mkdir(exist_ok=True)
    scene = ['LookAt 0 -60 40 0 0 0 0 0 1', 'Camera "perspective" "float fov" [50]', "WorldBegin"]
    for number in range(60):
        centre = (5.0 * (number % 10) - 22.5, 5.0 * (number // 10) - 12.5, 0.3 * (number % 7))
        vertices, faces = array.array("f"), bytearray()
        for ring in range(rings):
            for column in range(columns):
                a, b = math.pi * ring / (rings - 1), 2.0 * math.pi * column / columns
                normal = (math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a))
                radius = 2.0 + 0.05 * math.sin(9.0 * a + number) * math.sin(8.0 * b)
                vertices.extend([c + radius * n for c, n in zip(centre, normal)] + list(normal))
        for ring in range(rings - 1):
            for column in range(columns - 1):
                i = ring * columns + column
                for triangle in ((i, i + columns, i + 1), (i + 1, i + columns, i + columns + 1)):
                    faces += b"\x03" + array.array("i", triangle).tobytes()
        names = "".join(f"property float {p}\n" for p in ("x", "y", "z", "nx", "ny", "nz"))
        header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {rings * columns}\n{names}element face "
                  f"{2 * (rings - 1) * (columns - 1)}\nproperty list uchar int vertex_indices\nend_header\n")
        (folder / f"{number}.ply").write_bytes(header.encode() + vertices.tobytes() + bytes(faces))
        scene.append(f'Shape "plymesh" "string filename" "{number}.ply"')
    (folder / "spheres.pbrt").write_text("\n".join(scene + ["WorldEnd"]))
    return folder / "spheres.pbrt"


def measure_bakes(options, folder):
    """Wall times of seven bakes with trees on all threads, and bytes with all levels of detail."""
    house = options.scenes / "house/scene.pbrt"
    result = {"wall_s": {}, "levels": {}}
    for name, scene in (("house", house), ("60 spheres", write_spheres(folder / "spheres"))):
        times = []
        for _ in range(7):
            begin = time.monotonic()
            run(options, "packtrace", "bake", scene, "-o", folder / "bake.ptk", "--force", "-q")
            times.append(time.monotonic() - begin)
        result["wall_s"][name] = times
    for name in ("bunny", "killeroo", "spaceship"):
        scene = options.scenes / name / ("killeroo-simple.pbrt" if name == "killeroo" else "scene.pbrt")
        report = folder / "bake.json"
        run(options, "packtrace", "bake", scene, "-o", folder / "bake.ptk", "--force", "-q", "--lod", "all", "--codec",
            "none", "--trees", "off", "--json", report)
        result["levels"][name] = json.loads(report.read_text())
    (folder / "bakes.json").write_text(json.dumps(result, indent=1))


def measure(options):
    """Measures what the folder lacks; all of it without --resume."""
    def needed(name):
        return not (options.resume and (options.folder / f"{name}.json").exists())

    def benchmark(name, program, *arguments, **environment):
        if needed(name):
            run(options, program, *arguments, "--json", options.folder / f"{name}.json", **environment)

    rays = ("--cpu-clock", "--threads", 1, "--repeats", 3)
    benchmark("rays", "trace_benchmark", *rays, *SCENES)
    benchmark("rays_avx2", "trace_benchmark", *rays, *SCENES, PACKTRACE_ISA="avx2")
    benchmark("rays_avx2_both", "trace_benchmark", *rays, *SCENES, "--embree-device", "max_isa=avx2",
              PACKTRACE_ISA="avx2")
    benchmark("rays_large", "trace_benchmark", *rays, *LARGE)
    benchmark("growth", "trace_benchmark", "--growth", "--cpu-clock", "--repeats", 3)
    benchmark("packing", "packing_benchmark", "--seconds", 0.3, "--generated-triangles", 60000, "bunny", "house",
              "generated")
    benchmark("grids", "packing_benchmark", "--seconds", 0, "grids")
    benchmark("import", "import_benchmark", "--repeats", 7)
    for name, triangles, inputs in (("lod_times", 60000, ("bunny", "spaceship", "generated")),
                                    ("lod_times_large", 1000000, ("generated",))):
        benchmark(name, "lod_benchmark", "--times-only", "--repeats", 5, "--generated-triangles", triangles, *inputs)
    benchmark("lod_levels", "lod_benchmark", "--levels-only", "--repeats", 1, "--samples", 20000, "bunny", "spaceship", "generated",
              "--class", "all")
    if options.meshoptimizer:
        benchmark("lod_classes", "lod_benchmark", "--repeats", 1, "--class", "all", "--newest-meshoptimizer",
                  options.meshoptimizer)
    if needed("bakes"):
        measure_bakes(options, options.folder)


class Results:
    def __init__(self, folder):
        self.folder = folder

    def __call__(self, name):
        path = self.folder / f"{name}.json"
        return json.loads(path.read_text()) if path.exists() else {"inputs": []}


def speeds(scene, phase):
    """Speeds by (system, call), and by system of its fastest call."""
    by_call, fastest = {}, {}
    for row in scene["rows"]:
        speed = next(p["mrays_per_s"] for p in row["phases"] if p["phase"] == phase)
        by_call[row["system"], row["call"]] = speed
        fastest[row["system"]] = max(speed, fastest.get(row["system"], 0.0))
    return by_call, fastest


def print_table(head, rows):
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()


def ray_tables(results):
    scenes = results("rays")["inputs"] + results("rays_large")["inputs"]

    def row(title, goal, phase, peer, call=None, file=None):
        in_file = {scene["name"]: scene for scene in (results(file)["inputs"] if file else scenes)}
        cells, ratios = [], []
        for scene in scenes:
            if scene["name"] not in in_file:
                cells.append("-")
                continue
            by_call, fastest = speeds(in_file[scene["name"]], phase)
            theirs = by_call[peer, call] if call else fastest[peer]
            ratios.append(fastest["packed"] / theirs)
            cells.append(f"{ratios[-1]:.2f}")
        return [title, goal, *cells, f"{statistics.mean(ratios):.3f}" if ratios else "-"]

    print("Rays of `packed` per second over those of Embree, one thread.\n")
    print_table(["rays, Embree's tree and call", "goal", *(s["name"] for s in scenes), "mean"], [
        row("camera, default, packets of 16", "1.0 on all", "primary", "Embree default", "16"),
        row("any hits of AO, default, fastest call", "mean 1.15, least 1.0", "ao any", "Embree default"),
        row("the same, `packed` with AVX2", "mean 1.0", "ao any", "Embree default", file="rays_avx2"),
        row("the same, both with AVX2", "mean 1.0", "ao any", "Embree default", file="rays_avx2_both"),
        row("camera, both with AVX2, fastest call", "-", "primary", "Embree default", file="rays_avx2_both"),
        row("any hits of AO, high, fastest call", "mean 1.0", "ao any", "Embree high"),
        row("any hits of AO, robust, fastest call", "-", "ao any", "Embree robust"),
        row("nearest hits of AO, robust, fastest call", "-", "ao closest", "Embree robust"),
    ])
    growth = results("growth").get("growth", {"small_triangles": 0, "large_triangles": 0, "rows": []})
    print_table([f"time of an any-hit ray at {growth['large_triangles']} triangles over that at "
                 f"{growth['small_triangles']}", "growth"],
                [[r["system"], f"{r['time_ratio']['ao any']:.2f}"] for r in growth["rows"]])
    print_table(["resident bytes per triangle", "packed", "Embree default"],
                [[s["name"]] + [f"{next(r['bytes_per_triangle'] for r in s['rows'] if r['system'] == system):.1f}"
                                for system in ("packed", "Embree default")] for s in scenes])


def packing_tables(results):
    names = (("meshoptimizer codecs, zstd 19", "decode"), ("packtrace, codec fast", "open"),
             ("packtrace, codec fast, with trees", "open"), ("Draco, compression level 10", "decode"),
             ("packtrace, codec small", "open"), ("packtrace, codec fast", "decode"))
    inputs = results("packing")["inputs"]
    print("Positions and topology at edge/128: bytes per triangle and, in brackets, million triangles per second.\n")
    rows = []
    for name, speed in names:
        cells = []
        for mesh in inputs:
            codec = next(c for c in mesh["positions"] if c["codec"] == name and c["precision"] == "edge/128")
            cells.append(f"{codec['bytes_per_triangle']:.2f} ({codec[speed + '_mtri_per_s']:.1f})")
        rows.append([f"{name}: {'opening' if speed == 'open' else 'decoding'}", *cells])
    print_table(["codec", *(m["name"] for m in inputs)], rows)
    print("Regular grids, the same: bytes per triangle.\n")
    pairs = (("packtrace, codec fast", "meshoptimizer codecs, zstd 19"),
             ("packtrace, codec small", "Draco, compression level 10"))
    rows = []
    for mesh in results("grids")["inputs"]:
        size = {c["codec"]: c["bytes_per_triangle"] for c in mesh["positions"] if c["precision"] == "edge/128"}
        rows.append([mesh["name"], *(f"{size[ours]:.2f} / {size[theirs]:.2f} = {size[ours] / size[theirs]:.2f}"
                                     for ours, theirs in pairs)])
    print_table(["mesh", "fast / meshoptimizer", "small / Draco"], rows)


def time_tables(results):
    bakes = results("bakes")
    print_table(["import", "CPU ms, one thread", "wall time on one thread / on two"],
                [[r["input"], f"{r['threads'][0]['cpu_ms']['median']:.1f}", f"{r['wall_ratio']:.2f}"]
                 for r in results("import").get("results", [])])
    print_table(["bake with trees, two threads", "median wall s", "least"],
                [[name, f"{statistics.median(times):.2f}", f"{min(times):.2f}"]
                 for name, times in bakes.get("wall_s", {}).items()])
    print_table(["all levels, codec none", "bytes per triangle of level 0"],
                [[name, f"{report['lod']['bytes_per_triangle']:.2f}"]
                 for name, report in bakes.get("levels", {}).items()])


def lod_tables(results):
    rows = []
    for mesh in results("lod_times")["inputs"] + results("lod_times_large").get("inputs", []):
        one, two = mesh["build"][:2]
        rows.append([f"{mesh['name']}, {mesh['triangles']:,}", f"{mesh['triangles'] / one['cpu_s'] * 1e-6:.2f}",
                     f"{one['wall_s'] / two['wall_s']:.2f}"])
    print_table(["levels of detail", "Mtri/s of one thread", "wall time on one thread / on two"], rows)
    print_table(["stated error over the measured one", "median group", "worst group"],
                [[mesh["name"], f"{mesh['groups_stated_to_measured']:.2f}", f"{mesh['worst_group_stated_to_measured']:.2f}"]
                 for mesh in results("lod_levels")["inputs"]])
    print("Simplified meshes: rms, largest distance over those of the newest meshoptimizer; \"exact\": none of ours.\n")
    rows = []
    for mesh in results("lod_classes")["inputs"]:
        of = {(r["simplifier"], r["kept"]): r for r in mesh["simplifiers"]}
        cells = [f"{mesh['name']}"]
        for kept in (0.5, 0.1, 0.01):
            ours, theirs = of["packtrace", kept], of.get(("meshoptimizer, newest", kept))
            cells.append("not taken by theirs" if theirs is None else ", ".join(
                "exact" if ours[d] == 0 else f"{ours[d] / theirs[d]:.2f}" if theirs[d] > 0 else "theirs exact"
                for d in ("rms", "max")))
        rows.append(cells)
    print_table(["mesh", "50 %", "10 %", "1 %"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release/bin"))
    parser.add_argument("--scenes", type=pathlib.Path, default=os.environ.get("PACKTRACE_SCENES", ""))
    parser.add_argument("--folder", type=pathlib.Path, required=True, help="of the results")
    parser.add_argument("--meshoptimizer", help="node_modules/meshoptimizer")
    parser.add_argument("--resume", action="store_true", help="measure only what the folder lacks")
    parser.add_argument("--again", action="store_true", help="measure nothing")
    options = parser.parse_args()
    options.folder.mkdir(exist_ok=True, parents=True)
    if not options.again:
        measure(options)
    results = Results(options.folder)
    machine = results("rays")
    print(f"{machine.get('cpu', '')}, {machine.get('hardware_threads', '')} hardware threads, load average "
          f"{machine.get('load_average', 0):.1f} to {machine.get('load_average_after', 0):.1f}, "
          f"commit {machine.get('commit', '')}.\n")
    for tables in (ray_tables, packing_tables, time_tables, lod_tables):
        tables(results)


if __name__ == "__main__":
    main()
