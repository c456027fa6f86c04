#!/usr/bin/env bash
# Sets everything up and runs every test and regression limit.
# Usage: ./check.sh [PRESET ...]           (default: release, then the sanitizer build without whole scenes)
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
# Whether the fuzz preset's compiler takes the kernels is a test, and whether shells and man take what is made for them.
bash .ci/install_packages.sh clang-19 zsh fish mandoc groff-base
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-$(nproc)}
for preset in "${presets[@]}"; do
  echo "== Build ($preset)"
  cmake --preset "$preset" -DPACKTRACE_WERROR=ON >/dev/null
  cmake --build --preset "$preset"
  echo "== Test ($preset)"
  exclude=()
  [ "$preset" = release ] || exclude=(--label-exclude scenes) # whole scenes take too long with -O1 and sanitizers
  ctest --preset "$preset" --output-on-failure "${exclude[@]}"
done
echo "All checks passed in $((SECONDS - started)) s."
