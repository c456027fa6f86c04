#!/usr/bin/env bash
# Installs the Debian 12 packages for building and testing, and those named as arguments. Does nothing if all are
# installed.
# Usage: .ci/install_packages.sh [PACKAGE ...]
set -euo pipefail

packages=(
  g++ cmake ninja-build ccache pkg-config
  libtbb-dev libglm-dev libembree-dev libopenexr-dev libopenmesh-dev libxxhash-dev libzstd-dev libstb-dev zlib1g-dev
  libcli11-dev libfmt-dev nlohmann-json3-dev
  libgtest-dev libbenchmark-dev python3
  glslang-tools spirv-tools libvulkan-dev mesa-vulkan-drivers # compile the GLSL of vertex16 and run it on the CPU
  libdraco-dev libtinygltf-dev # glTF export
  libmeshoptimizer-dev # compared with in the packing benchmark
  "$@"
)

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

echo "Installing: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "Run as root, or install sudo, to add the packages above." >&2; exit 1; }
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
