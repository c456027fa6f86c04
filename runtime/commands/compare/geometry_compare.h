#pragma once

#include <cstdint>
#include <string>

namespace packtrace {

struct GlobalOptions;
struct SceneOptions;

/// Number of points that `compare FILE.ptk SCENE.pbrt` samples on each side unless told otherwise.
inline constexpr uint64_t kDefaultDistanceSamples = 200'000;

/// Runs `packtrace compare FILE.ptk SCENE.pbrt`: the surfaces of a baked file against those of its source.
/// @param scene how the scene was read when the file was baked
/// Throws like load_scene() and surface_error(), and Error(kUsage) unless the first is a baked file and the second a
/// scene.
int compare_geometry(const std::string& test, const std::string& reference, uint64_t samples, const SceneOptions& scene,
                     const GlobalOptions& globals);

} // namespace packtrace
