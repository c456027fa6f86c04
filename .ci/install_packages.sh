#!/usr/bin/env bash
# Installs Debian 12 packages: those that packtrace itself needs, those of the groups named, and further ones by name.
# Does nothing if all are installed.
# Usage: .ci/install_packages.sh [window | tests | interop | benchmarks | python | PACKAGE ...]
set -euo pipefail

packages=(
  g++ cmake ninja-build pkg-config
  libtbb-dev libglm-dev libembree-dev libopenexr-dev libxxhash-dev libzstd-dev libstb-dev zlib1g-dev libjpeg-dev
  libcli11-dev libfmt-dev nlohmann-json3-dev
  libdraco-dev libmeshoptimizer-dev libwebp-dev # glTF
  libvulkan-volk-dev libvulkan-dev glslang-tools spirv-tools # backend gpu
)
for argument in "$@"; do
  case $argument in
    window) packages+=(libglfw3-dev libimgui-dev libopengl-dev libtomlplusplus-dev) ;; # of packtrace view
    tests)
      packages+=(
        ccache libgtest-dev libopenmesh-dev libtinygltf-dev python3
        mesa-vulkan-drivers vulkan-validationlayers # run GLSL on the CPU, with its use of Vulkan checked
        xvfb xdotool libgl1-mesa-dri # the viewer in a window: a display, keys and mouse, OpenGL in software
        dpkg-dev file # Debian packages of packtrace itself
      ) ;;
    benchmarks) packages+=(libbenchmark-dev libopenmesh-dev libtinygltf-dev libnanovdb-dev libopenvdb-dev libboost-dev) ;; # what packtrace is compared with
    interop) # the caller's Node.js, or Debian's
      command -v npm >/dev/null || packages+=(nodejs npm)
      packages+=(chromium) ;;
    python) packages+=(python3-dev python3-numpy pybind11-dev) ;;
    *) packages+=("$argument") ;;
  esac
done

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

echo "Installing ${#missing[@]} packages and what they depend on: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "Run as root, or install sudo, to add the packages above." >&2; exit 1; }
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" |
  grep -E '^(Need to get|After this operation)' || [ "${PIPESTATUS[0]}" -eq 0 ]
