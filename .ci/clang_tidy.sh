#!/usr/bin/env bash
# Runs clang-tidy with the checks of .clang-tidy on product sources that changed since main, or on all of them, which
# takes about four CPU seconds per file.
# Usage: .ci/clang_tidy.sh [all]
set -euo pipefail
cd "$(dirname "$0")/.."
most=15 # keeps this below a minute on two cores
sources=('pbrt_import/*.cpp' 'compress/*.cpp' 'runtime/*.cpp')
if [ "${1:-}" = all ]; then
  files=$(git ls-files "${sources[@]}")
else
  base=$(git merge-base HEAD origin/main 2>/dev/null || git merge-base HEAD main 2>/dev/null || echo HEAD)
  # On main itself: what its last commit changed.
  [ "$base" != "$(git rev-parse HEAD)" ] || base=$(git rev-parse -q --verify HEAD~1 || echo HEAD)
  files=$(git diff --name-only --diff-filter=d "$base" -- "${sources[@]}")
fi
# A build folder of its own, because batched builds hide the single sources. Nothing is built there.
cmake --preset tools -B build/tidy -DPACKTRACE_UNITY= >/dev/null
# Only files that the preset compiles (the Python module and AVX2 kernels may be left out) without files that a build makes.
files=$(for file in $files; do
  grep -qF "/$file\"" build/tidy/compile_commands.json && ! grep -q '#include <.*\.inc>' "$file" && echo "$file"
done || true)
[ -n "$files" ] || { echo "No sources changed."; exit 0; }
count=$(wc -w <<<"$files")
if [ "${1:-}" != all ] && [ "$count" -gt "$most" ]; then
  echo "$count files changed: checking the first $most of them; ./check.sh tidy checks all."
  files=$(head -n "$most" <<<"$files")
fi
echo "$(wc -w <<<"$files") files"
# GCC's warnings are the compiler's business (-w); its precompiled headers mean nothing to clang.
xargs -P "$(nproc)" -n 4 clang-tidy-19 -p build/tidy --quiet --extra-arg=-w <<<"$files" 2> >(grep -E 'error:' >&2 || true)
