#!/usr/bin/env python3
"""Compiles with clang what is written in compiler vectors, as the preset `fuzz` does and no other (docs/fuzzing.md).

Usage: clang_compiles.py BUILD_DIRECTORY [all]      one whose compile_commands.json names GCC
Checks syntax and types only, of what changed since main (on main itself: in its last commit), or of all. Exit codes: 0 all compile, 1 some do not, 77 there is no clang++-19.
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


def add_files(path, files):
    """Adds the file and what it includes, directly or not, from this repository or the batch's list."""
    if path in files or not path.is_file():
        return
    files.add(path)
    for name in INCLUDE.findall(path.read_text()):
        add_files(SOURCE / name, files)


def changed_files():
    """Paths that differ from main, as .ci/clang_tidy.sh chooses them; None outside a git checkout."""
    def git(*words):
        result = subprocess.run(["git", *words], cwd=SOURCE, capture_output=True, text=True)
        return result.stdout.strip() if result.returncode == 0 else ""

    base = git("merge-base", "HEAD", "origin/main") or git("merge-base", "HEAD", "main")
    if not base or base == git("rev-parse", "HEAD"):
        base = git("rev-parse", "-q", "--verify", "HEAD~1")
    return {SOURCE / name for name in git("diff", "--name-only", base).splitlines()} if base else None


def clang_command(clang, command):
    """GCC's command without the launcher, the output, choices of warnings and GCC's precompiled headers."""
    words = shlex.split(command)
    words = words[next(i for i, word in enumerate(words) if re.search(r"(^|/)(c|g)\+\+", word)) + 1:]
    kept = [word for word in words
            if not re.match(r"-W|-o$|-c$|-fsanitize|-fpch-preprocess$|-include$|.*(\.o|cmake_pch\.hxx)$", word)]
    return [clang, "-fsyntax-only", "-w", "-D_GLIBCXX_ASSERTIONS", *kept]


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["all"]):
        sys.exit(__doc__)
    clang = shutil.which("clang++-19")
    if clang is None:
        print("skipped: there is no clang++-19")
        return 77
    entries = json.loads((pathlib.Path(sys.argv[1]) / "compile_commands.json").read_text())
    changed = None if sys.argv[2:] else changed_files()
    using, chosen = set(), {}
    for entry in entries:
        path = pathlib.Path(entry["file"])
        if "tests" in path.relative_to(SOURCE).parts or path in using:
            continue
        files = set()
        add_files(path, files)
        if not any(VECTORS.search(file.read_text()) for file in files):
            continue
        using.add(path)
        if changed is None or files & changed:
            chosen[path] = entry
    if not using:
        print("no source uses vectors: the search for them is broken")
        return 1

    def compile_one(entry):
        return subprocess.run(clang_command(clang, entry["command"]), cwd=entry["directory"], capture_output=True, text=True)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(zip(chosen, pool.map(compile_one, chosen.values())))
    for path, result in results:
        if result.returncode != 0:
            print(f"{path.relative_to(SOURCE)}: does not compile\n{result.stderr}")
    failed = sum(result.returncode != 0 for _, result in results)
    print(f"{len(using)} sources use vectors, {len(results)} of them changed, {failed} do not compile with clang")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
