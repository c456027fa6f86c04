#!/usr/bin/env bash
# Installs dependencies, builds, and runs all tests with their regression limits.
# Usage: ./check.sh [PRESET ...] (default: release, then asan without the tests on whole scenes)
#        ./check.sh interop (glTF with other programs: Khronos validator, three.js, glTF-Transform, gltfpack; needs the network)
#        ./check.sh tidy (clang-tidy on all sources; otherwise it checks those that changed since main)
set -euo pipefail
cd "$(dirname "$0")"
presets=("$@")
[ ${#presets[@]} -gt 0 ] || presets=(release asan)

# begin_stage NAME ends the stage before and prints the name of the next.
stage="" lines=()
begin_stage() {
  local fields cpu
  read -ra fields </proc/$$/stat # 15 and 16: user and system time of waited-for children, in ticks
  cpu=$(((fields[15] + fields[16]) / $(getconf CLK_TCK)))
  [ -z "$stage" ] || lines+=("$(printf '%7d %7d  %s' $((SECONDS - stage_start)) $((cpu - stage_cpu)) "$stage")")
  stage=$1 stage_start=$SECONDS stage_cpu=$cpu
  echo "== $stage"
}

if [ -z "${PACKTRACE_SCENES:-}" ] && [ -d ../shared/scenes ]; then
  PACKTRACE_SCENES=$(cd ../shared/scenes && pwd)
  export PACKTRACE_SCENES
fi
begin_stage "Debian packages"
# Checks link some hundred programs, each with the whole product: lld takes a third to a half of the time of GNU ld.
# Some tests need the others: clang compiles the fuzz preset's kernels, shells and man tools check the generated files, and
# Chromium opens the HTML report.
bash .ci/install_packages.sh window tests benchmarks python clang-19 clang-format-19 clang-tidy-19 lld zsh fish mandoc groff-base chromium
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-$(nproc)}
begin_stage "Format"
find pbrt_import compress runtime tests assets docs \( -name '*.h' -o -name '*.cpp' \) -print0 |
  xargs -0 clang-format-19 --dry-run -Werror
if [ "${presets[*]}" = interop ]; then
  begin_stage "Interoperation"
  bash .ci/install_packages.sh interop
  cmake --preset release -DPython_EXECUTABLE=/usr/bin/python3 -DPACKTRACE_WERROR=ON -DPACKTRACE_BUILD_PYTHON=ON -DPACKTRACE_UNITY=all >/dev/null
  exec cmake --build --preset release --target interop
fi
if [ "${presets[*]}" = tidy ]; then
  begin_stage "clang-tidy (all sources)"
  exec .ci/clang_tidy.sh all
fi
for preset in "${presets[@]}"; do
  begin_stage "Configure ($preset)"
  # Scripts and the Python module are tested with Debian's interpreter, whichever comes first in the PATH.
  options=(-DPython_EXECUTABLE=/usr/bin/python3)
  for kind in EXE SHARED MODULE; do options+=("-DCMAKE_${kind}_LINKER_FLAGS=-fuse-ld=lld"); done
  case $preset in # with the same options, asan finds the objects of tests in ccache
    release)
      options+=(-DPACKTRACE_WERROR=ON -DPACKTRACE_UNITY=all -DPACKTRACE_BUILD_PYTHON=ON -DPACKTRACE_TEST_PROGRAMS=ON)
      ;;
    asan) # without the GPU and the window, which no test opens there
      options+=(-DPACKTRACE_WERROR=ON -DPACKTRACE_UNITY=all -DPACKTRACE_GPU=OFF -DCMAKE_DISABLE_FIND_PACKAGE_glfw3=ON)
      corpus=
      [[ " ${presets[*]} " != *" release "*" asan "* ]] || corpus=$PWD/build/release/tests/fuzz/baked_corpus # built above
      options+=("-DPACKTRACE_BAKED_CORPUS=$corpus")
      ;;
  esac
  cmake --preset "$preset" "${options[@]}" >/dev/null
  [ "$preset" != release ] || { begin_stage "clang-tidy" && .ci/clang_tidy.sh; }
  begin_stage "Build ($preset)"
  cmake --build --preset "$preset"
  begin_stage "Test ($preset)"
  exclude=()
  [ "$preset" = release ] || exclude=(--label-exclude scenes) # whole scenes take too long with -O1 and sanitizers
  ctest --preset "$preset" --output-on-failure "${exclude[@]}"
done
begin_stage "Time"
printf '%7s %7s\n' wall/s CPU/s
printf '%s\n' "${lines[@]}" "All checks passed in $SECONDS s."
