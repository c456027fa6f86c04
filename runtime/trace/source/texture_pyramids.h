#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// The textures that a scene's materials show, with their mip levels: each level halves the sides of the one before,
/// down to one texel. Levels hold means in linear light, rounded to 8 sRGB-encoded bits. Building takes one pass over
/// each texture; the levels take one byte per texel of the texture itself.
class TexturePyramids {
public:
  /// @param source must outlive this object
  /// @param memory reserves the levels, and one in floats while they are made; unset: no limit
  /// Throws MemoryError before anything is made.
  explicit TexturePyramids(const SceneSource& source, const std::optional<MemoryBudget>& memory = {});

  /// Mean of a texture over a parallelogram of texture coordinates, linear sRGB: up to kMaxProbes samples along its
  /// longer axis, each interpolated within and between the two levels whose texels are about as large as the shorter
  /// axis. A parallelogram smaller than a texel gives TextureView::sample(). Source: Williams, Pyramidal Parametrics,
  /// SIGGRAPH 1983; McCormack et al., Feline: Fast Elliptical Lines for Anisotropic Texture Mapping, SIGGRAPH 1999.
  /// @param texture an index in Material::albedo_texture
  /// @param uv its middle
  /// @param side_a, side_b its sides
  Vec3 mean(uint32_t texture, Vec2 uv, Vec2 side_a, Vec2 side_b) const;

  /// Memory of the levels.
  uint64_t bytes() const;

  static constexpr int kMaxProbes = 8;

private:
  struct Pyramid {
    TextureView full;
    std::vector<std::vector<uint8_t>> texels; ///< of the levels below the full one
    std::vector<TextureView> levels;          ///< all; the first is `full`
  };
  static void build(Pyramid& pyramid);

  MemoryReservation memory_;      ///< of the levels
  std::vector<Pyramid> pyramids_; ///< by texture; without levels if no material shows it
};

} // namespace packtrace
