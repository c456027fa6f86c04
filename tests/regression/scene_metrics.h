#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace packtrace::test {

/// Size of the pictures that scenes are measured with.
struct PictureSettings {
  int width = 160, height = 90;  ///< pixels
  int spp = 64;                  ///< occlusion rays per pixel
  double depth_tolerance = 1e-3; ///< relative difference of depth from which two pixels show different surfaces
};

/// Values by name; docs/testing.md explains each. Larger is worse, except for `triangles` and `errors`, which are
/// exact.
using Metrics = std::map<std::string, double>;

/// Imports and bakes a scene with default options, renders it from floats and from the packed file with each backend,
/// and compares. Deterministic for any number of threads. Metrics of pictures are the worst of the backends and
/// instruction sets; scenes whose own camera sees nothing are framed.
/// @param with_sizes also encode the file with codec small, which takes long under sanitizers
Metrics measure_scene(const std::filesystem::path& scene, const PictureSettings& settings, bool with_sizes);

} // namespace packtrace::test
