"""A sample measurement report whose names try to escape into the page, for report_page_test.py."""

import struct
import zlib

HOSTILE = "</script><script>window.pwned = 1</script><img src=x onerror=\"window.pwned=2\"> '\"&amp; \u202egnp"
NOISE = 0.0118


def png(width, height, pixel):
    """Returns a PNG file; pixel(x, y) gives (red, green, blue)."""
    rows = b"".join(b"\0" + b"".join(bytes(pixel(x, y)) for x in range(width)) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def ao(mae):
    """An `ao` object of docs/measure.md."""
    return {"mae": mae, "rmse": 6 * mae, "p99": 12 * mae, "psnr_db": 50.0, "ssim": 0.99, "flip": 7 * mae,
            "mismatched_pixels": 4, "compared_pixels": 57000, "noise_ratio": mae / NOISE}


def point(identifier, label, group, size, mae, rate, resident, bits=None, codec="none"):
    """A measured point."""
    geometries = [{"name": f"{HOSTILE} {i}", "geometry": i, "triangles": 1000 * (i + 1), "bytes": 9000 * (i + 1),
                   "max_distance": 1e-5 * (10 - i), "max_normal_degrees": 0.04} for i in range(10)]
    histogram = {"unit": "units", "edges": [0] + [1e-6 * 2 ** i for i in range(12)], "counts": list(range(12))}
    return {
        "id": identifier, "label": label, "group": group, "status": "ok", "error": None, "reused": False,
        "commands": {"bake": f"packtrace bake '{HOSTILE}.pbrt' -o x.ptk # {identifier}", "render": "packtrace render x.ptk"},
        "knobs": {"positions": {"kind": "bits" if bits else "default", "value": bits}, "normals": "auto", "uvs": "auto",
                  "textures": "none", "codec": codec, "trees": "on", "lod": "off", "purpose": "ao", "spp": 64,
                  "frames": 1, "denoise": False, "lod_error_px": None, "backend": "packed"},
        "bytes": {"file": size, "memory": size, "per_triangle": size / 1.5e6,
                  "streams": [{"name": name, "bytes": size // 2 >> i} for i, name in enumerate(
                      ["positions", "trees", "normals", "indices", "cluster_records", "strings", "padding", "header"])]},
        "resident_bytes": resident, "position": {"max": mae / 10, "rms": mae / 20, "max_of_diagonal": 1e-7, "grid_step": 2e-5},
        "distance": {side: {"max": mae / 10, "mean": mae / 90, "rms": mae / 50} for side in ("to_packed", "to_source")},
        "normal": {"max_degrees": 0.04, "mean_degrees": 0.02, "sampled_max_degrees": 0.9, "sampled_mean_degrees": 0.02},
        "triangles": {"stored": 1500000, "collapsed": 284, "coinciding": 264}, "ao": ao(mae),
        "seconds": {"import": 0.2, "bake": 1.75, "open": 0.008, "bvh": 0.001, "first_ray": 0.009, "render": 0.4},
        "cpu_seconds": {"bake": 2.7, "render": 0.8}, "peak_bytes": {"bake": 129499136, "render": 33764147},
        "mrays_per_s": {"camera": 2.7, "ao": rate}, "embree": {"camera": 5.1, "ao": 7.7},
        "speed_ratio": {"camera": 0.5, "ao": rate / 7.7}, "ms_per_frame": {"camera": 23.0, "ao": 351.0, "denoise": 0},
        "histograms": {"position": histogram, "normal": histogram, "ao": histogram},
        "worst_geometries": {"by_error": geometries, "by_bytes": geometries[::-1]},
        "flags": {"default": identifier == "default", "dominated": False, "knee": identifier == "bits-14",
                  "fronts": ["bytes-error"]}}


def sample():
    """A report with every part."""
    points = [point("default", "default", "default", 11_800_000, 0.000146, 10.5, 12_400_000)]
    for bits in range(8, 23, 2):
        points.append(point(f"bits-{bits}", f"{bits} bits per coordinate", "positions", 5_300_000 + bits * 213_000,
                            0.0001 + 0.0167 * 2 ** -((bits - 8) / 1.4), 11.5 - bits / 20, 8_000_000 + bits * 200_000, bits))
    points.append(point("small", "codec small", "codec", 8_230_000, 0.000146, 10.5, 15_300_000, codec="small"))
    points.append(point("trees-off", HOSTILE, "trees", 8_810_000, 0.000146, 10.4, 18_400_000))
    points.append(point("levels", "levels for all geometries", "lod", 21_000_000, 0.000146, 10.2, 21_600_000))
    failed = {key: None for key in points[0]} | {
        "id": "bits-40", "label": "40 bits per coordinate", "group": "positions", "status": "failed", "reused": False,
        "error": {"stage": "bake", "exit_code": 3, "signal": None, "message": HOSTILE},
        "commands": points[0]["commands"], "knobs": points[0]["knobs"],
        "flags": {"default": False, "dominated": None, "knee": False, "fronts": []}}
    fronts = [{"name": name, "x": x, "y": y, "x_label": x, "y_label": y, "knee_id": "bits-14",
               "ids": [p["id"] for p in points if p["group"] == "positions"]}
              for name, x, y in (("bytes-error", "bytes.file", "ao.mae"), ("bytes-distance", "bytes.file", "distance.to_source.rms"),
                                 ("speed-error", "mrays_per_s.ao", "ao.mae"), ("memory-error", "resident_bytes", "ao.mae"))]
    pictures = [{"id": i, "title": HOSTILE if i == "default" else i, "width": 32, "height": 18, "float": "pictures/float.png",
                 "packed": f"pictures/{i}.png", "difference": "pictures/difference.png", "difference_white": 0.05}
                for i in ("default", "bits-10")]
    tiles = [{"point_id": "bits-10", "x": 32 * i, "y": 0, "width": 32, "height": 32, "mae": 0.09, "max": 0.8, "geometry": HOSTILE,
              "float": "pictures/float.png", "packed": "pictures/bits-10.png", "difference": "pictures/difference.png"} for i in range(4)]
    return {
        "schema": "packtrace-measure", "schema_version": 1, "program": {"name": "packtrace", "version": "0.1.0"},
        "command": f"packtrace measure '{HOSTILE}'", "started": "2026-01-31T12:00:00Z", "seconds": 181.2,
        "machine": {"cpu": HOSTILE, "hardware_threads": 2, "threads": 2, "memory_bytes": 17179869184, "system": "Linux", "isa": "avx2"},
        "scene": {"path": HOSTILE, "name": HOSTILE, "triangles": 1570630, "placed_triangles": 1570630, "geometries": 270,
                  "instances": 270, "materials": 30, "cameras": 1, "files": 272, "file_bytes": 49040959, "float_bytes": 38000000,
                  "diagonal": 52.9, "bounds": {"lo": [0, 0, 0], "hi": [1, 1, 1]}, "median_edge": 0.003},
        "settings": {"mode": "default", "width": 320, "height": 180, "camera": 0, "ao_radius": 5.29, "spp": 64, "seed": 0,
                     "noise_seed": 1, "distance_samples": 200000, "tile_px": 32, "embree_beside_each_point": True},
        "reference": {"commands": [], "noise_floor": ao(NOISE), "mean_ao": 0.7}, "points": points + [failed],
        "default_id": "default", "fronts": fronts,
        "convergence": [{"frames": 2 ** i, "spp": 1, "noisy": ao(0.16 / 2 ** (i / 2)), "denoised": ao(0.03 / 2 ** (i / 4)),
                         "ms_per_frame": {"ao": 5.6, "denoise": 4.2}} for i in range(7)],
        "lod": [{"error_px": e, "triangles": int(1.5e6 / (1 + 2 * e)), "traced_ratio": 1.0, "ao": ao(0.00015 + 0.002 * e),
                 "mrays_per_s": {"camera": 2.5, "ao": 10.5 + e}, "ms_per_frame": {"camera": 23, "ao": 350}} for e in (0, 0.5, 1, 2, 4)],
        "resolution": [{"ao_resolution": r, "spp": s, "rays": 50000 * s // (4 if r == "quarter" else 1), "ao": ao(0.1 / s ** 0.5),
                        "ms": {"ao": 5.0 * s, "upsample": 3.0 if r == "quarter" else 0}} for r, s in
                       (("full", 1), ("full", 4), ("quarter", 1), ("quarter", 4), ("quarter", 16))],
        "tiles": tiles, "pictures": pictures,
        "answers": [{"question": f"Question {i}?", "text": f"Answer {i} {HOSTILE}", "command": "packtrace", "figures": []} for i in range(5)],
        "counts": {"points": len(points) + 1, "ok": len(points), "failed": 1, "reused": 0}}
