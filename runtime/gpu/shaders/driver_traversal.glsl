// Rays through the driver's acceleration structures. CLOSEST: nearest hits, else any hits.
#include "scene.glsl"
#include "unit_ray.glsl"
#include "found.glsl"

layout(binding = 14) uniform accelerationStructureEXT structure;
layout(location = 0) rayPayloadEXT Found found;

// Traces a ray through the whole scene. Returns whether it hits; for nearest hits, u.tmax and `best` say where.
bool trace(inout UnitRay u, inout Best best, uint ray_class) {
  if (scene.placement_count == 0u) return false;
  // Any hits: no closest hit shader runs, and the miss shader says that nothing was hit.
  found = Found(u.tmax, Best(0.0, 0.0, 0u, 0u, 0u), ray_class);
#ifdef CLOSEST
  const uint flags = gl_RayFlagsNoneEXT;
#else
  const uint flags = gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT;
#endif
  traceRayEXT(structure, flags, ray_class, 0, 0, 0, u.origin, u.tnear, u.direction, u.tmax, 0);
  best = found.best;
  if (best.placement == 0xffffffffu) return false;
  u.tmax = found.t;
  return true;
}
