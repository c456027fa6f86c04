#!/usr/bin/env python3
"""Compiles with clang what is written in compiler vectors, as the preset `fuzz` does and no other (docs/fuzzing.md).

Usage: clang_compiles.py BUILD_DIRECTORY      one whose compile_commands.json names GCC
Checks syntax and types only. Exit codes: 0 all compile, 1 some do not, 77 there is no clang++-19.
"""
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

SOURCE = pathlib.Path(__file__).resolve().parents[2]
VECTORS = re.compile(r"vector_size|__builtin_shuffle|immintrin\.h")
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)


def uses_vectors(path, seen):
    """Whether the file, or one that it includes, mentions the compiler's vectors."""
    if path in seen or not path.is_file():
        return False
    seen.add(path)
    text = path.read_text()
    return bool(VECTORS.search(text)) or any(uses_vectors(SOURCE / name, seen) for name in INCLUDE.findall(text))


def batch_of_vectors(path):
    """Of a batch of sources (CMake's unity build) those that use vectors, as a source; None for other files."""
    if "Unity" not in path.parts:
        return None
    sources = INCLUDE.findall(path.read_text())
    return "".join(f'#include "{source}"\n' for source in sources if uses_vectors(pathlib.Path(source), set()))


def clang_command(clang, command):
    """GCC's command without the launcher, the source, the output, choices of warnings and GCC's precompiled headers."""
    words = shlex.split(command)
    words = words[next(i for i, word in enumerate(words) if re.search(r"(^|/)(c|g)\+\+", word)) + 1:]
    kept = [word for word in words
            if not re.match(r"-W|-o$|-c$|-fsanitize|-fpch-preprocess$|-include$|.*(\.o|cmake_pch\.hxx)$", word)]
    return [clang, "-fsyntax-only", "-w", "-D_GLIBCXX_ASSERTIONS", *kept[:-1], "-x", "c++"]


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    clang = shutil.which("clang++-19")
    if clang is None:
        print("skipped: there is no clang++-19")
        return 77
    entries = json.loads((pathlib.Path(sys.argv[1]) / "compile_commands.json").read_text())
    chosen = {}
    for entry in entries:
        path = pathlib.Path(entry["file"])
        if "tests" not in path.relative_to(SOURCE).parts and uses_vectors(path, set()):
            chosen.setdefault(path, entry)
    if not chosen:
        print("no source uses vectors: the search for them is broken")
        return 1

    def compile_one(item):
        path, entry = item
        batch = batch_of_vectors(path)
        return subprocess.run([*clang_command(clang, entry["command"]), str(path) if batch is None else "-"], input=batch or "",
                              cwd=entry["directory"], capture_output=True, text=True)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(zip(chosen, pool.map(compile_one, chosen.items())))
    for path, result in results:
        if result.returncode != 0:
            print(f"{path.relative_to(SOURCE)}: does not compile\n{result.stderr}")
    failed = sum(result.returncode != 0 for _, result in results)
    print(f"{len(results)} sources use vectors, {failed} do not compile with clang")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
