#!/usr/bin/env bash
# From a fresh Debian 12 to a denoised ambient-occlusion picture of a real pbrt-v3 scene, traced over packed data.
# Usage: ./quickstart.sh [SCENE.pbrt]      (default: assets/town/town.pbrt)
set -euo pipefail
cd "$(dirname "$0")"
started=$SECONDS
scene=${1:-assets/town/town.pbrt}
out=build/quickstart
packtrace=build/release/bin/packtrace

echo "== 1/4 Debian packages"
bash .ci/install_packages.sh
echo "== 2/4 Build"
cmake --preset release >/dev/null
cmake --build --preset release --target packtrace
mkdir -p "$out"
echo "== 3/4 Bake $scene"
"$packtrace" bake "$scene" -o "$out/scene.ptk" --force --json "$out/bake.json"
echo "== 4/4 Trace and denoise"
"$packtrace" render "$out/scene.ptk" -o "$out/picture.png" -o "$out/layers.exr" --aov shaded --frames 32 --supersample 2 --force --json "$out/render.json"
"$packtrace" render "$out/scene.ptk" -o "$out/ao.png" --frames 32 --force --quiet
echo
"$packtrace" info "$out/scene.ptk"
echo
echo "Done in $((SECONDS - started)) s:"
echo "  $out/picture.png   denoised ambient occlusion times albedo"
echo "  $out/ao.png        the ambient occlusion alone"
echo "  $out/layers.exr    every layer: ao, ao_raw, depth, normal, instance, albedo, shaded"
echo "  $out/scene.ptk     the baked scene; the table above says what each byte is for"
