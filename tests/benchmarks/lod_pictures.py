#!/usr/bin/env python3
"""What levels of detail do to pictures, work and memory: the figures of docs/lod_runtime.md, as tables in Markdown.

Usage: lod_pictures.py BIN_DIRECTORY FOLDER [TABLE ...]
  BIN_DIRECTORY  that has packtrace and packtrace_scenegen, for example build/release/bin
  FOLDER         for baked files and pictures; files that are there already are used again
  TABLE          quality, culling, schemes (default: all)
Scenes of others come from the folder that PACKTRACE_SCENES names; without it only those of assets/ and generated ones are measured.
Times are the least of three, all variants in turn, on one thread.
"""
import json
import os
import pathlib
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
SIZE = ["--size", "640x360", "--frames", "1", "--no-denoise", "--aov", "ao"]
ERRORS_PX = ["0.25", "0.5", "1", "2", "4"]


class Bench:
    def __init__(self, binaries, folder):
        self.binaries = pathlib.Path(binaries).resolve()
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.scenes = os.environ.get("PACKTRACE_SCENES")

    def packtrace(self, *arguments):
        """Runs a verb; returns what it writes as JSON."""
        report = self.folder / "report.json"
        subprocess.run([self.binaries / "packtrace", *map(str, arguments), "--json", report, "--force", "-q"], check=True,
                       stderr=subprocess.DEVNULL)
        return json.loads(report.read_text())

    def baked(self, name):
        """The scene with levels of all geometries, baked where it is not there yet; None without the scene."""
        file = self.folder / f"{name}.ptk"
        if file.exists():
            return file
        if name == "town":
            scene = SOURCE / "assets/town/town.pbrt"
        elif name == "asteroids":
            scene = self.folder / "asteroids/asteroids.pbrt"
            if not scene.exists():
                subprocess.run([self.binaries / "packtrace_scenegen", "asteroids", "-o", scene.parent], check=True)
        elif self.scenes:
            scene = pathlib.Path(self.scenes) / name / "scene.pbrt"
        else:
            return None
        self.packtrace("bake", scene, "-o", file, "--lod", "all", "--codec", "none")
        return file

    def picture(self, name, file, *options):
        """Renders 32 occlusion rays a pixel; returns (picture, report)."""
        picture = self.folder / f"{name}.exr"
        camera = ["--camera", "auto"] if file.stem == "spaceship" else []
        return picture, self.packtrace("render", file, "-o", picture, *SIZE, "--spp", "32", *camera, *options)

    def psnr(self, picture, reference):
        psnr = self.packtrace("compare", picture, reference, "--layer", "ao")["metrics"]["psnr_db"]
        return "same" if psnr is None else f"{psnr:.1f}"


def row(*cells):
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)


def head(*cells):
    row(*cells)
    print("|" + "---|" * len(cells), flush=True)


def quality(bench):
    """Occlusion against level 0, by the error allowed and which rays meet levels."""
    head("", "other seed", "rays", *(f"{px} px" for px in ERRORS_PX), "mean of level 0, then by error", "thousand triangles, the same")
    for name in ["bunny", "spaceship", "house", "town"]:
        file = bench.baked(name)
        if file is None:
            continue
        reference, full = bench.picture(f"{name}_full", file, "--lod-error", "1", "--lod-scheme", "off")
        noise = bench.psnr(bench.picture(f"{name}_seed", file, "--seed", "1")[0], reference)
        for rays in ["all", "occlusion"]:
            reports, psnr = [full], []
            for px in ERRORS_PX:
                picture, report = bench.picture(f"{name}_{rays}_{px}", file, "--lod-error", px, "--lod-rays", rays)
                psnr.append(bench.psnr(picture, reference))
                reports.append(report)
            row(name, noise, rays, *psnr, " ".join(f"{report['mean_ao']:.3f}".lstrip("0") for report in reports),
                " ".join(f"{report['lod']['traced_triangles'] / 1e3:.4g}" for report in reports))


