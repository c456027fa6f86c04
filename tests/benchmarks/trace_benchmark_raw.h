#pragma once

#include <memory>

#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Embree used as in its manual: the source's triangles as floats in world space, rays in world space, traced one by
/// one. All rays see all surfaces, and hits are not resolved. This is EmbreeTracer without its unit space.
/// @param source only read during the call
std::unique_ptr<RayTracer> raw_embree(const SceneSource& source, bool robust);

} // namespace packtrace
