#!/usr/bin/env bash
# Installs, builds and runs packtrace on Debian 12: traces a packed pbrt-v3 scene to a denoised ambient-occlusion image.
# Usage: quickstart.sh [SCENE.pbrt]      (default: assets/town/town.pbrt). Results are in build/quickstart/ beside this script.
set -euo pipefail
root=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
case ${1:-} in
  -h | --help) sed -n '2,3s/^# //p' "$root/quickstart.sh"; exit 0 ;;
  -*) echo "quickstart.sh: no such option: $1" >&2; exit 2 ;;
esac
[ $# -le 1 ] || { echo "quickstart.sh: one scene at a time, but there are $#" >&2; exit 2; }
scene=${1:-$root/assets/town/town.pbrt}
[ -f "$scene" ] || { echo "quickstart.sh: no such scene: $scene" >&2; exit 3; }
scene=$(CDPATH='' cd -- "$(dirname -- "$scene")" && pwd)/$(basename -- "$scene") # the caller's folder may differ
cd -- "$root"
started=$SECONDS
out=build/quickstart
packtrace=build/release/bin/packtrace
run() {
  echo "+ $*" >&2
  "$@"
}

echo "== 1/4 Debian packages"
run bash .ci/install_packages.sh window
echo "== 2/4 Build"
run cmake --preset tools >/dev/null # without tests, benchmarks and Python, which need more packages
run cmake --build --preset tools --target packtrace
mkdir -p "$out"
echo "== 3/4 Bake $scene"
run "$packtrace" bake "$scene" -o "$out/scene.ptk" --force --json "$out/bake.json"
echo "== 4/4 Trace and denoise"
run "$packtrace" render "$out/scene.ptk" -o "$out/picture.png" -o "$out/layers.exr" --aov all --frames 64 \
  --force --json "$out/render.json"
echo
run "$packtrace" info "$out/scene.ptk"
echo
echo "Done in $((SECONDS - started)) s; in $root:"
echo "  $out/picture.shaded.png   denoised ambient occlusion times albedo"
echo "  $out/picture.ao.png       the ambient occlusion alone; beside it depth, normals, instances, albedo"
echo "  $out/layers.exr           all layers in floats"
echo "  $out/scene.ptk            the baked scene; the table above says what each byte is for"
echo
echo "Look at it in a window (H shows the keys):"
echo "  $packtrace view $out/scene.ptk"
