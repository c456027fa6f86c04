#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "compress/exchange/shader/shader_text.h"
#include "compress/format/voxels/proxy_codec.h"

namespace packtrace {

inline constexpr uint32_t kShaderAoRays = 16;

/// Camera and lighting of an exported shader, in voxel units. A pixel's ray is
/// eye + t (forward + u right + v up), with (u, v) = (pixel - resolution / 2) / resolution.y.
struct ShaderView {
  Vec3 eye, right, up, forward;
  float ao_radius;
  /// Cosine-weighted directions about +z. A pixel with hash h mirrors x for bit 0 of h, y for bit 1, and swaps both for
  /// bit 2.
  std::array<Vec3, kShaderAoRays> directions;
  Vec3 background{0.5625f, 0.640625f, 0.75f}; ///< linear
  Vec3 albedo{0.8125f, 0.75f, 0.6875f};       ///< linear, of voxels without swatch
};

/// A view of the whole grid from its front, right and above.
/// @param up axis of the object's space that points up, 0..2
ShaderView shader_view(const VoxelIndex& size, int up);

/// One self-contained shader: the stream as a constant array, its decoder, a tracer that skips empty cells, ambient
/// occlusion and the palette. Colours are encoded with a square root.
/// Throws Error(kLimitExceeded) if the arrays have more than config.max_elements elements.
std::string voxel_shader(const Proxy& proxy, const ShaderView& view, const ShaderConfig& config);

/// Elements of all arrays of voxel_shader(), as kMaxShaderElements counts them.
uint64_t shader_elements(const Proxy& proxy);

} // namespace packtrace
