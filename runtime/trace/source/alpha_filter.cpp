#include "runtime/trace/source/alpha_filter.h"

namespace packtrace {

bool surface_present(const SceneSource& source, uint32_t instance, uint32_t triangle, Vec2 barycentrics,
                     bool occlusion_ray) {
  const Material& material = source.materials()[source.material_of(instance, triangle)];
  const bool all_rays = (material.flags & kAlphaMask) && material.alpha_mask != kNoMask;
  const bool shadows = occlusion_ray && (material.flags & kShadowAlphaMask) && material.shadow_alpha_mask != kNoMask;
  if (!all_rays && !shadows) return true;
  const Vec2 uv = interpolated_uv(source.corner_uvs(source.instances()[instance].geometry, triangle), barycentrics);
  if (all_rays && !source.mask(material.alpha_mask).opaque(uv)) return false;
  return !shadows || source.mask(material.shadow_alpha_mask).opaque(uv);
}

} // namespace packtrace
