#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// What a file baked for shading holds besides geometry and textures: docs/baked_format.md, Shading.
struct ShadingData {
  std::vector<SurfaceShading> materials; ///< by material
  std::vector<Light> lights;
  std::vector<EnvironmentMap> maps;
};

/// Size of each part of a stream in bytes.
struct ShadingBytes {
  uint64_t materials = 0, lights = 0, maps = 0;
  uint64_t light_count = 0, map_count = 0;
};

/// Encodes the shading of a scene. Radiance of environment maps is rounded to shared exponents: the error of a
/// component is at most 1/256 of the pixel's largest.
/// Throws Error(kInput) for values that read_shading() would refuse, Error(kLimitExceeded) for names that are too long.
std::vector<uint8_t> encode_shading(const Scene& scene);

/// Decodes a stream. Throws Error(kInput), "shading: WHAT", if it is damaged.
/// @param material_count number of materials that the stream must describe
ShadingData read_shading(std::span<const uint8_t> stream, uint64_t material_count);

/// Why a stream is damaged; nothing if it is not. Allocates no more than the stream holds.
std::optional<std::string_view> find_shading_fault(std::span<const uint8_t> stream, uint64_t material_count);

/// Sizes of a stream's parts. The stream must be valid.
ShadingBytes shading_bytes(std::span<const uint8_t> stream, uint64_t material_count);

} // namespace packtrace
