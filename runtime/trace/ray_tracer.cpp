#include "runtime/trace/ray_tracer.h"

#include "pbrt_import/base/error.h"

namespace packtrace {

void RayTracer::place_instances(std::span<const uint32_t> instances, std::span<const Affine>) {
  if (instances.empty()) return;
  throw Error(ErrorKind::kUsage, "this tracer has no instances that may move");
}

std::array<DVec3, 3> RayTracer::object_vertices(const RayHit&, const HitSurface&) const {
  throw Error(ErrorKind::kUsage, "this tracer has no instances that may move");
}

} // namespace packtrace
