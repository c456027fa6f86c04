#!/usr/bin/env python3
"""Proposes limits for tests/regression/limits.json. Never changes that file.

Runs the regression tests, derives a limit from each measured value, prints what would change, and writes the proposal
next to the build: read the differences, give each change a reason ("why"), and copy what is right by hand.

    tests/regression/propose_limits.py [--build build/release] [--output FILE]
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
EXACT = ("triangles", "errors")


def round_up(value, digits=4):
    if value == 0:
        return 0
    scale = 10 ** (digits - 1 - math.floor(math.log10(abs(value))))
    return math.ceil(value * scale - 1e-9) / scale


def limit_of(name, value, margins):
    """The limit for a measured value: room for other CPUs' rounding, none for regressions."""
    if name in EXACT:
        return int(value)
    kind = next(kind for kind in margins if name.endswith(kind))
    limit = value * margins[kind]["factor"] + margins[kind]["plus"]
    return math.ceil(limit) if name.startswith("bytes") else round_up(limit)


def measure(build):
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "PACKTRACE_MEASURED": folder}
        for test in ("shipped_regression", "shared_regression", "stability"):
            program = build / "bin" / f"packtrace_{test}_test"
            if not program.exists():
                sys.exit(f"{program} is not built")
            subprocess.run([program, "--gtest_brief=1"], env=environment, stdout=subprocess.DEVNULL, check=False)
        return [json.loads(path.read_text()) for path in sorted(pathlib.Path(folder).iterdir())]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=SOURCE / "build/release")
    parser.add_argument("--output", type=pathlib.Path, help="default: BUILD/limits.proposed.json")
    arguments = parser.parse_args()
    limits = json.loads((SOURCE / "tests/regression/limits.json").read_text())
    changes = 0
    for item in measure(arguments.build):
        entry = limits[item["group"]].setdefault(item["scene"], {"why": "", "limits": {}, "measured": {}})
        for name, value in item["metrics"].items():
            old, new = entry["limits"].get(name), limit_of(name, value, limits["margins"])
            measured = entry["limits"].get(name) if name in EXACT else entry["measured"].get(name)
            if measured is not None and math.isclose(measured, value, rel_tol=1e-4):
                continue
            changes += 1
            print(f"{item['group']}/{item['scene']}: {name}: measured {measured} -> {value:.6g}, limit {old} -> {new}")
            entry["limits"][name] = new
            if name not in EXACT:
                entry["measured"][name] = int(value) if name.startswith("bytes") else float(f"{value:.5g}")
    output = arguments.output or arguments.build / "limits.proposed.json"
    output.write_text(text_of(limits))
    print(f"{changes} values differ; proposal in {output}")


def text_of(limits):
    """JSON with one line per object of the innermost level."""
    lines = ["{"]
    for number, (key, value) in enumerate(limits.items()):
        end = "," if number + 1 < len(limits) else ""
        if key not in ("assets", "shared", "stability"):
            lines.append(f"  {json.dumps(key)}: {json.dumps(value)}{end}")
            continue
        lines.append(f"  {json.dumps(key)}: {{")
        for last, (scene, entry) in enumerate(sorted(value.items())):
            lines.append(f"    {json.dumps(scene)}: {{")
            parts = [f"      {json.dumps(name)}: {json.dumps(part)}" for name, part in entry.items()]
            lines += [part + "," for part in parts[:-1]] + parts[-1:]
            lines.append("    }," if last + 1 < len(value) else "    }")
        lines.append(f"  }}{end}")
    return "\n".join([*lines, "}", ""])


if __name__ == "__main__":
    main()
