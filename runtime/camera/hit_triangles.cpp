#include "runtime/camera/hit_triangles.h"

namespace packtrace {

void HitTriangles::resolve(const RayTracer& tracer, const SceneSource& source) {
  for (uint32_t t = 0; t < count_; ++t) {
    const HitSurface& surface = surfaces_[t] = tracer.resolve(hits_[t]);
    instances_[t] = surface.placement->instance;
    triangles_[t] = surface.triangle;
    places_[t] = {surface.placement->instance, surface.triangle, Vec2(hits_[t].u, hits_[t].v)};
  }
  has_normals_ = source.look_up_triangles({places_, count_}, {attributes_, count_});
  for (uint32_t t = 0; t < count_; ++t) {
    materials_[t] = has_normals_ ? attributes_[t].material : source.material_of(instances_[t], triangles_[t]);
    columns_.set(t, surfaces_[t].vertices, attributes_[t].normals);
  }
}

} // namespace packtrace
