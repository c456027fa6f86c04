#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/shade/bsdf.h"
#include "runtime/shade/light_set.h"
#include "runtime/shade/shadow_rays.h"
#include "runtime/trace/source/texture_pyramids.h"

namespace packtrace {

/// Data for shading a scene besides its surfaces: lights, and tables per material.
class ShadeScene {
public:
  /// @param source must outlive this object
  /// @param memory reserves the mip levels
  /// Throws MemoryError.
  explicit ShadeScene(const SceneSource& source, const std::optional<MemoryBudget>& memory = {});

  const LightSet& lights() const { return lights_; }
  /// LightSet::turn().
  void turn_lights(float degrees) { lights_.turn(degrees); }
  const DirectionalAlbedo& albedo(uint32_t material) const { return albedos_[albedo_of_[material]]; }
  /// The textures with their mip levels.
  const TexturePyramids& textures() const { return textures_; }
  /// Kinds of surfaces that light may pass.
  Glass glass() const { return glass_; }

private:
  LightSet lights_;
  TexturePyramids textures_;
  std::vector<uint32_t> albedo_of_; ///< by material
  std::vector<DirectionalAlbedo> albedos_;
  Glass glass_ = Glass::kNone;
};

} // namespace packtrace
