#!/usr/bin/env bash
# Installs dependencies, builds, and runs all tests with their regression limits.
# Usage: ./check.sh [PRESET ...] (default: release, then asan without the tests on whole scenes)
#        ./check.sh tidy (clang-tidy on all sources; otherwise it checks those that changed since main)
set -euo pipefail
cd "$(dirname "$0")"
started=$SECONDS
presets=("$@")
[ ${#presets[@]} -gt 0 ] || presets=(release asan)

if [ -z "${PACKTRACE_SCENES:-}" ] && [ -d ../shared/scenes ]; then
  PACKTRACE_SCENES=$(cd ../shared/scenes && pwd)
  export PACKTRACE_SCENES
fi
echo "== Debian packages"
# Some tests need these: clang compiles the fuzz preset's kernels, shells and man tools check the generated files, and
# Chromium opens the HTML report.
bash .ci/install_packages.sh tests benchmarks python clang-19 clang-format-19 clang-tidy-19 zsh fish mandoc groff-base chromium
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-$(nproc)}
echo "== Format"
find pbrt_import compress runtime tests assets docs \( -name '*.h' -o -name '*.cpp' \) -print0 |
  xargs -0 clang-format-19 --dry-run -Werror
if [ "${presets[*]}" = tidy ]; then
  echo "== clang-tidy (all sources)"
  exec .ci/clang_tidy.sh all
fi
for preset in "${presets[@]}"; do
  echo "== Build ($preset)"
  options=(-DPACKTRACE_WERROR=ON)
  # The Python module is tested with Debian's interpreter, whichever comes first in the PATH.
  [ "$preset" != release ] ||
    options+=(-DPACKTRACE_BUILD_PYTHON=ON -DPython_EXECUTABLE=/usr/bin/python3 -DPACKTRACE_UNITY=tools)
  cmake --preset "$preset" "${options[@]}" >/dev/null
  [ "$preset" != release ] || { echo "== clang-tidy" && .ci/clang_tidy.sh; }
  cmake --build --preset "$preset"
  echo "== Test ($preset)"
  exclude=()
  [ "$preset" = release ] || exclude=(--label-exclude scenes) # whole scenes take too long with -O1 and sanitizers
  ctest --preset "$preset" --output-on-failure "${exclude[@]}"
done
echo "All checks passed in $((SECONDS - started)) s."