def culling(bench):
    """What coarser levels of instances that are not seen save, and what that shows."""
    head("scene", "cull, scale", "culled", "builds", "thousand triangles traced", "thousand triangles built", "dB", "mean")
    for name in ["town", "asteroids"]:
        file = bench.baked(name)
        reference, _ = bench.picture(f"{name}_full", file, "--lod-error", "1", "--lod-scheme", "off")
        for cull, scale in [("frustum", 1), ("frustum", 4), ("frustum", 16), ("visible", 4), ("visible", 16)]:
            picture, report = bench.picture(f"{name}_{cull}_{scale}", file, "--lod-error", "1", "--lod-rays", "occlusion",
                                            "--lod-cull", cull, "--lod-culled-scale", scale)
            lod = report["lod"]
            row(name, f"{cull}, {scale}", lod["instances_culled"], lod["builds"], f"{lod['traced_triangles'] / 1e3:,.0f}",
                f"{lod['built_triangles'] / 1e3:,.0f}", bench.psnr(picture, reference), f"{report['mean_ao']:.4f}")


def schemes(bench):
    """Builds, memory and times of each way to share structures, both tracers."""
    file = bench.baked("asteroids")
    names = ["none", "off", "one-provider", "steps"]
    options = {name: [] if name == "none" else ["--lod-error", "1", "--lod-scheme", name] for name in names}
    runs = {(backend, name): [] for backend in ["packed", "embree"] for name in names}
    for _ in range(3):
        for (backend, name), reports in runs.items():
            if backend == "embree" and name == "off":
                continue  # same as "none"
            reports.append(bench.packtrace("render", file, "-o", bench.folder / "scheme.exr", "--frames", "1", "--spp", "2", "--no-denoise",
                                           "--aov", "ao", "--threads", "1", "--backend", backend, *options[name]))

    def value(backend, name, path, least=True):
        found = []
        for report in runs[backend, name]:
            for key in path.split("/"):
                report = report.get(key) if report is not None else None
            found.append(report)
        return None if not found or found[0] is None else min(found) if least else found[0]

    def line(title, backend, path, scale, digits):
        values = [value(backend, name, path) for name in names]
        row(title, *("" if v is None else f"{v * scale:.{digits}f}" for v in values))

    head("", *names)
    line("builds", "packed", "lod/builds", 1, 0)
    line("own cuts' builds", "packed", "lod/own_cuts/builds", 1, 0)
    line("triangles traced, by own cuts", "packed", "lod/traced_ratio", 1, 2)
    line("plan (ms)", "packed", "lod/seconds/plan", 1e3, 1)
    line("packed: trees above clusters' nodes (ms)", "packed", "lod/seconds/trees", 1e3, 1)
    line("packed: trees (MB), worst case", "packed", "lod/trees/worst_case_bytes", 1e-6, 2)
    line("packed: trees (MB), compacted", "packed", "lod/trees/resident_bytes", 1e-6, 2)
    line("packed: camera rays (s)", "packed", "seconds/primary", 1, 2)
    line("packed: occlusion (s)", "packed", "seconds/ao", 1, 2)
    line("Embree: decode and build (s)", "embree", "seconds/bvh", 1, 2)
    line("Embree: trees (MB), compacted", "embree", "lod/trees/resident_bytes", 1e-6, 1)
    line("Embree: trees and buffers (MiB)", "embree", "resident_bytes/bvh", 1 / 2**20, 0)
    line("Embree: camera rays (s)", "embree", "seconds/primary", 1, 2)
    line("Embree: occlusion (s)", "embree", "seconds/ao", 1, 2)


def main():
    tables = {"quality": quality, "culling": culling, "schemes": schemes}
    chosen = sys.argv[3:] or list(tables)
    if len(sys.argv) < 3 or any(name not in tables for name in chosen):
        sys.exit(__doc__)
    bench = Bench(sys.argv[1], sys.argv[2])
    for name in chosen:
        print(f"\n{tables[name].__doc__}\n")
        tables[name](bench)


if __name__ == "__main__":
    main()
