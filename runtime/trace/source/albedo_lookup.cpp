#include "runtime/trace/source/albedo_lookup.h"

namespace packtrace {

Vec3 surface_albedo(const SceneSource& source, uint32_t geometry, uint32_t triangle, uint32_t material,
                    Vec2 barycentrics) {
  const Material& of_hit = source.materials()[material];
  if (of_hit.albedo_texture == kNoTexture) return of_hit.albedo;
  return source.texture(of_hit.albedo_texture).sample(source.uv(geometry, triangle, barycentrics));
}

} // namespace packtrace
