#pragma once

#include <memory>

#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Embree as its manual has it: the source's triangles placed in the world as floats, rays in the world as well, traced
/// one by one. All surfaces are seen by all rays; hits are not resolved. That is what EmbreeTracer does without its
/// unit space.
/// @param source read here only
std::unique_ptr<RayTracer> raw_embree(const SceneSource& source, bool robust);

} // namespace packtrace
